"""What of any model's correction is a named effect, a term without a name, or memory."""
