"""The model as a small program: assignments worked out once, printed in any language."""
