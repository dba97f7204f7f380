"""The rotor in its rebalance loop: state space, poles, step responses (paper, (1) and (2); spec 2.1).

With α, β the rotor's angles against the case, ω = ωx + iωy the case's inertial rate and
M = Mx + iMy the moments on the rotor, z = α + iβ turns both axes into one complex equation::

    A·(z̈ + ω̇) − iH·(ż + ω + W·z) = M        W(s) = K·(1 + T1·s) / (T1·s·(1 + T2·s)²)

K = Kα·Ku·Km. The measured rates are −W·z (their real part about x, their imaginary part about y),
the drift is ωp = iM/H. Let u = ż + ω, the rotor's inertial rate: it is continuous when the case
steps, so a step from rest begins with every state zero, and ω̇ never appears::

    ż = u − ω           q̇ = z                            q  integral of the deflection
    u̇ = i(H/A)·(u + w − ωp)                              w  W·z
    ẏ = (K·(z + q/T1) − y)/T2        ẇ = (y − w)/T2      y  after the first lag

A loop without integrator (T1 infinite) has no q, one without lags (T2 = 0) neither y nor w.
Nothing is integrated in small steps: over a time τ the states move by exp(F·τ)
(`simdevice.responses` holds the regular time axes), and at any single time by the modes, here.
"""

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm, matrix_balance

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# A mode that has decayed by e⁻⁴⁰ = 4e-18 is below the rounding of what it is added to.
_DECAYED = 40.0
# Above this condition number of its eigenvectors the state matrix is nearly defective: the modes
# lose that factor of 2e-16 in precision, and the matrix exponential is taken instead.
_DEFECTIVE = 1e6
# Of the largest pole: what its eigenvalue's rounding may move another one by, with room.
_ROUNDING = 1e-13


@dataclass(frozen=True, slots=True)
class LoopParameters:
    """The rotor and its rebalance loop.

    Attributes
    ----------
    angular_momentum
        H, N·m·s.
    inertia
        A, equatorial moment of inertia of the rotor, kg·m².
    pickoff_gain
        Kα, V/rad.
    amplifier_gain
        Ku, A/V.
    torquer_scale
        Km, rad/(s·A).
    integral_time
        T1, s; infinite for a loop without integrator.
    lag_time
        T2 of the double lag, s; 0 for none.

    Raises
    ------
    ValueError
        When a value is not a number, not greater than zero (the lag: less than zero), or infinite
        (other than the integral time).
    """

    angular_momentum: float
    inertia: float
    pickoff_gain: float
    amplifier_gain: float
    torquer_scale: float
    integral_time: float
    lag_time: float

    def __post_init__(self) -> None:
        for item in fields(self):
            name, value = item.name, getattr(self, item.name)
            what = f"The loop's {name.replace('_', ' ')} is {value}"
            if not (np.isfinite(value) or (name == "integral_time" and value > 0)):
                raise ValueError(f"{what}: give a finite number.")
            if value < 0 or (value == 0 and name != "lag_time"):
                raise ValueError(f"{what}: it must be {'at least' if name == 'lag_time' else 'above'} zero.")

    @property
    def gain(self) -> float:
        """K = Kα·Ku·Km, 1/s."""
        return self.pickoff_gain * self.amplifier_gain * self.torquer_scale

    @property
    def nutation(self) -> float:
        """H/A, the free rotor's nutation, rad/s."""
        return self.angular_momentum / self.inertia


# The paper's gyro. Its T1 is printed as 1.5e-3 s, with which the loop is unstable; ten times that
# gives the responses of its figures 4 and 5 (spec 2.1).
GVK_6 = LoopParameters(1.4e-3, 5e-7, 6.0, 3.0, 10.0, 1.5e-2, 1e-3)
GVK_6_AS_PRINTED = LoopParameters(1.4e-3, 5e-7, 6.0, 3.0, 10.0, 1.5e-3, 1e-3)


@dataclass(frozen=True)
class LoopDynamics:
    """The loop as an exactly discretised linear system."""

    parameters: LoopParameters

    @cached_property
    def matrix(self) -> ComplexArray:
        """F, (n, n), of the states z, u, then q, y, w as far as the loop has them; n = 2 … 5."""
        loop = self.parameters
        integrates, lags = np.isfinite(loop.integral_time), loop.lag_time > 0
        n = 2 + int(integrates) + 2 * int(lags)
        command = np.zeros(n, dtype=np.complex128)  # K·(z + q/T1), what the torquers would be told
        command[0] = loop.gain
        if integrates:
            command[2] = loop.gain / loop.integral_time
        nutation = 1j * loop.nutation
        f = np.zeros((n, n), dtype=np.complex128)
        f[0, 1] = 1.0
        f[1, 1] = nutation
        if integrates:
            f[2, 0] = 1.0
        if lags:
            f[-2] = command / loop.lag_time
            f[-2, -2] = -1.0 / loop.lag_time
            f[-1, -2], f[-1, -1] = 1.0 / loop.lag_time, -1.0 / loop.lag_time
            f[1, -1] = nutation
        else:
            f[1] += nutation * command
        return f

    @cached_property
    def output(self) -> ComplexArray:
        """(2, n): rows that make z and −W·z of the states."""
        loop, n = self.parameters, len(self.matrix)
        rows = np.zeros((2, n), dtype=np.complex128)
        rows[0, 0] = 1.0
        if loop.lag_time > 0:
            rows[1, -1] = -1.0
        else:
            rows[1, 0] = -loop.gain
            if np.isfinite(loop.integral_time):
                rows[1, 2] = -loop.gain / loop.integral_time
        return rows

    @cached_property
    def inputs(self) -> ComplexArray:
        """(n, 2): columns by which the case rate and the drift, rad/s, drive the states."""
        columns = np.zeros((len(self.matrix), 2), dtype=np.complex128)
        columns[0, 0], columns[1, 1] = -1.0, -1j * self.parameters.nutation
        return columns

    @cached_property
    def poles(self) -> ComplexArray:
        """(n,), rad/s, the slowest to decay first."""
        return self._modes[0]

    @property
    def stable(self) -> bool:
        """Whether everything decays; a pole within rounding of the imaginary axis does not."""
        return bool(self.poles[0].real < -_ROUNDING * np.abs(self.poles).max())

    def refuse_unstable(self) -> None:
        """Raise `ValueError` when the loop never settles."""
        if not self.stable:
            raise ValueError(
                f"The loop is unstable, its pole at {self.poles[0]:.4g} rad/s does not decay: "
                "the measured rates never settle. Choose other loop parameters."
            )

    def steady_state(self, rate: complex = 0.0, drift: complex = 0.0) -> ComplexArray:
        """States, (n,), that a steady case rate and drift, rad/s, lead to."""
        return -np.asarray(np.linalg.solve(self.matrix, self.inputs @ np.array([rate, drift])))

    def measured_rates_after_step(
        self,
        rate_step_x: float,
        rate_step_y: float,
        t: ArrayLike,
        *,
        drift_step_x: float = 0.0,
        drift_step_y: float = 0.0,
    ) -> tuple[Array, Array]:
        """How far the measured rates are from their new steady values after a step.

        Parameters
        ----------
        rate_step_x, rate_step_y
            New case rate less the old one, rad/s.
        t : (n,) array
            Since the step, s, in any order. Before the step the old steady values still stand.
        drift_step_x, drift_step_y
            New drift less the old one (a moment that the gravity of the new position makes), rad/s.

        Returns
        -------
        x, y : (n,) arrays
            rad/s; both go to 0.

        Raises
        ------
        ValueError
            When the loop is unstable: it has no steady values.
        """
        self.refuse_unstable()
        rate, drift = complex(rate_step_x, rate_step_y), complex(drift_step_x, drift_step_y)
        start = -self.steady_state(rate, drift)
        t = np.asarray(t, dtype=np.float64)
        deviation = self.free_motion(start, np.maximum(t, 0.0))[1]
        # At the step itself a lag-free loop already has the state of t = 0⁺; before it, the old rate.
        deviation = np.where(t < 0, drift - rate, deviation)
        return deviation.real, deviation.imag

    def free_motion(self, start: ComplexArray, t: Array) -> ComplexArray:
        """Outputs z and −W·z, (2, len(t)), with the inputs zero and the states `start` at t = 0."""
        if self._defective:
            return np.asarray(self.output @ (exponential(self.matrix, t) @ start).T)
        out = np.zeros((2, len(t)), dtype=np.complex128)
        for pole, weight in zip(self.poles, self.mode_weights(start).T, strict=True):
            alive = pole.real * t > -_DECAYED
            out[:, alive] += np.multiply.outer(weight, np.exp(pole * t[alive]))
        return out

    def mode_weights(self, start: ComplexArray) -> ComplexArray:
        """How much of each mode is in z and in −W·z, (2, n), when the states are `start`."""
        _, vectors, inverse = self._modes
        return self.output @ vectors * (inverse @ start)

    @cached_property
    def _modes(self) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Poles (n,), eigenvectors in the columns (n, n), and their inverse."""
        balanced, (scale, _) = matrix_balance(self.matrix, permute=False, separate=True)
        poles, vectors = np.linalg.eig(balanced)
        order = np.argsort(-poles.real, kind="stable")
        vectors = vectors[:, order]
        return poles[order], scale[:, None] * vectors, np.linalg.inv(vectors) / scale

    @cached_property
    def _defective(self) -> bool:
        balanced, _ = matrix_balance(self.matrix, permute=False, separate=True)
        return bool(np.linalg.cond(np.linalg.eig(balanced)[1]) > _DEFECTIVE)


def exponential(matrix: ComplexArray, t: ArrayLike) -> ComplexArray:
    """exp(matrix·t), (..., n, n) for t of shape (...); balanced first, as the states' sizes differ by 1e6."""
    balanced, (scale, _) = matrix_balance(matrix, permute=False, separate=True)
    times = np.asarray(t, dtype=np.float64)[..., None, None]
    return np.asarray(scale[:, None] * expm(times * balanced) / scale)
