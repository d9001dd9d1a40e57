"""undertow finds the physics your boat model is missing."""
