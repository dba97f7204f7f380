"""Estimates of the eight parameters: least squares, generalised, robust; what they are worth, what they cannot see."""
