"""The corrected model and its series for other tools, one file a format."""
