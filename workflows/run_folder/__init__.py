"""The run folder: written whole or not at all, read back and checked, with what it was made from."""
