"""The loop in the frequency domain: the complex loop gain, its margins, the bandwidth.

With W(s) as in `simdevice.dynamics` the equation A·s²z − iH·(s·z + W·z) = 0 reads 1 + L(s) = 0::

    L(s) = W(s) / (s·(1 + i(A/H)·s))

It has complex coefficients: L(−iω) is not the conjugate of L(iω), the nutation's pole lies at
ω = +H/A alone, and both signs of ω count. The measured rate answers the case rate by
R = (W/s)/(1 + L) and the drift by −L/(1 + L).

The gain margin is the factor that brings L to −1, k·L(iω) = −1. It is above 1: for real s = iω the
rotor turns L by no angle, so L is negative at one |ω| alone, √(1 − 2·T2/T1)/T2, on each side, and a
stable loop stays stable with less gain. The phase margin is the angle that does it, e^(iφ)·L = −1;
turning the torquers' axes by φ against the pickoffs' does just this. |L| = 1 where |N|² = |D|² for
L(iω) = N/D, a polynomial in ω.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike, NDArray

from simdevice.dynamics import LoopDynamics, LoopParameters

ComplexArray = NDArray[np.complex128]
Array = NDArray[np.float64]

# A root of a real polynomial is taken for real when its imaginary part is rounding: a root of
# degree 10 found to 1e-7 of its size, with room.
_REAL = 1e-6
_HALF_POWER = 0.5


@dataclass(frozen=True, slots=True)
class Margin:
    """A margin and where it is found: its value, and ω in rad/s with its sign."""

    value: float
    omega: float


@dataclass(frozen=True, slots=True)
class Margins:
    """Margins for one sign of ω, or the worse of both.

    Attributes
    ----------
    gain
        Factor above 1 by which the gain may rise until the loop is unstable; None: any.
    phase
        Angle, rad, with its sign, by which the loop gain may turn; None: |L| is never 1.
    bandwidth
        |ω|, rad/s, at which the measured rate is first down by 3 dB; None: never.
    """

    gain: Margin | None
    phase: Margin | None
    bandwidth: float | None


@dataclass(frozen=True, slots=True)
class BothSigns:
    """Margins for ω above and below zero."""

    positive: Margins
    negative: Margins

    @property
    def worse(self) -> Margins:
        """The smaller of each."""
        both = (self.positive, self.negative)
        return Margins(
            _least(side.gain for side in both),
            _least(side.phase for side in both),
            min((side.bandwidth for side in both if side.bandwidth is not None), default=None),
        )


def _least(found: Iterable[Margin | None]) -> Margin | None:
    known = (item for item in found if item is not None)
    return min(known, key=lambda item: abs(item.value), default=None)


def loop_gain(parameters: LoopParameters, omega: ArrayLike) -> ComplexArray:
    """L(iω) at ω in rad/s, any sign but not 0 or H/A, where it is infinite."""
    above, below = _loop(parameters)
    omega = np.asarray(omega, dtype=np.float64)
    return np.asarray(above(omega) / below(omega))


def rate_response(parameters: LoopParameters, omega: ArrayLike) -> ComplexArray:
    """R(iω), measured rate by case rate, at ω in rad/s of any sign."""
    above, below = _rate(parameters)
    omega = np.asarray(omega, dtype=np.float64)
    return np.asarray(above(omega) / below(omega))


def drift_response(parameters: LoopParameters, omega: ArrayLike) -> ComplexArray:
    """−L/(1 + L) at iω, measured rate by drift, at ω in rad/s of any sign."""
    above, below = _loop(parameters)
    omega = np.asarray(omega, dtype=np.float64)
    return np.asarray(-above(omega) / (above(omega) + below(omega)))


def phase_crossing(parameters: LoopParameters) -> float:
    """ω*, rad/s: the only |ω| at which L(iω) is real; infinite without lags, NaN where T1 ≤ 2·T2.

    The rotor's factor 1 − ωA/H is real, so W/(iω) decides: Im((1 + iT1·ω)·(1 − iT2·ω)²) = 0.
    """
    t1, t2 = parameters.integral_time, parameters.lag_time
    if t1 <= 2 * t2:
        return float("nan")
    return float(np.sqrt(1 - 2 * t2 / t1) / t2) if t2 else float("inf")


def margins(dynamics: LoopDynamics) -> BothSigns | None:
    """Margins and bandwidth of a stable loop; None for an unstable one, which has none."""
    if not dynamics.stable:
        return None
    parameters = dynamics.parameters
    real = _negative_real(parameters)
    gains = [Margin(float(-1 / at.real), float(omega)) for at, omega in _at(parameters, real)]
    turns = [
        Margin(float(np.angle(-1 / at)), float(omega)) for at, omega in _at(parameters, _crossovers(dynamics))
    ]
    halves = _half_powers(dynamics)

    def side(sign: float) -> Margins:
        down = np.abs(halves[halves * sign > 0])
        return Margins(
            _least(item for item in gains if item.omega * sign > 0),
            _least(item for item in turns if item.omega * sign > 0),
            float(down.min()) if down.size else None,
        )

    return BothSigns(side(1.0), side(-1.0))


def _at(parameters: LoopParameters, omega: Array) -> Iterable[tuple[complex, float]]:
    return zip(loop_gain(parameters, omega).tolist(), omega.tolist(), strict=True)


def _negative_real(parameters: LoopParameters) -> Array:
    """Where L(iω) is real and negative: beyond the nutation it has the other sign."""
    omega = phase_crossing(parameters)
    if np.isnan(omega):
        return np.empty(0)
    return np.array([omega, -omega] if omega < parameters.nutation else [-omega])


def _crossovers(dynamics: LoopDynamics) -> Array:
    """Where |L(iω)| = 1."""
    unit = _scale(dynamics)
    above, below = (part(Polynomial([0.0, unit])) for part in _loop(dynamics.parameters))
    return unit * _real_roots(_power(above) - _power(below))


def _half_powers(dynamics: LoopDynamics) -> Array:
    """Where |R(iω)|² = 1/2."""
    unit = _scale(dynamics)
    above, below = (part(Polynomial([0.0, unit])) for part in _rate(dynamics.parameters))
    return unit * _real_roots(_power(above) - _HALF_POWER * _power(below))


def _scale(dynamics: LoopDynamics) -> float:
    """A unit of ω in which the coefficients are alike in size: the poles' geometric mean."""
    return float(np.exp(np.log(np.abs(dynamics.poles)).mean()))


def _loop(parameters: LoopParameters) -> tuple[Polynomial, Polynomial]:
    """Numerator and denominator of L(iω), polynomials in ω."""
    above, below = _controller(parameters)
    return above, below * Polynomial([0.0, 1j]) * _rotor(parameters)


def _rate(parameters: LoopParameters) -> tuple[Polynomial, Polynomial]:
    """Numerator and denominator of R(iω)."""
    above, below = _loop(parameters)
    return above * _rotor(parameters), below + above


def _controller(parameters: LoopParameters) -> tuple[Polynomial, Polynomial]:
    """Numerator and denominator of W(iω)."""
    lag = Polynomial([1.0, 1j * parameters.lag_time]) ** 2
    if np.isinf(parameters.integral_time):
        return Polynomial([parameters.gain + 0j]), lag
    ti = 1j * parameters.integral_time
    return parameters.gain * Polynomial([1.0, ti]), Polynomial([0.0, ti]) * lag


def _rotor(parameters: LoopParameters) -> Polynomial:
    """1 + i(A/H)·iω: zero at the nutation."""
    return Polynomial([1.0, -1.0 / parameters.nutation])


def _conjugate(polynomial: Polynomial) -> Polynomial:
    return Polynomial(np.conj(polynomial.coef))


def _power(polynomial: Polynomial) -> Polynomial:
    return Polynomial((polynomial * _conjugate(polynomial)).coef.real)


def _real_roots(polynomial: Polynomial) -> Array:
    """Real roots, each polished by Newton's method."""
    roots = polynomial.trim().roots()
    near = roots[np.abs(roots.imag) <= _REAL * np.abs(roots)].real
    slope = polynomial.deriv()
    for _ in range(3):
        rise = slope(near)
        near = near - np.where(rise == 0, 0.0, polynomial(near) / np.where(rise == 0, 1.0, rise))
    return np.asarray(near)
