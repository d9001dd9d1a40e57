"""Is the log sound? One file for every check of its quality, each with a number, its consequence and the remedy."""
