"""Residuals: measured minus modelled, and the scores by which every model is judged alike."""
