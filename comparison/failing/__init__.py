"""Failures of a model: regimes, seconds, frequency, lag and heading of its error, and the effect that removes it."""
