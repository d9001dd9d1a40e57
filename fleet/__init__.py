"""Many logs of many boats as one data set: a few kilobytes a log, kept by its contents, and what they say of hulls."""
