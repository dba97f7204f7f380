"""What a quantity does over the years: control, trend, forecast, components of variance, and whose change it is.

Everything here judges a `solver.drift.history.History`: values of one quantity, in whatever unit, each
with a time in seconds and a standard uncertainty of its own. Nothing knows what a gyro is but
`attribution`, which tells a change of a stand from one of a gyro.
"""
