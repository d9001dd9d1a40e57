"""The same facts on the terminal: tables and sentences, readable at 80 columns."""
