"""A loop as its page shows it: tables and charts in the units and words of the reader."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from app import figures
from app.i18n import gettext, translate
from app.pages import loop_charts
from app.plots.theme import Spec
from app.services.loop import LoopAnswer, drawn_steps
from app.services.loop_documents import COLUMNS, margin_numbers, rows, verdict_message
from simdevice.dynamics import GVK_6_AS_PRINTED

_STEP_ROWS: Final = 21
_PER_DECADE: Final = 4
_PLACES: Final = ("gain_at_rad_per_s", "phase_at_rad_per_s")


class PoleRow(NamedTuple):
    """A pole: its parts, damping and time constant as printed; whether it grows, and whether it is the nutation's."""

    re: str
    im: str
    damping: str
    time_constant_ms: str
    grows: bool
    nutates: bool


class MarginRow(NamedTuple):
    """A margin in words, its unit, and it for ω > 0 and ω < 0; which of the two is the worse one."""

    name: str
    unit: str
    values: tuple[str, str]
    worse: int | None


@dataclass(frozen=True, slots=True)
class LoopView:
    """What the template writes."""

    stable: bool
    misprint: bool
    verdict: str
    gain: str
    nutation: str
    margins: Sequence[MarginRow]
    poles: Sequence[PoleRow]
    pole_chart: Spec
    time_unit: str
    angle_unit: str
    deflections: Spec
    rates: Spec
    cut_off: str
    steps: Sequence[tuple[str, ...]]
    gain_chart: Spec
    phase_chart: Spec
    rate_chart: Spec
    frequencies: Sequence[tuple[str, ...]]


def loop_view(found: LoopAnswer) -> LoopView:
    """Everything in words and figures of the current language."""
    drawn = drawn_steps(found)
    units = loop_charts.units_of(drawn)
    return LoopView(
        stable=found.stable,
        misprint=found.parameters == GVK_6_AS_PRINTED,
        verdict=translate(verdict_message(found)),
        gain=figures.significant(found.parameters.gain, 4),
        nutation=figures.significant(found.parameters.nutation, 4),
        margins=list(_margin_rows(found)),
        poles=list(_pole_rows(found)),
        pole_chart=loop_charts.pole_chart(found),
        time_unit=units.time,
        angle_unit=units.angle,
        deflections=loop_charts.deflections(found, drawn, units),
        rates=loop_charts.rates(found, drawn, units),
        cut_off="" if found.steps.cut_off is None else figures.significant(found.steps.cut_off, 3),
        steps=list(_step_rows(found, units)),
        gain_chart=loop_charts.gain_chart(found),
        phase_chart=loop_charts.phase_chart(found),
        rate_chart=loop_charts.rate_chart(found),
        frequencies=list(_frequency_rows(found)),
    )


def _pole_rows(found: LoopAnswer) -> Iterator[PoleRow]:
    nutation = loop_charts.nutation_pole(found)
    for pole, row in zip(found.poles, rows(found, "poles"), strict=True):
        constant = row["time_constant_s"]
        yield PoleRow(
            _digits(pole.real, 4),
            _digits(pole.imag, 4),
            _digits(row["damping_ratio"], 2),
            figures.DASH if constant is None else _digits(1e3 * constant, 3),
            not pole.real < 0,
            pole == nutation,
        )


def _margin_rows(found: LoopAnswer) -> Iterator[MarginRow]:
    if found.margins is None:
        return
    sides = [margin_numbers(side) for side in (found.margins.positive, found.margins.negative)]

    def row(name: str, unit: str, key: str) -> MarginRow:
        values = [side[key] for side in sides]
        x, y = (gettext("none") if value is None else _digits(_shown(key, value), 3) for value in values)
        sizes = [abs(value) if value is not None else math.inf for value in values]
        worse = int(sizes[1] < sizes[0])
        return MarginRow(name, unit, (x, y), None if key in _PLACES else worse)

    yield row(gettext("Gain margin"), gettext("dB"), "gain_db")
    yield row(gettext("as a factor"), "", "gain_factor")
    yield row(gettext("at frequency"), gettext("rad/s"), "gain_at_rad_per_s")
    yield row(gettext("Phase margin"), "°", "phase_deg")
    yield row(gettext("at frequency"), gettext("rad/s"), "phase_at_rad_per_s")
    yield row(gettext("Bandwidth (−3 dB)"), gettext("rad/s"), "bandwidth_rad_per_s")
    yield row(gettext("as a frequency"), gettext("Hz"), "bandwidth_hz")


def _shown(key: str, value: float) -> float:
    return value if key in _PLACES else abs(value)


def _digits(value: float | None, digits: int) -> str:
    """So many significant digits with the zeros at their end; powers of ten where it is very large or small."""
    decimals = figures.decimals_of(None if value is None else abs(value), digits)
    if decimals is None or not -2 <= decimals <= 8:
        return figures.significant(value, digits)
    return str(figures.figure(value, max(decimals, 0)))


def _step_rows(found: LoopAnswer, units: loop_charts.Units) -> Iterator[tuple[str, ...]]:
    """Some of the times; time, both angles, both rates down to the fourth digit of their largest value."""
    every = rows(found, "steps")
    chosen = np.unique(np.linspace(0, len(every) - 1, _STEP_ROWS).astype(int)).tolist()
    factors = (units.per_s, units.per_rad, units.per_rad, 1.0, 1.0)
    columns = [
        [factor * (every[at][name] or 0.0) for at in chosen]
        for name, factor in zip(COLUMNS["steps"], factors, strict=True)
    ]
    time, alpha, beta, x, y = (max(map(abs, column)) for column in columns)
    peaks = (time, *[max(alpha, beta)] * 2, *[max(x, y)] * 2)
    places = [figures.decimals_of(peak, 4) or 0 for peak in peaks]
    for values in zip(*columns, strict=True):
        yield tuple(
            str(figures.figure(value, max(place, 0))) for value, place in zip(values, places, strict=True)
        )


def _frequency_rows(found: LoopAnswer) -> Iterator[tuple[str, ...]]:
    """A few frequencies in each decade, ω > 0 and ω < 0 side by side."""
    by_omega = {row["omega_rad_per_s"] or 0.0: row for row in rows(found, "frequency")}
    sizes = sorted(omega for omega in by_omega if omega > 0)
    shown = 0.0
    for omega in sizes:
        if shown and omega < shown * 10 ** (1 / _PER_DECADE) * (1 - 1e-9):
            continue
        shown = omega
        cells = [
            str(figures.figure(by_omega[sign * omega][name], 1))
            for name in ("loop_gain_db", "loop_phase_deg", "rate_gain_db")
            for sign in (1, -1)
        ]
        yield (figures.plain(float(f"{omega:.3g}")), *cells)
