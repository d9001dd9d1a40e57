"""Experiments: the manoeuvres that would settle what a log leaves open."""
