"""The parts of the workbench page, a file each."""
