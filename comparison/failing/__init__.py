"""Where a model fails: in which regimes, when, how fast, how late, on which heading, and which effect removes it."""
