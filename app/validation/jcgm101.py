"""Examples of JCGM 101:2008, clause 9: the generic Monte Carlo engine and its comparison with the GUM.

The document's numbers are themselves of Monte Carlo runs. A number is accepted within half a unit of
its last printed place and 2·δ/5, δ being the numerical tolerance of u (7.9.2): runs that are stable to
δ/5, as clause 8.2 asks, are at both ends. Shifting a shortest interval changes its length in second order
only, so its ends scatter far more than quantiles: among runs of a million draws by about 0.01·u, at 99 % by
twice that, and its length by 0.004·u (over twelve seeds). They are given 0.05·u and 0.1·u, the length 0.02·u.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, Final

import numpy as np

from app.i18n import marked
from app.validation.numbers import load
from app.validation.report import Check, Group, Progress, as_printed, attempt, holds, in_range
from solver.propagation.comparison import compare
from solver.propagation.monte_carlo import Model, MonteCarlo, numerical_tolerance, run
from solver.propagation.uncertainty import propagate
from solver.records import Array

_RUN: Final = "solver.propagation.monte_carlo.run"
_COMPARED: Final = f"{_RUN}, uncertainty.propagate, comparison.compare"
_STABLE: Final = 2.0 / 5.0
_FIRST: Final = marked("GUM, first order")
_COMPARISON: Final = marked("comparison with the GUM")
_AGREE, _DISAGREE = marked("agree"), marked("disagree")
_ENDS: Final = {
    "symmetric": (marked("symmetric interval, lower end"), marked("symmetric interval, upper end")),
    "shortest": (marked("shortest interval, lower end"), marked("shortest interval, upper end")),
}
_SHORTEST: Final = {0.95: 0.05, 0.99: 0.10}
_LENGTH: Final = 0.02


def group(progress: Progress, seed: int) -> Group:
    """Run every example with a million draws."""
    data = load("jcgm101")
    trials = int(data["trials"])
    draw = partial(run, trials=trials, seed=seed)
    additive = data["additive"]
    computed: tuple[Callable[[], Iterator[Check]], ...] = (
        lambda: _additive(additive["normal"], draw, normal=True),
        lambda: _additive(additive["rectangular"], draw),
        lambda: _additive(additive["unequal"], draw),
        lambda: _mass(data["mass"], draw),
        lambda: _loss(data["loss"], draw),
        lambda: _gauge(data["gauge"], draw),
    )
    found = []
    for number, ((name, source, function), compute) in enumerate(zip(_CASES, computed, strict=True)):
        progress(number / len(_CASES), name)
        found.append(attempt(name, source, function, compute, _NOTE))
    return Group("jcgm101", marked("JCGM 101: propagation of distributions"), tuple(found))


_CASES: Final = (
    (
        marked("9.2.2: sum of four normal quantities"),
        marked("JCGM 101:2008, 9.2.2, table 2; https://www.bipm.org/en/committees/jc/jcgm/publications"),
        _COMPARED,
    ),
    (
        marked("9.2.3: sum of four rectangular quantities"),
        marked("JCGM 101:2008, 9.2.3, table 3; https://www.bipm.org/en/committees/jc/jcgm/publications"),
        _COMPARED,
    ),
    (
        marked("9.2.4: sum of rectangular quantities, one ten times as wide"),
        marked("JCGM 101:2008, 9.2.4, table 4; https://www.bipm.org/en/committees/jc/jcgm/publications"),
        _COMPARED,
    ),
    (
        marked("9.3: calibration of a mass standard"),
        marked("JCGM 101:2008, 9.3, tables 5 and 6; https://www.bipm.org/en/committees/jc/jcgm/publications"),
        _COMPARED,
    ),
    (
        marked("9.4: comparison loss of a power meter, uncorrelated and correlated"),
        marked("JCGM 101:2008, 9.4; https://www.bipm.org/en/committees/jc/jcgm/publications"),
        _RUN,
    ),
    (
        marked("9.5: gauge block, 99 %"),
        marked("JCGM 101:2008, 9.5; https://www.bipm.org/en/committees/jc/jcgm/publications"),
        _RUN,
    ),
)
_NOTE: Final = marked(
    "A million draws. Accepted is half a unit of the last printed place and 2/5 of the numerical tolerance δ "
    "(7.9.2), for the document’s run and ours. Ends of shortest intervals scatter more: 0.05·u, at 99 % 0.1·u; "
    "their length: 0.02·u."
)
Draw = Callable[..., MonteCarlo]


def _additive(data: Mapping[str, Any], draw: Draw, *, normal: bool = False) -> Iterator[Check]:
    widths = np.array(data.get("widths", [1, 1, 1, 1]), dtype=np.float64)

    def model(rng: np.random.Generator, count: int) -> Array:
        if normal:
            return np.asarray(rng.standard_normal((len(widths), count)).sum(axis=0)[:, None])
        ends = widths[:, None] * 3**0.5
        return np.asarray(rng.uniform(-ends, ends, (len(widths), count)).sum(axis=0)[:, None])

    found = draw(model)
    yield from _spread(data, found, "Y")
    first = propagate(np.ones(len(widths)), np.diag(widths**2))
    if "gum" in data:
        for name, printed, sign in zip(("y − U", "y + U"), data["gum"], (-1, 1), strict=True):
            yield as_printed(name, printed, sign * float(first.expanded()[0]), detail=_FIRST)
    verdict = compare(
        found, np.zeros(1), first.standard_uncertainties, first.expanded(), names=("Y",)
    ).verdict
    expected = _DISAGREE if "gum" in data else _AGREE
    yield holds(_COMPARISON, expected, verdict, marked("two digits"))


def _mass(data: Mapping[str, Any], draw: Draw) -> Iterator[Check]:
    nominal = data["nominal"]

    def model(rng: np.random.Generator, count: int) -> Array:
        reference, added = (_normal(rng, data[name], count) for name in ("reference", "added"))
        air, weight, standard = (
            _rectangular(rng, data[name], count) for name in ("air", "weight", "standard")
        )
        buoyancy = (air - data["air_nominal"]) * (1.0 / weight - 1.0 / standard)
        return np.asarray(((reference + added) * (1.0 + buoyancy) - nominal)[:, None])

    found = draw(model)
    yield from _spread(data, found, "δm", digits=1)
    # At the estimates buoyancy vanishes with the air's deviation: only the two masses count to first order.
    first = propagate([1.0, 1.0], np.diag([data["reference"][1] ** 2, data["added"][1] ** 2]))
    value = np.array([data["reference"][0] + data["added"][0] - nominal])
    yield as_printed("u(δm)", data["u_first_order"], first.standard_uncertainties[0], "mg", detail=_FIRST)
    for name, printed, sign in zip(("δm − U", "δm + U"), data["gum_first_order"], (-1, 1), strict=True):
        end = float(value[0]) + sign * float(first.expanded()[0])
        yield as_printed(name, printed, end, "mg", detail=_FIRST)
    verdict = compare(
        found, value, first.standard_uncertainties, first.expanded(), digits=1, names=("δm",)
    ).verdict
    yield holds(_COMPARISON, _DISAGREE, verdict, marked("one digit"))


def _loss(data: Mapping[str, Any], draw: Draw) -> Iterator[Check]:
    u = data["u"]
    for case in data["cases"]:
        found = draw(_loss_model(case["x1"], case["r"], u))
        yield from _spread({**case, "unit": "10⁻⁶"}, found, f"δY(x₁ = {case['x1']:g}, r = {case['r']:g})")


def _loss_model(x1: float, r: float, u: float) -> Model:
    def model(rng: np.random.Generator, count: int) -> Array:
        one, other = rng.standard_normal((2, count))
        first, second = x1 + u * one, u * (r * one + (1.0 - r * r) ** 0.5 * other)
        return np.asarray(1e6 * (first**2 + second**2)[:, None])

    return model


def _gauge(data: Mapping[str, Any], draw: Draw) -> Iterator[Check]:
    def model(rng: np.random.Generator, count: int) -> Array:
        standard, difference, random, systematic = (
            _student(rng, data[name], count) for name in ("standard", "difference", "random", "systematic")
        )
        expansion = _rectangular(rng, data["expansion"], count)
        temperature = _normal(rng, data["temperature"], count)
        temperature += data["swing"] * np.cos(np.pi * rng.uniform(size=count))
        by_expansion = _curved(rng, data["expansion_difference"], count) * temperature
        by_temperature = _curved(rng, data["temperature_difference"], count) * expansion
        length = standard + difference + random + systematic - standard * (by_expansion + by_temperature)
        return np.asarray((length - data["nominal_nm"])[:, None])

    yield from _spread(data, draw(model, level=0.99), "δL")


def _normal(rng: np.random.Generator, given: Sequence[float], count: int) -> Array:
    centre, u = given
    return np.asarray(rng.normal(centre, u, count))


def _rectangular(rng: np.random.Generator, given: Sequence[float], count: int) -> Array:
    low, high = given
    return np.asarray(rng.uniform(low, high, count))


def _student(rng: np.random.Generator, given: Sequence[float], count: int) -> Array:
    """Scaled and shifted t: best estimate, scale, degrees of freedom (6.4.9)."""
    centre, scale, dof = given
    return np.asarray(centre + scale * rng.standard_t(dof, count))


def _curved(rng: np.random.Generator, given: Sequence[float], count: int) -> Array:
    """Rectangular with inexactly known limits: a, b, ±d, a curvilinear trapezoid (6.4.3.4)."""
    low, high, inexact = given
    start = low - inexact + 2.0 * inexact * rng.uniform(size=count)
    end = low + high - start
    return np.asarray(start + (end - start) * rng.uniform(size=count))


def _spread(data: Mapping[str, Any], found: MonteCarlo, name: str, digits: int = 2) -> Iterator[Check]:
    """Check estimate, u and interval as they are printed."""
    unit, u = data.get("unit", ""), float(found.standard_uncertainties[0])
    stable = _STABLE * float(numerical_tolerance(u, digits))
    if "y" in data:
        yield _near(f"y({name})", data["y"], found.mean[0], stable, unit)
    yield _near(f"u({name})", data["u"], u, stable, unit)
    for kind, reach in (("symmetric", stable), ("shortest", max(stable, _SHORTEST[found.level] * u))):
        ends = getattr(found, kind)[0]
        for detail, printed, value in zip(_ENDS[kind], data.get(kind, ()), ends, strict=False):
            yield _near(name, printed, value, reach, unit, detail)
    if "shortest" in data:
        low, high = data["shortest"]
        length = f"{float(high) - float(low):.{_places(high)}f}"
        obtained = float(np.diff(found.shortest[0])[0])
        yield _near(
            name, length, obtained, _LENGTH * u + _half(high), unit, marked("shortest interval, length")
        )


def _near(name: str, printed: str, obtained: float, reach: float, unit: str, detail: str = "") -> Check:
    expected, reach = float(printed), reach + _half(printed)
    return in_range(name, printed, float(obtained), expected - reach, expected + reach, unit, detail)


def _places(printed: str) -> int:
    return len(printed.partition(".")[2])


def _half(printed: str) -> float:
    """Half a unit of the last printed place."""
    return float(0.5 * 10.0 ** -_places(printed))
