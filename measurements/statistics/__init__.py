"""Statistics of measurements, each once: robust fits, errors and draws by blocks, peaks, white noise, and pairs."""
