"""Which of them stay: Gram matrices, scores, the floating search, and intervals of what it found."""
