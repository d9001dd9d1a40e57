"""Evidence for and against a named effect: tests, limits, confounders, and what stays unexplained."""
