"""Built-in experiments: depth rating, the Necker cube, the pinhole demonstration and blur thresholds, a task each."""
