"""Kinds of faults in logs as people have them: names, frames, values, times and tables, told or read right."""
