"""A finished take judged on the spot, while it can still be measured again.

Each check objects to a good record with a probability below `Thresholds.false_alarm`; the bounds stand where
they are derived. A channel that is stuck or saturated is not judged further, nor is a record whose ammeter
reports an overload: whatever else its samples say follows from that.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from scipy.special import stdtrit

from app.exchange.record_checks import TOLERANCE, duration_and_rate
from app.station.contracts import Array
from app.station.judgement.expectations import Expectations, Thresholds
from app.station.judgement.samples import at_a_limit, largest_step, longest_run, outlying, scatter
from solver.errors import Message

_NA_PER_MA: Final = 1e6
_USUAL_HZ: Final = 200.0
_BATCHES: Final = 20


@dataclass(frozen=True, slots=True, eq=False)
class Take:
    """A finished record: times, s, and both currents, mA, (n,) each; whether the ammeter says overload."""

    t_s: Array
    jx_ma: Array
    jy_ma: Array
    overload: bool = False


@dataclass(frozen=True, slots=True)
class Finding:
    """An objection to a take.

    Attributes
    ----------
    code
        Its name: ``gap``, ``spike``, …
    level
        ``error`` when the record must not be used, ``warning`` when somebody should look.
    message
        A sentence, as a template with its values.
    again
        Whether measuring again may help.
    """

    level: Literal["warning", "error"]
    message: Message
    again: bool = True

    @property
    def code(self) -> str:
        """Its name."""
        return self.message.code


def judged(
    take: Take,
    thresholds: Thresholds,
    expected: Expectations | None = None,
    *,
    largest_ma: float = np.inf,
) -> tuple[Finding, ...]:
    """All objections to a take, in the order of the record's parts: time, then each channel.

    Parameters
    ----------
    take
        At least two samples; fewer are too short without further judgement.
    thresholds, expected
        Of the laboratory, and of the gyro's type.
    largest_ma
        End of the ammeter's range.
    """
    if len(take.t_s) < 2:
        return (_too_short(0.0, thresholds),)
    expected = expected or Expectations()
    if not np.median(np.diff(take.t_s)) > 0:
        return (_irregular(int(np.sum(np.diff(take.t_s) <= 0)), 0),)
    findings = list(_time(take.t_s, thresholds))
    channels = {"Jx": take.jx_ma, "Jy": take.jy_ma}
    if take.overload:
        return (*findings, *_overloaded(channels, thresholds.false_alarm / 2.0, largest_ma))
    for name, values in channels.items():
        findings += _channel(name, values, take.t_s, thresholds, expected, largest_ma)
    return tuple(findings)


def _overloaded(channels: Mapping[str, Array], false_alarm: float, largest_ma: float) -> list[Finding]:
    """What an ammeter that reports an overload shows of it; what else its samples do follows from that.

    Where neither channel is seen at a limit, which of them it is nobody can tell.
    """
    seen = [
        _saturation(name, values, _beyond(values, largest_ma) or at_a_limit(values, false_alarm))
        for name, values in channels.items()
    ]
    return [finding for finding in seen if finding] or [_OVERLOAD]


def _time(t_s: Array, thresholds: Thresholds) -> Iterator[Finding]:
    steps = np.diff(t_s)
    duration, rate = duration_and_rate(t_s)
    irregular = _gap(steps, thresholds.false_alarm)
    if irregular is not None:
        yield irregular
        duration = float(t_s[-1] - t_s[0] + np.median(steps))
    if duration < thresholds.shortest_s * (1.0 - TOLERANCE):
        yield _too_short(duration, thresholds)
    if rate < thresholds.slowest_hz * (1.0 - TOLERANCE):
        yield Finding(
            "error",
            Message(
                "too-slow",
                "%(rate).4g samples per second are fewer than %(slowest)g. Check the ammeter's rate.",
                {"rate": rate, "slowest": thresholds.slowest_hz},
            ),
            again=False,
        )


def _too_short(duration: float, thresholds: Thresholds) -> Finding:
    return Finding(
        "error",
        Message(
            "too-short",
            "The record lasts %(duration).4g s instead of %(shortest)g s. Measure again.",
            {"duration": duration, "shortest": thresholds.shortest_s},
        ),
    )


def _gap(steps: Array, false_alarm: float) -> Finding | None:
    """Steps far from the usual one.

    A missing sample makes a step of two; half of one is the limit, or more where the clock jitters: k times the
    steps' own scatter (see `samples.outlying`), but never more than nine tenths.
    """
    usual = float(np.median(steps))
    limit = float(np.clip(largest_step(steps, false_alarm) / usual, 0.5, 0.9))
    wrong = steps[np.abs(steps / usual - 1.0) > limit]
    if not len(wrong):
        return None
    missing = int(np.sum(np.maximum(np.rint(wrong / usual) - 1.0, 0.0)))
    return _irregular(len(wrong), missing)


def _irregular(count: int, missing: int) -> Finding:
    return Finding(
        "error",
        Message(
            "gap",
            "The times are irregular in %(count)d places, %(missing)d samples are missing. Measure again; if it "
            "happens often, check the ammeter's connection.",
            {"count": count, "missing": missing},
        ),
    )


def _channel(
    name: str, values: Array, t_s: Array, thresholds: Thresholds, expected: Expectations, largest_ma: float
) -> Iterator[Finding]:
    false_alarm = thresholds.false_alarm / 2.0  # two channels
    # A channel that rests on one value is stuck even where that is its extreme; but the range's end says more.
    dead = (
        _saturation(name, values, _beyond(values, largest_ma))
        or _stuck(name, longest_run(values, false_alarm))
        or _saturation(name, values, at_a_limit(values, false_alarm))
    )
    if dead:
        yield dead
        return
    off = outlying(values, false_alarm)
    if off.any():
        yield Finding(
            "error",
            Message(
                "spike",
                "Samples of %(channel)s that leap: %(count)d, by up to %(size).0f nA, the first at %(when).4g s. "
                "Measure again; look for switching nearby and for loose plugs.",
                {
                    "channel": name,
                    "count": int(off.sum()),
                    "size": float(np.abs(values[off] - np.median(values)).max()) * _NA_PER_MA,
                    "when": float(t_s[np.argmax(off)]),
                },
            ),
        )
    yield from _signal(name, values[~off], t_s[~off], thresholds, expected)


_OVERLOAD: Final = Finding(
    "error",
    Message("saturation", "The ammeter reports an overload. Choose a larger range and measure again."),
)


def _beyond(values: Array, largest_ma: float) -> int:
    """How many samples are at the end of the ammeter's range as the station's file states it."""
    return int(np.sum(np.abs(values) >= largest_ma * (1.0 - TOLERANCE)))


def _saturation(name: str, values: Array, count: int) -> Finding | None:
    if not count:
        return None
    return Finding(
        "error",
        Message(
            "saturation",
            "%(channel)s is at the end of the ammeter's range in %(count)d samples (%(value).6g mA). Choose a larger "
            "range and measure again.",
            {"channel": name, "count": count, "value": float(values[np.argmax(np.abs(values))])},
        ),
    )


def _stuck(name: str, length: int) -> Finding | None:
    if not length:
        return None
    return Finding(
        "error",
        Message(
            "stuck",
            "%(channel)s repeats one value for %(length)d samples. Check the channel and measure again.",
            {"channel": name, "length": length},
        ),
    )


def _signal(
    name: str, values: Array, t_s: Array, thresholds: Thresholds, expected: Expectations
) -> Iterator[Finding]:
    """What is wrong with a channel that works: its size, its noise, its drift."""
    mean = float(values.mean())
    if expected.largest_ma and abs(mean) > expected.largest_ma:
        yield Finding(
            "warning",
            Message(
                "too-large",
                "The mean of %(channel)s is %(mean).4g mA, more than %(largest)g mA, the most expected of this type. "
                "Check the gyro's type and the wiring.",
                {"channel": name, "mean": mean, "largest": expected.largest_ma},
            ),
            again=False,
        )
    noise = scatter(values) * _NA_PER_MA
    usual = expected.noise_na * float(np.sqrt(1.0 / (np.median(np.diff(t_s)) * _USUAL_HZ)))
    if usual and not usual / thresholds.noise_factor <= noise <= usual * thresholds.noise_factor:
        yield _noise(name, noise, usual)
    yield from _drift(name, values, t_s, expected.drift_na or thresholds.drift_na, thresholds.false_alarm / 2)


def _noise(name: str, noise: float, usual: float) -> Finding:
    values = {"channel": name, "noise": noise, "usual": usual}
    if noise > usual:
        message = Message(
            "noise",
            "The samples of %(channel)s scatter by %(noise).3g nA, those of the type by %(usual).3g nA. Look for "
            "vibration, mains pick-up and bad earthing; then measure again.",
            values,
        )
    else:
        message = Message(
            "noise",
            "The samples of %(channel)s scatter by %(noise).3g nA only, those of the type by %(usual).3g nA. Check "
            "that the gyro runs and is connected; then measure again.",
            values,
        )
    return Finding("warning", message)


def _drift(name: str, values: Array, t_s: Array, matters_na: float, false_alarm: float) -> Iterator[Finding]:
    """Slope of a line through the means of 20 batches: significant (Student, 18 dof), and large enough to matter.

    Batches of seconds are as good as independent where single samples are not.
    """
    if len(values) < 2 * _BATCHES:
        return
    means = np.array([part.mean() for part in np.array_split(values, _BATCHES)])
    times = np.array([part.mean() for part in np.array_split(t_s, _BATCHES)])
    centred = times - times.mean()
    spread = float(centred @ centred)
    slope = float(centred @ means) / spread
    residuals = means - means.mean() - slope * centred
    u_slope = float(np.sqrt(residuals @ residuals / (_BATCHES - 2) / spread))
    change_na = slope * float(t_s[-1] - t_s[0]) * _NA_PER_MA
    if (
        abs(change_na) <= matters_na
        or abs(slope) <= float(stdtrit(_BATCHES - 2, 1 - false_alarm / 2)) * u_slope
    ):
        return
    yield Finding(
        "warning",
        Message(
            "drifting",
            "%(channel)s changes by %(change).0f nA within the record. Let the gyro warm up and the stand settle; "
            "then measure again.",
            {"channel": name, "change": change_na},
        ),
    )
