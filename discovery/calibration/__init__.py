"""Calibration of the numbers a model has already: fitted to logs, freed beside effects, or followed along a log."""
