"""Channels: what each stream of a file means, and how it becomes SI units in NED/FRD axes."""
