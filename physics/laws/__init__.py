"""The laws of a hull in water: what they say of damping, energy and mass, and the proof that a model keeps them."""
