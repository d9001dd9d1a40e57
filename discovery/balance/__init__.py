"""The balance that judges a model: the momentum balance in weak form, or open-loop rollouts, behind one interface."""
