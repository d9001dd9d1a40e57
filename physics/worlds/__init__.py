"""Worlds: a vehicle with a hidden effect, the manoeuvres that it drives, and the log that its sensors write."""
