"""Optional terms of the error model: their columns in the observation equations.

Coefficients on the left side of the x and y equations of a position:

    wn              ωн·nx·nz                    ωн·ny·nz                 g²-sensitive drift, full model (3)
    drift_x         Δω0x·(t − t̄)/T              0                        linear drift of ω0x over the session
    drift_y         0                           Δω0y·(t − t̄)/T           … and of ω0y
    wg_split        ½(ωgx − ωgy)·c              −½(ωgx − ωgy)·d          separate ωg for x and y
    wk_split        −½(ωкx − ωкy)·d             −½(ωкx − ωкy)·c          separate ωк for x and y

so that the model of eight is the case in which they are zero; the last two give each axis its own
coefficients, as IEEE Std 813 has them. The drift is the change from the session's first position to its last.
"""

from typing import Final, Literal

import numpy as np

from solver.geometry import elements_of
from solver.records import Array, Observations

Term = Literal["wn", "drift_x", "drift_y", "wg_split", "wk_split"]
TERMS: Final[tuple[Term, ...]] = ("wn", "drift_x", "drift_y", "wg_split", "wk_split")
SYMBOLS: Final = {
    "wn": "ωн", "drift_x": "Δω0x", "drift_y": "Δω0y", "wg_split": "ωgx ≠ ωgy", "wk_split": "ωкx ≠ ωкy",
}  # fmt: skip
"""How a sentence names each term: symbols, in no language."""


def term_columns(observations: Observations) -> tuple[dict[Term, Array], bool]:
    """Coefficients of every term, (2n,), and whether the times are assumed."""
    at = elements_of(observations)
    moment, assumed = _moments(observations)
    none = np.zeros(len(observations))
    pairs: dict[Term, tuple[Array, Array]] = {
        "wn": (at.c * at.e, at.d * at.e),
        "drift_x": (moment, none),
        "drift_y": (none, moment),
        "wg_split": (at.c, -at.d),
        "wk_split": (-at.d, -at.c),
    }
    return {term: np.stack(pair, axis=-1).ravel() for term, pair in pairs.items()}, assumed


def _moments(observations: Observations) -> tuple[Array, bool]:
    """Times of measurement, centred, the whole session being 1; in the method's order where they are not known."""
    at = observations
    assumed = bool(np.isnan(at.time).any())
    time = at.time
    if assumed:
        time = np.empty(len(at))
        time[np.lexsort((at.psi, at.theta, at.repeat))] = np.arange(len(at))
    length = float(np.ptp(time)) if len(time) else 0.0
    return (time - time.mean()) / length if length > 0 else np.zeros(len(at)), assumed
