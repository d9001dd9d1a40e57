"""How sure a finding is, what it is worth, what limits it, and the verdict."""
