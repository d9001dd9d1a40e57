"""One file for every check of a log's quality: what is wrong, by how much, what follows, and what to do."""
