"""Physics: axes, motions, vehicles, the force equation, and the catalogue of effects."""
