"""Quality of a log: what is wrong with it, by how much, what follows, and what to do."""
