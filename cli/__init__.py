"""The command line: one file a verb, options declared once."""
