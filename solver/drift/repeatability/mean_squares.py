"""Intervals of linear combinations of mean squares; it knows nothing of gyros.

γ = Σ_q c_q·θ_q − Σ_r d_r·θ_r (c, d > 0) of independent mean squares S² with n degrees of freedom each and
expectations θ. The modified large-sample bounds of N. Ting, R. K. Burdick, F. A. Graybill, S. Jeyaratnam,
T.-F. C. Lu, J. Statist. Comput. Simul. 35, 1990, 135-143 (R. K. Burdick, F. A. Graybill, Confidence
Intervals on Variance Components, 1992, section 3.3), F(α; n, m) exceeded with probability α::

    L = γ̂ − √V
    V = Σ_q G_q²·c_q²·S_q⁴ + Σ_r H_r²·d_r²·S_r⁴ + Σ_qr G_qr·c_q·d_r·S_q²·S_r² + Σ_{q<t} G*_qt·c_q·c_t·S_q²·S_t²
    G_q = 1 − 1/F(α; n_q, ∞),   H_r = 1/F(1 − α; n_r, ∞) − 1
    G_qr = [(F(α; n_q, n_r) − 1)² − G_q²·F(α; n_q, n_r)² − H_r²]/F(α; n_q, n_r)
    G*_qt = [(1 − 1/F(α; n_q + n_t, ∞))²·(n_q + n_t)²/(n_q·n_t) − G_q²·n_q/n_t − G_t²·n_t/n_q]/(Q − 1)

with Q the number of positive terms; the upper bound is that of −γ with its sign turned. They are exact
where all mean squares but one are zero.
"""

from typing import Final

import numpy as np
from scipy import special

from solver.records import Array

_LIMITLESS: Final = 1e6
"""Degrees of freedom that count as without limit."""


def bounds(coefficients: Array, squares: Array, dof: Array, level: float) -> tuple[float, float]:
    """Bounds of Σ coefficients·θ, each missed with the probability (1 − level)/2.

    Parameters
    ----------
    coefficients, squares, dof : (m,) array
        Of either sign; S²; n, infinite for what is known.
    """
    tail = (1.0 - level) / 2.0
    return _lower(coefficients, squares, dof, tail), -_lower(-coefficients, squares, dof, tail)


def effective_dof(coefficients: Array, squares: Array, dof: Array, total: float | None = None) -> float:
    """Degrees of freedom of Σ coefficients·S² (JCGM 100:2008, eq. (G.2b)), or of what is taken for it, `total`."""
    parts = coefficients * squares
    spread = float(np.sum(parts**2 / dof))
    whole = float(np.sum(parts)) if total is None else total
    return whole**2 / spread if spread > 0.0 else np.inf


def tail_of_f(f: float, dof: float, dof_below: float) -> float:
    """Probability of a ratio above f; the denominator may be known."""
    if dof_below > _LIMITLESS:
        return float(special.chdtrc(dof, dof * f))
    return float(special.fdtrc(dof, dof_below, f))


def _lower(coefficients: Array, squares: Array, dof: Array, tail: float) -> float:
    parts = coefficients * squares
    plus = [(float(part), float(n)) for part, n in zip(parts, dof, strict=True) if part > 0.0]
    minus = [(-float(part), float(n)) for part, n in zip(parts, dof, strict=True) if part < 0.0]
    variance = sum((_g(n, tail) * part) ** 2 for part, n in plus)
    variance += sum((_h(n, tail) * part) ** 2 for part, n in minus)
    variance += sum(_crossed(n, m, tail) * c * d for c, n in plus for d, m in minus)
    for index, (c, n) in enumerate(plus):
        variance += sum(_paired(n, m, tail) * c * d for d, m in plus[:index]) / (len(plus) - 1 or 1)
    return float(np.sum(parts)) - float(np.sqrt(max(0.0, variance)))


def _g(n: float, tail: float) -> float:
    return 1.0 - 1.0 / _quantile(tail, n, np.inf)


def _h(n: float, tail: float) -> float:
    return 1.0 / _quantile(1.0 - tail, n, np.inf) - 1.0


def _crossed(n: float, m: float, tail: float) -> float:
    f = _quantile(tail, n, m)
    return ((f - 1.0) ** 2 - (_g(n, tail) * f) ** 2 - _h(m, tail) ** 2) / f


def _paired(n: float, m: float, tail: float) -> float:
    if max(n, m) > _LIMITLESS:
        return 0.0
    both = _g(n + m, tail) ** 2 * (n + m) ** 2 / (n * m)
    return both - _g(n, tail) ** 2 * n / m - _g(m, tail) ** 2 * m / n


def _quantile(upper: float, n: float, m: float) -> float:
    """F exceeded with a probability; either number of degrees of freedom may be without limit."""
    if n > _LIMITLESS and m > _LIMITLESS:
        return 1.0
    if m > _LIMITLESS:
        return float(special.chdtri(n, upper) / n)
    if n > _LIMITLESS:
        return float(m / special.chdtri(m, 1.0 - upper))
    return float(special.fdtri(n, m, 1.0 - upper))
