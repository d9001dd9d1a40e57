"""From channels to motions on an even time base: which are needed, resampled, derived, split and standardised."""
