"""The networks: one class a file, all causal, all from physical inputs to a correction of the acceleration."""
