"""Measurements: from a log in any format to motions on an even time base; read, inspect, prepare, split."""
