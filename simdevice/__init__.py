"""The simulated laboratory: gyro, stand and ammeter with physics of their own.

It takes only units and constants from `solver`: orientations are finite rotations made with
scipy's `Rotation`, so that a mistake in the solver's geometry cannot cancel against one here.
SI throughout. Every random draw comes from a seed and a spawn key that names what it is for, so
two runs are equal to the bit at any degree of parallelism.
"""
