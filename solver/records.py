"""What goes into the solver and what comes out: frozen records, SI."""

import hashlib
from dataclasses import dataclass, fields
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from solver.errors import InputError, Message

Array = NDArray[np.float64]
Method = Literal["least-squares", "generalised", "robust", "paper"]
UncertaintyBasis = Literal["given", "scatter", "none"]

PARAMETERS: Final = ("kx", "ky", "kxy", "kyx", "w0x", "w0y", "wg", "wk")
"""The eight parameters, in the order of every vector and matrix."""
_MAY_BE_UNKNOWN: Final = frozenset({"duration", "rate", "time"})
_DESCRIBING: Final = _MAY_BE_UNKNOWN | {"u_alpha", "u_beta", "u_gamma", "dof_jx", "dof_jy"}


@dataclass(frozen=True, slots=True)
class Observations:
    """The measured positions of one session, sorted by θ, ψ and repeat.

    Build it with `Observations.sorted_from`, which sorts and checks.

    Attributes
    ----------
    theta, psi : (n,) array
        Commanded stand angles, rad, in [0, 2π).
    repeat : (n,) int array
        0 for the first measurement of a position, 1 for its first repeat, …
    alpha, beta, gamma : (n,) array
        Certified misalignment at that position, rad.
    jx, jy : (n,) array
        Mean torquer currents, A.
    u_jx, u_jy : (n,) array or None
        Their standard uncertainties, A; None when they are not known for every position.
    duration, rate : (n,) array
        Length of the measurement, s, and sampling rate, Hz; NaN where they are not given.
    time : (n,) array
        Middle of the measurement, s since the session's beginning; NaN where it is not known.
    u_alpha, u_beta, u_gamma : (n,) array
        Standard uncertainties of the certified misalignment, rad, independent from position to
        position and common to the repeats of one; 0 where none is stated.
    dof_jx, dof_jy : (n,) array
        Degrees of freedom of u_jx and u_jy; infinite where they are not known.
    latitude : float
        Of the stand, rad, south negative.
    """

    theta: Array
    psi: Array
    repeat: NDArray[np.int64]
    alpha: Array
    beta: Array
    gamma: Array
    jx: Array
    jy: Array
    u_jx: Array | None
    u_jy: Array | None
    duration: Array
    rate: Array
    time: Array
    u_alpha: Array
    u_beta: Array
    u_gamma: Array
    dof_jx: Array
    dof_jy: Array
    latitude: float

    def __len__(self) -> int:
        """Number of measured positions, repeats counted."""
        return len(self.theta)

    @classmethod
    def sorted_from(
        cls,
        *,
        theta: Array,
        psi: Array,
        alpha: Array,
        beta: Array,
        gamma: Array,
        jx: Array,
        jy: Array,
        latitude: float,
        repeat: NDArray[np.int64] | None = None,
        u_jx: Array | None = None,
        u_jy: Array | None = None,
        duration: Array | None = None,
        rate: Array | None = None,
        time: Array | None = None,
        u_alpha: Array | None = None,
        u_beta: Array | None = None,
        u_gamma: Array | None = None,
        dof_jx: Array | None = None,
        dof_jy: Array | None = None,
    ) -> "Observations":
        """Sort rows by θ, ψ, repeat and check them once.

        Raises
        ------
        InputError
            When shapes differ, a value is not finite, or an uncertainty is not positive (of an angle: negative).
        """
        n = len(theta)
        unknown, none, infinite = np.full(n, np.nan), np.zeros(n), np.full(n, np.inf)
        repeat = np.zeros(n, dtype=np.int64) if repeat is None else np.asarray(repeat, np.int64)
        order = np.lexsort((repeat, psi, theta))
        columns = {
            "theta": theta, "psi": psi, "alpha": alpha, "beta": beta, "gamma": gamma,
            "jx": jx, "jy": jy, "u_jx": u_jx, "u_jy": u_jy,
            "duration": unknown if duration is None else duration,
            "rate": unknown if rate is None else rate,
            "time": unknown if time is None else time,
            "u_alpha": none if u_alpha is None else u_alpha,
            "u_beta": none if u_beta is None else u_beta,
            "u_gamma": none if u_gamma is None else u_gamma,
            "dof_jx": infinite if dof_jx is None else dof_jx,
            "dof_jy": infinite if dof_jy is None else dof_jy,
        }  # fmt: skip
        clean: dict[str, Array | None] = {}
        for name, column in columns.items():
            if column is None:
                clean[name] = None
                continue
            values = np.asarray(column, dtype=np.float64)
            _check(values, name, n)
            clean[name] = values[order]
        if not abs(latitude) <= np.pi / 2:
            raise InputError(Message("bad-latitude", "The latitude must lie between −90° and 90°."))
        return cls(repeat=repeat[order], latitude=float(latitude), **clean)  # type: ignore[arg-type]

    def input_hash(self) -> str:
        """SHA-256 over what the parameters are computed from: equal input, equal hash.

        The bytes are each field's name and its values, in their sorted order, as little-endian
        binary64; −0.0 counts as 0.0. What only describes the measurement or the uncertainty of its
        certificate is left out: means that are typed without it are the same means.
        """
        digest = hashlib.sha256(b"driftbook-input-1")
        for item in fields(self):
            value = getattr(self, item.name)
            if item.name in _DESCRIBING:
                continue
            digest.update(item.name.encode() + b"\0")
            if value is not None:
                digest.update((np.asarray(value, dtype="<f8") + 0.0).tobytes())
        return "sha256:" + digest.hexdigest()


def _check(values: Array, name: str, n: int) -> None:
    if values.shape != (n,):
        raise InputError(
            Message("bad-shape", "%(name)s has %(got)s values for %(n)d positions.",
                    {"name": name, "got": values.size, "n": n})
        )  # fmt: skip
    if name.startswith("dof_"):
        bad = ~(values > 0)
    else:
        bad = np.isinf(values) if name in _MAY_BE_UNKNOWN else ~np.isfinite(values)
    if bad.any():
        raise InputError(
            Message("not-finite", "%(name)s of row %(row)d is not a finite number.",
                    {"name": name, "row": int(np.argmax(bad)) + 1})
        )  # fmt: skip
    if name in ("u_alpha", "u_beta", "u_gamma") and (values < 0).any():
        raise InputError(
            Message("bad-uncertainty", "%(name)s of row %(row)d must not be negative.",
                    {"name": name, "row": int(np.argmax(values < 0)) + 1})
        )  # fmt: skip
    if name in ("u_jx", "u_jy") and (values <= 0).any():
        raise InputError(
            Message("bad-uncertainty", "%(name)s of row %(row)d must be greater than zero.",
                    {"name": name, "row": int(np.argmax(values <= 0)) + 1})
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Fit:
    """How well the model fits, and how well the positions determine it.

    `chi2` and `p_value` are None without given uncertainties. `rank` counts the combinations of
    parameters that the data determine, judged against the noise (not machine precision);
    `condition` is the ratio of the largest to the smallest singular value of the scaled,
    weighted design matrix; `singular_values` (8,) and `singular_vectors` (8, 8, one per row)
    belong to it. Both are None for the paper's method, which forms no design matrix.
    """

    chi2: float | None
    dof: int
    p_value: float | None
    rank: int
    condition: float
    singular_values: Array | None
    singular_vectors: Array | None


@dataclass(frozen=True, slots=True)
class Estimate:
    """One method's answer.

    Attributes
    ----------
    method
        ``least-squares`` or ``paper``.
    values : (8,) array
        In the order of `PARAMETERS`; NaN for a parameter that the data do not determine.
    covariance : (8, 8) array
        NaN in the rows and columns of undetermined parameters, and everywhere when
        `uncertainty_basis` is ``none``.
    uncertainty_basis
        ``given``: from u(J) (`solver.current_noise`); ``scatter``: from the residuals' scatter; ``none``: neither
        is possible (no degree of freedom left, or the scale factors, by which the currents' noise
        becomes that of the rates, are not determined).
    residuals : (n, 2) array
        Right side minus left side of the observation equations, x and y, rad/s, per row of the
        observations (all of them, also those that the method does not use).
    standardised : (n, 2) array
        Residuals over their own standard uncertainty; NaN where that is unknown or zero.
    outliers : (n, 2) bool array
        Residuals that the outlier test marks.
    fit : Fit
    iterations : (rounds, 8) array or None
        The paper's approximations λ = 1, 2, …: kx ky kxy kyx, NaN for w0x and w0y until the last
        round, wg wk. None for least squares.
    warnings
        What a reader must know.
    """

    method: Method
    values: Array
    covariance: Array
    uncertainty_basis: UncertaintyBasis
    residuals: Array
    standardised: Array
    outliers: NDArray[np.bool_]
    fit: Fit
    iterations: Array | None
    warnings: tuple[Message, ...]

    @property
    def standard_uncertainties(self) -> Array:
        """Square roots of the covariance's diagonal, (8,)."""
        return np.sqrt(np.diagonal(self.covariance))


@dataclass(frozen=True, slots=True)
class Failure:
    """A method that gave no estimate: why, and the rounds it went through, (rounds, 8) or None."""

    method: Method
    message: Message
    iterations: Array | None
