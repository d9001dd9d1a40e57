"""The verbs as Python functions, from logs to results; command line and notebook call the same ones."""
