"""What the gyros of a type have in common: distributions, components of variance, correlations.

A component of variance is pooled over the gyros by degrees of freedom, s² = Σν_i·s_i²/Σν_i (JCGM 100:2008, H.3.6 and
H.5.2.5 pool variances in this way). A component is a difference of mean squares, so that the s_i² are known worse than
ν_i says: u(s_i²) is taken from the ends of each gyro's own 95 % interval, and the pooled one's interval from χ² with
ν = 2·s⁴/u²(s²) degrees of freedom (F. E. Satterthwaite, Biometrics Bulletin 2, 1946, 110-114). The F-tests of the gyros
are joined by −2·Σ ln p_i, χ² with two degrees of freedom each (R. A. Fisher, Statistical Methods for Research Workers,
21.1).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import sqrt
from typing import Any, Final

import numpy as np
from scipy import special

from app.exchange.si import PARAMETER_UNITS
from app.services.drift.fleet_views import Correlated, Distribution, FleetGyro, Pooled, Standing
from solver.drift.comparing import correlation, distribution
from solver.records import PARAMETERS

FEWEST_FOR_QUARTILES: Final = 4
FEWEST_FOR_CORRELATION: Final = 4
SIGNIFICANT: Final = 0.05
TOGETHER: Final = "together"
"""Of the pooled components: all of what differs from session to session."""
_LEVEL: Final = 0.95
_KNOWN: Final = ("within-position", "between-positions")
"""They are not estimated from session to session, but known from within each."""

_LEAST_CHI2: Final = 1e-6
"""A quantile below it: the variance is hardly known, and χ² says nothing; the interval is then that of its u."""

_Key = Callable[[Standing], float | None]


def distributions(gyros: Sequence[FleetGyro]) -> tuple[Distribution, ...]:
    """How each parameter lies over the gyros, and which of them stand out."""
    return tuple(_distribution(gyros, name) for name in PARAMETERS)


def _distribution(gyros: Sequence[FleetGyro], name: str) -> Distribution:
    known = {
        gyro.serial: gyro.parameters[name]
        for gyro in gyros
        if name in gyro.parameters and gyro.parameters[name].value.value is not None
    }
    first = next(iter(known.values())).value if known else None
    values = [item.value.value for item in known.values() if item.value.value is not None]
    found = (
        distribution.distribution(values, [item.value.u or 0.0 for item in known.values()])
        if values
        else None
    )
    several = found if found is not None and found.count > 1 else None
    farthest, nearest = _ends(known, lambda item: item.standing)
    steadiest, drifting = _ends(known, _drift)
    repeating, scattering = _ends(known, lambda item: item.scatter)
    return Distribution(
        parameter=name, unit=PARAMETER_UNITS[name][0], low=first.low if first else None,
        high=first.high if first else None, gyros=len(known), mean=found.mean if found else None,
        sd=several.sd if several else None, between=several.between if several else None,
        p_normal=several.p_normal if several else None,
        quartiles=_quartiles(several), nearest=nearest, farthest=farthest, drifting=drifting,
        steadiest=steadiest, scattering=scattering, repeating=repeating,
    )  # fmt: skip


def _quartiles(found: distribution.Distribution | None) -> tuple[float, float, float] | None:
    if found is None or found.count < FEWEST_FOR_QUARTILES:
        return None
    low, middle, high = (float(found.quantiles[distribution.QUANTILES.index(p)]) for p in (0.25, 0.5, 0.75))
    return low, middle, high


def _drift(item: Standing) -> float | None:
    return None if item.slope is None else abs(item.slope)


def _ends(known: Mapping[str, Standing], key: _Key) -> tuple[str | None, str | None]:
    """Serial numbers of the gyros with the least and the most; None where fewer than two tell."""
    told = {serial: found for serial, item in known.items() if (found := key(item)) is not None}
    if len(told) < 2:
        return None, None
    return min(told, key=lambda serial: told[serial]), max(told, key=lambda serial: told[serial])


def pooled(documents: Sequence[Mapping[str, Any]]) -> dict[str, tuple[Pooled, ...]]:
    """By parameter each component of variance, from the lowest to the uppermost, and all together."""
    found = {}
    for name in PARAMETERS:
        entries = [item["parameters"].get(name) or {} for item in documents]
        rows: dict[str, list[Mapping[str, Any]]] = {}
        for entry in entries:
            together = entry.get("together")
            for row in (
                *(entry.get("components") or ()),
                *([{**together, "source": TOGETHER}] if together else []),
            ):
                rows.setdefault(row["source"], []).append(row)
        found[name] = tuple(_pooled(rows))
    return found


def _pooled(rows: Mapping[str, Sequence[Mapping[str, Any]]]) -> Iterator[Pooled]:
    for source, found in rows.items():
        known = [row for row in found if row.get("sd") is not None and row.get("dof")]
        weights = np.array([row["dof"] for row in known], np.float64)
        if source in _KNOWN or not known:
            continue
        squares = np.array([row["sd"] ** 2 for row in known])
        u = np.array([_u_square(row) for row in known])
        variance = float(weights @ squares / weights.sum())
        u_variance = float(np.linalg.norm(weights * u) / weights.sum())
        low, high = _interval(variance, u_variance)
        yield Pooled(source, sqrt(variance), low, high, float(weights.sum()), len(known), _joined(known))


def _u_square(row: Mapping[str, Any]) -> float:
    """Standard uncertainty of a gyro's variance; of χ² where it has no interval."""
    if row.get("low") is None or row.get("high") is None:
        return float(row["sd"] ** 2 * sqrt(2.0 / row["dof"]))
    return float((row["high"] ** 2 - row["low"] ** 2) / (2.0 * special.ndtri(0.5 + _LEVEL / 2.0)))


def _interval(variance: float, u: float) -> tuple[float | None, float | None]:
    if not variance > 0.0 or not u > 0.0:
        return None, None
    dof, tail = 2.0 * variance**2 / u**2, (1.0 - _LEVEL) / 2.0
    ends = [float(special.chdtri(dof, p)) for p in (tail, 1.0 - tail)]
    if not min(ends) > _LEAST_CHI2:
        return 0.0, sqrt(variance + u * float(special.ndtri(0.5 + _LEVEL / 2.0)))
    return sqrt(dof * variance / ends[0]), sqrt(dof * variance / ends[1])


def _joined(rows: Sequence[Mapping[str, Any]]) -> float | None:
    """Fisher's p of the gyros' F-tests."""
    known = [max(row["p_value"], 1e-300) for row in rows if row.get("p_value") is not None]
    return float(special.chdtrc(2 * len(known), -2.0 * np.log(known).sum())) if known else None


def correlations(gyros: Sequence[FleetGyro]) -> tuple[Correlated, ...]:
    """Each pair of parameters over the gyros, the surest first; empty for too few gyros."""
    table = np.array(
        [
            [_value(gyro, name) for name in PARAMETERS]
            for gyro in gyros
            if gyro.parameters
        ],
        np.float64,
    )  # fmt: skip
    if len(table) < FEWEST_FOR_CORRELATION:
        return ()
    found = correlation.correlations(table)
    pairs = [
        Correlated(
            PARAMETERS[i], PARAMETERS[j], float(found.r[i, j]), float(found.p_value[i, j]),
            float(found.p_holm[i, j]), int(found.count[i, j]), bool(found.p_holm[i, j] < SIGNIFICANT),
        )
        for i in range(len(PARAMETERS))
        for j in range(i)
        if np.isfinite(found.p_holm[i, j])
    ]  # fmt: skip
    return tuple(sorted(pairs, key=lambda item: item.p_value))


def _value(gyro: FleetGyro, name: str) -> float:
    item = gyro.parameters.get(name)
    return float("nan") if item is None or item.value.value is None else item.value.value
