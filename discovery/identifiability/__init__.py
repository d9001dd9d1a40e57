"""Identifiability of effects and parameters: what a log excites, and what it can tell apart."""
