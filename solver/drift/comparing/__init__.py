"""Two results, or many gyros, compared: differences in units of U, distributions, correlations."""
