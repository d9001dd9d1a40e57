"""Discovery: name the force that the model is missing, or say that the log cannot tell."""
