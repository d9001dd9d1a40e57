"""One file for every check of a log's quality."""
