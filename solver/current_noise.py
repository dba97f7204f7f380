"""What the mean currents' noise is taken to be: stated u(J), and where its ν is finite, moderated.

A u that was itself estimated scatters: its square is σ²·χ²_ν/ν. Weights by such u favour the positions that
happened to look quiet, so that the parameters scatter more than their stated u and χ² comes out too large
(P. Meier, Biometrics 9, 1953, 59). But every position of a session is measured with one gyro and one ammeter:
the σ of a channel are nearly equal, and each position tells something of the others'. With

    1/σ_i² ~ χ²_d₀/(d₀·s₀²)                 how σ differ within a channel
    e_i = ln u_i² − ψ(ν_i/2) + ln(ν_i/2)    has the expectation ln s₀² − ψ(d₀/2) + ln(d₀/2)
    ψ'(d₀/2) = var(e) − mean ψ'(ν_i/2)      d₀ and s₀² by moments of e; d₀ = ∞ where this is not positive

the posterior of σ_i² has (G. K. Smyth, Stat. Appl. Genet. Mol. Biol. 3, 2004, 3, sections 3 and 6.2)

    ũ_i² = (d₀·s₀² + ν_i·u_i²)/(d₀ + ν_i),   ν̃_i = d₀ + ν_i

For d₀ = ∞, equal σ, s₀² is the plain mean of u_i²: weights by ν would favour small ones, since both come from
one record (`solver.signals.noise` takes more cosines where the slow ones happen to be weak). Its degrees of
freedom, n²/Σ(1/ν_i), which for equal ν is their sum, are the most that any ν̃_i can be.

A u without ν, of infinite degrees of freedom, is known: it stays as it is and takes no part. So does one and the
same u stated for every position, which is one estimate, not many.
"""

from typing import Final, NamedTuple

import numpy as np
from scipy import special

from solver.errors import Message
from solver.records import Array, Observations
from solver.units import ma_from_ampere

_FEWEST: Final = 3
"""Estimates of a channel, below which nothing can be said of how they differ."""
_LEAST_EXCESS: Final = 1e-8
_ROUNDS: Final = 5
"""Of Newton's iteration, which after 4 has all digits for ψ' from 1e-8 to 1e7."""


class CurrentNoise(NamedTuple):
    """Standard uncertainties of the mean currents, A, and their degrees of freedom; (n, 2) each, x and y."""

    u: Array
    dof: Array


def current_noise(observations: Observations) -> CurrentNoise | None:
    """The noise that a session is solved, propagated and judged with; None without u(J)."""
    stated = stated_noise(observations)
    if stated is None:
        return None
    x, y = (moderated(stated.u[:, channel], stated.dof[:, channel]) for channel in range(2))
    return CurrentNoise(np.stack((x[0], y[0]), axis=1), np.stack((x[1], y[1]), axis=1))


def stated_noise(observations: Observations) -> CurrentNoise | None:
    """u(J) and ν as they went in; None without u(J)."""
    at = observations
    if at.u_jx is None or at.u_jy is None:
        return None
    return CurrentNoise(np.stack((at.u_jx, at.u_jy), axis=1), np.stack((at.dof_jx, at.dof_jy), axis=1))


def about_moderation(stated: CurrentNoise, used: CurrentNoise) -> Message | None:
    """Say what u(J) was stated and what is used in its place; None where they are the same."""
    if np.array_equal(stated.u, used.u) and np.array_equal(stated.dof, used.dof):
        return None
    ranges = {
        f"{part}_{axis}": _range(values[:, channel])
        for part, values in (
            ("stated", ma_from_ampere(stated.u)), ("used", ma_from_ampere(used.u)),
            ("dof", stated.dof), ("used_dof", used.dof),
        )
        for channel, axis in enumerate("xy")
    }  # fmt: skip
    return Message(
        "moderated-uncertainty",
        "u(J) was itself estimated with few degrees of freedom, so each is moderated by the other positions of its "
        "channel. u(Jx): stated %(stated_x)s mA with ν %(dof_x)s, used %(used_x)s mA with ν %(used_dof_x)s. "
        "u(Jy): stated %(stated_y)s mA with ν %(dof_y)s, used %(used_y)s mA with ν %(used_dof_y)s.",
        ranges,
    )


def _range(values: Array) -> str:
    ends = [f"{float(end):.3g}".replace("inf", "∞") for end in (values.min(), values.max())]
    return "…".join(dict.fromkeys(ends))


def moderated(u: Array, dof: Array) -> tuple[Array, Array]:
    """Moderate the standard uncertainties of one channel.

    Parameters
    ----------
    u, dof : (..., n) array
        As stated, in any unit; leading axes are sessions. Infinite `dof`: known exactly.

    Returns
    -------
    u, dof : (..., n) array
        To be used: to the last bit those stated, where nothing is to be moderated.
    """
    u, dof = np.broadcast_arrays(u, dof)
    known = ~np.isfinite(dof)
    count = np.sum(~known, axis=-1, keepdims=True)
    lowest = np.min(np.where(known, np.inf, u), axis=-1, keepdims=True)
    highest = np.max(np.where(known, 0.0, u), axis=-1, keepdims=True)
    used = ~known & (count >= _FEWEST) & (lowest < highest)
    if not used.any():
        return u, dof
    n = np.maximum(count, _FEWEST)

    def mean(values: Array) -> Array:
        return np.asarray(np.sum(np.where(used, values, 0.0), axis=-1, keepdims=True) / n)

    unit = np.where(highest > 0.0, highest, 1.0)  # A² of nanoamperes is small enough to matter
    square, freedom = (u / unit) ** 2, np.where(used, dof, 1.0)
    e = np.log(square) - special.digamma(freedom / 2) + np.log(freedom / 2)
    centre = mean(e)
    excess = mean((e - centre) ** 2) * n / (n - 1) - mean(_trigamma(freedom / 2))
    differ = excess > _LEAST_EXCESS
    d0 = 2.0 * _inverse_trigamma(np.where(differ, excess, 1.0))
    of_prior = np.exp(centre + special.digamma(d0 / 2) - np.log(d0 / 2))
    posterior = np.where(differ, (d0 * of_prior + freedom * square) / (d0 + freedom), mean(square))
    most = np.maximum(n / np.maximum(mean(1.0 / freedom), np.finfo(float).tiny), freedom)
    together = np.where(differ, np.minimum(d0 + freedom, most), most)
    return np.where(used, np.sqrt(posterior) * unit, u), np.where(used, together, dof)


def _trigamma(x: Array) -> Array:
    """ψ'(x) = ζ(2, x)."""
    return np.asarray(special.zeta(2.0, x))


def _inverse_trigamma(value: Array) -> Array:
    """Solve ψ'(x) = value > 0 by Newton's iteration on 1/ψ', which is convex and nearly linear."""
    x = np.where(value > 1.0, 1.0 / np.sqrt(value), 0.5 + 1.0 / value)  # ψ' = 1/x² + … and 1/x + 1/(2x²) + …
    for _ in range(_ROUNDS):
        trigamma = _trigamma(x)
        x = x - trigamma * (1.0 - trigamma / value) / (2.0 * special.zeta(3.0, x))  # ψ''(x) = −2·ζ(3, x)
    return np.asarray(x)
