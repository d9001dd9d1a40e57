"""What a log can show and tell apart, of effects and of parameters."""
