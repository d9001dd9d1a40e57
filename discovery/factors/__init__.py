"""Logs in a few kilobytes: triangular factors that stand for all rows of a regression, and what is fitted to them."""
