"""The search: Gram matrices, scores, floating selection, surrogate tests, and intervals of the selected effects."""
