"""Logs in a few kilobytes: triangular factors that stand for all rows of a regression, and sparse fits to them."""
