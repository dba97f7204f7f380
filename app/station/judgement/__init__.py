"""Judgement on the spot: whether the currents are at rest, what a record is worth, whether partners agree."""
