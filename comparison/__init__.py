"""All models on the same rows: how wrong they are, which laws they break, which to trust, and where they fail."""
