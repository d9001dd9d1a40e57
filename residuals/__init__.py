"""Residuals: measured minus modelled, the models and networks that answer for them, and scores for all alike."""
