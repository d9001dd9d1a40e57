"""From a log in any shape to motions on an even time base: read, inspect, prepare, split."""
