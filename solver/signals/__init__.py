"""Noise of a sampled current: what its mean is worth, whether it stands still, Allan deviation, coefficients."""
