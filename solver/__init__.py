"""Calibration mathematics of a dynamically tuned gyroscope (DTG) in rate mode.

A gyro stands on a two-axis stand in a number of fixed positions; at each one the mean torquer
currents are measured. From them the solver finds eight parameters of the gyro's error model.
This package is pure: numpy and scipy, no file, no clock, no database, and no memory between calls.

Frames
    Geographic ξ east, η north, ζ up. The platform is reached from it by passive rotations:
    θ about the east axis, then ψ about the platform's own third axis, then the certified
    misalignment α, β, γ (paper, eq. (7)-(9)). Case axes x, y, z.
Units
    SI throughout: rad, rad/s, A, s; specific force in units of g. Laboratory units (arcsec,
    degrees per hour, mA) live in `solver.units`, which only the edges of the product call.
Symbols
    ``kx ky kxy kyx``  torquer scale factors and cross-coupling, rad/(s·A)
    ``w0x w0y``        drift that does not depend on acceleration (bias), rad/s
    ``wg wk``          g-sensitive drift, direct and quadrature, rad/s per g
    ``a b c d e``      elements of the orientation matrix, paper eq. (14)
Rooms
    `calibrate` is the façade; `geometry`, `error_model`, `successive`, `least_squares` and `inputs` are the
    mathematics of one session. `estimators` solve, `propagation` says what limits the answer, `signals` what a
    record's mean is worth, `blunders` what went wrong, `positions` what would be worth measuring.
Arrays hold positions along their first axis; parameters stand in the order of
`solver.records.PARAMETERS`. "Paper, eq. (n)" is the source of the method; its misprints are
corrected and listed in `solver.successive`.
"""

__version__ = "1.1.0"
