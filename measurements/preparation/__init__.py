"""Preparation: channels become motions on an even time base; resampled, derived, split and standardised."""
