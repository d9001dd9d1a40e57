"""App: the workbench in the browser, where a person does the whole job with the mouse."""
