"""What a model is held against: the momentum balance in weak form, or open-loop rollouts; one interface for both."""
