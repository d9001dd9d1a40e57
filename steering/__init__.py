"""Closed loop: a boat that is steered along tracks by controllers that know a model of it, and nothing else."""
