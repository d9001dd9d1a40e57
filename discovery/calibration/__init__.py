"""The numbers that a model has already: fitted to logs, beside effects, or followed along a log."""
