"""Training a network: windows of rows, losses, epochs, and the state from which a training goes on."""
