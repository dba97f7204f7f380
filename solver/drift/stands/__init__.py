"""Gyro or stand: whose change it was, since when, how sure that is, and how small a change shows."""
