"""A record's noise as its page shows it: rows of a table, two charts, coefficients in two units."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from app import figures, plots
from app.i18n import gettext, translate
from app.pages.labels import Mark, symbol_text, unit
from app.services.noise import Channel, RecordNoise
from solver.errors import Message
from solver.signals.noise_coefficients import NAMES, allan_variance

NA_PER_MA: Final = 1e6
NA_PER_A: Final = 1e9
_S_PER_MIN: Final = 60.0
_CURVE_POINTS: Final = 60
_AXES: Final[Mapping[Channel, Literal["x", "y"]]] = {"jx": "x", "jy": "y"}
Document = Mapping[str, Any]


class Fact(NamedTuple):
    """A row: what, in which unit, for both channels, and what the numbers mean."""

    name: str
    unit: str
    x: str
    y: str


class CoefficientRow(NamedTuple):
    """A noise coefficient of both channels, as a current and as a rate; texts."""

    name: str
    letter: str
    current_unit: str
    current: tuple[str, str]
    rate_unit: str
    rate: tuple[str, str] | None


class AllanRow(NamedTuple):
    """σ(τ) of both channels with its interval, nA."""

    tau_s: float
    x: str
    y: str


@dataclass(frozen=True, slots=True)
class NoiseView:
    """What the template writes."""

    findings: Sequence[tuple[Sequence[str], Mark]]
    facts: Sequence[Fact]
    coefficients: Sequence[CoefficientRow]
    scales_from: int | None
    limits: str
    allan: plots.theme.Spec
    allan_rows: Sequence[AllanRow]
    correlation: plots.theme.Spec
    correlation_rows: Sequence[tuple[str, str, str]]


def noise_view(noise: RecordNoise) -> NoiseView:
    """Everything in words and figures of the current language."""
    return NoiseView(
        findings=_findings(noise),
        facts=list(_facts(noise.documents["jx"], noise.documents["jy"])),
        coefficients=list(_coefficients(noise.documents["jx"], noise.documents["jy"])),
        scales_from=noise.currents.scales_from,
        limits=_limits(noise),
        allan=_allan_chart(noise),
        allan_rows=list(_allan_rows(noise.documents["jx"]["allan"], noise.documents["jy"]["allan"])),
        correlation=_correlation_chart(noise),
        correlation_rows=list(_correlation_rows(noise)),
    )


def _findings(noise: RecordNoise) -> list[tuple[list[str], Mark]]:
    """Each finding with its channels: what holds for both is said once."""
    found: dict[Mark, list[str]] = {}
    for channel, document in noise.documents.items():
        for message in document["findings"]:
            found.setdefault(_mark(message), []).append(channel)
    return [(channels, item) for item, channels in found.items()]


def _mark(message: Message) -> Mark:
    shape = {"steady": "ok", "too-short-to-judge": "excluded"}.get(message.code, "attention")
    return Mark(shape, translate(message))


def _facts(x: Document, y: Document) -> Iterator[Fact]:
    def row(name: str, sign: str, shown: Callable[[Document], str]) -> Fact:
        return Fact(name, sign, shown(x), shown(y))

    na, seconds, minutes = unit("nA"), unit("s"), gettext("min")
    yield row(gettext("Effective samples"), "", lambda d: _count(d["n_eff"], d["samples"]))
    yield row(
        gettext("Autocorrelation time"),
        seconds,
        lambda d: figures.significant(d["autocorrelation_time_s"], 2),
    )
    yield row(gettext("u of the mean, as stated (slow fluctuations)"), na, lambda d: _u(d["u_ma"], d["dof"]))
    yield row(gettext("u by means of batches"), na, lambda d: _u(d["u_batches_ma"], d["dof_batches"]))
    yield row(
        gettext("u by summed autocorrelation"), na,
        lambda d: _u(d["u_autocorrelation_ma"], d["dof_autocorrelation"]),
    )  # fmt: skip
    yield row(
        gettext("Slope"), f"{na}/{minutes}",
        lambda d: _tested(d["slope"], "_ma_per_s", NA_PER_MA * _S_PER_MIN),
    )  # fmt: skip
    yield row(gettext("Second half less first"), na, lambda d: _tested(d["mean_step"], "_ma", NA_PER_MA))
    yield row(gettext("Noise of second half over first"), "", _ratio)
    if x["resolution_ma"] is not None or y["resolution_ma"] is not None:
        yield row(
            gettext("Ammeter’s step"),
            na,
            lambda d: figures.significant(_times(d["resolution_ma"], NA_PER_MA), 3),
        )


def _times(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor


def _count(n_eff: float | None, samples: int) -> str:
    if n_eff is None:
        return figures.DASH
    shown = figures.figure(float(f"{n_eff:.2g}"), 0)
    return gettext("%(part)s of %(all)s") % {"part": shown, "all": samples}


def _u(u_ma: float | None, dof: float | None) -> str:
    if u_ma is None or dof is None:
        return figures.DASH
    u = u_ma * NA_PER_MA
    return f"{figures.figure(u, max(0, figures.decimals_of(u) or 0))} ({symbol_text('nu')} {dof:.0f})"


def _p(p_value: float) -> str:
    if p_value < 1e-4:
        return "p < " + figures.plain(1e-4)
    return "p " + figures.plain(float(f"{p_value:.1g}" if p_value < 0.1 else f"{p_value:.2f}"))


def _tested(test: Document | None, suffix: str, factor: float) -> str:
    if test is None:
        return figures.DASH
    shown = figures.measured(test["value" + suffix] * factor, _times(test["expanded" + suffix], factor))
    return f"{shown} ({_p(test['p_value'])})"


def _ratio(document: Document) -> str:
    """Ratio of the standard deviations: half of the logarithm of the variances' ratio."""
    test = document["log_variance_ratio"]
    if test is None or test["expanded"] is None:
        return figures.DASH
    ratio = float(np.exp(0.5 * test["value"]))
    return f"{figures.measured(ratio, 0.5 * ratio * test['expanded'])} ({_p(test['p_value'])})"


def _coefficients(x: Document, y: Document) -> Iterator[CoefficientRow]:
    if x["coefficients"] is None and y["coefficients"] is None:
        return
    na, seconds, per_h = unit("nA"), unit("s"), unit("deg/h")
    rows = (
        ("angle_random_walk", gettext("Angle random walk"), "N", f"{na}·√{seconds}", "ma_sqrt_s",
         gettext("°/√h"), "deg_per_sqrt_h"),
        ("bias_instability", gettext("Bias instability"), "B", na, "ma", per_h, "deg_per_h"),
        ("rate_random_walk", gettext("Rate random walk"), "K", f"{na}/√{seconds}", "ma_per_sqrt_s",
         gettext("°/h/√h"), "deg_per_h_per_sqrt_h"),
        ("quantisation", gettext("Quantisation"), "Q", f"{na}·{seconds}", "ma_s", unit("arcsec"), "arcsec"),
    )  # fmt: skip
    for key, name, letter, current_unit, suffix, rate_unit, rate_suffix in rows:
        current = tuple(_coefficient(d, f"{key}_{suffix}", NA_PER_MA) for d in (x, y))
        rate = tuple(_coefficient(d, f"{key}_{rate_suffix}", 1.0) for d in (x, y))
        shown = rate if any(text != figures.DASH for text in rate) else None
        yield CoefficientRow(
            name, letter, current_unit, (current[0], current[1]), rate_unit,
            None if shown is None else (shown[0], shown[1]),
        )  # fmt: skip


def _coefficient(document: Document, field: str, factor: float) -> str:
    found = (document["coefficients"] or {}).get(field)
    if found is None:
        return figures.DASH
    if not found["seen"]:
        return f"≤ {figures.significant(found['high'] * factor, 2)}"
    value, expanded = found["value"] * factor, 2.0 * found["u"] * factor
    return str(figures.measured(value, expanded))


def _limits(noise: RecordNoise) -> str:
    """Up to which frequency the coefficients hold, where not up to half the rate."""
    highest = [
        found.coefficients.highest_frequency for found in noise.channels.values() if found.coefficients
    ]
    if not highest or min(highest) > 0.49 * noise.currents.rate_hz:
        return ""
    return gettext("Fitted below %(frequency)s Hz: faster noise follows other laws.") % {
        "frequency": figures.significant(min(highest), 2)
    }


def _allan_chart(noise: RecordNoise) -> plots.theme.Spec:
    duration = noise.currents.duration_s
    points, means, models = [], [], []
    for channel, axis in _AXES.items():
        document = noise.documents[channel]
        points += [_allan_point(channel, axis, row) for row in document["allan"]]
        if document["u_ma"]:
            text = f"{figures.significant(document['u_ma'] * NA_PER_MA, 2)} {unit('nA')}"
            name = gettext("u of the mean of %(symbol)s: %(u)s") % {"symbol": symbol_text(channel), "u": text}
            means.append(plots.MeanPoint(axis, document["u_ma"] * NA_PER_MA, name))
        models.append((axis, _model(noise, channel)))
    return plots.allan(
        points, means, models, duration,
        gettext("mean over %(duration)s") % {"duration": figures.duration(duration)},
        gettext("Allan deviation of both channels by averaging time, from one sample to the whole record"),
    )  # fmt: skip


def _allan_point(channel: str, axis: Literal["x", "y"], row: Document) -> plots.AllanPoint:
    value, low, high = (row[name] * NA_PER_MA for name in ("deviation_ma", "low_ma", "high_ma"))
    name = gettext("%(symbol)s, %(tau)s s: %(value)s nA, from %(low)s to %(high)s") % {
        "symbol": symbol_text(channel),
        "tau": figures.significant(row["tau_s"], 3),
        "value": figures.significant(value, 3),
        "low": figures.significant(low, 3),
        "high": figures.significant(high, 3),
    }
    return plots.AllanPoint(axis, row["tau_s"], value, low, high, name)


def _model(noise: RecordNoise, channel: Channel) -> list[tuple[float, float]]:
    found = noise.channels[channel].coefficients
    if found is None:
        return []
    values = [getattr(found, name).value or 0.0 for name in NAMES]
    first = max(1.0 / noise.currents.rate_hz, 0.5 / found.highest_frequency)
    tau = np.geomspace(first, noise.currents.duration_s, _CURVE_POINTS)
    deviations = np.sqrt(allan_variance(np.square(values), tau)) * NA_PER_A
    return list(zip(tau.tolist(), deviations.tolist(), strict=True))


def _allan_rows(x: Sequence[Document], y: Sequence[Document]) -> Iterator[AllanRow]:
    by_tau: dict[float, list[str]] = {}
    for place, rows in enumerate((x, y)):
        for row in rows:
            by_tau.setdefault(row["tau_s"], [figures.DASH, figures.DASH])[place] = _interval(row)
    for tau, (left, right) in sorted(by_tau.items()):
        yield AllanRow(tau, left, right)


def _interval(row: Document) -> str:
    value, low, high = (
        figures.significant(row[name] * NA_PER_MA, 3) for name in ("deviation_ma", "low_ma", "high_ma")
    )
    return f"{value} ({low} … {high})"


def _correlation_chart(noise: RecordNoise) -> plots.theme.Spec:
    x, y = _correlation(noise, "jx"), _correlation(noise, "jy")
    chances = [found.correlogram.chance for found in noise.channels.values() if found.correlogram]
    return plots.autocorrelation(
        x, y, max(chances, default=0.0),
        gettext("Autocorrelation of both channels by lag, and the band of independent samples"),
    )  # fmt: skip


def _correlation(noise: RecordNoise, channel: Channel) -> list[tuple[float, float]]:
    found = noise.channels[channel].correlogram
    return [] if found is None else list(zip(found.lag.tolist(), found.value.tolist(), strict=True))


def _correlation_rows(noise: RecordNoise) -> Iterator[tuple[str, str, str]]:
    """The first lags, and then ever fewer: the table behind the chart."""
    x, y = _correlation(noise, "jx"), _correlation(noise, "jy")
    longest = max(len(x), len(y))
    chosen = sorted({min(longest - 1, int(place)) for place in np.geomspace(1, max(longest, 2), 24)} - {-1})
    for place in chosen:
        lag = (x if len(x) > place else y)[place][0]
        yield figures.significant(lag, 3), _rho(x, place), _rho(y, place)


def _rho(curve: Sequence[tuple[float, float]], place: int) -> str:
    return str(figures.figure(curve[place][1], 3)) if len(curve) > place else figures.DASH
