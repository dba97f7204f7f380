"""What can be wrong with a record of currents: time, gaps, a stuck or saturated channel, length.

The measurement rule is that of the method: at least 60 s at not less than 200 Hz, each with a
tolerance of 0.1 %. What makes the record useless is a problem; what its reader must know is a warning.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.exchange.problems import Problems
from app.exchange.rows import CurrentRecord
from solver.errors import Message

Array = NDArray[np.float64]

SHORTEST_S: Final = 60.0
SLOWEST_HZ: Final = 200.0
TOLERANCE: Final = 1e-3

_GAP_STEPS: Final = 1.5
_GAPS_NAMED: Final = 3
_STUCK_S: Final = 1.0  # unchanged for so long while the rest of the record varies
_LEVELS: Final = 5  # a channel with fewer values is coarse, and rests on its extremes honestly
_SATURATED_RUN: Final = 20
_SATURATED_SHARE: Final = 0.01
_NORMAL: Final = 1.4826  # standard deviation of normal noise over its median absolute deviation
_LEAP: Final = 15.0  # standard deviations: no noise goes so far
_FEWEST_FOR_LEAPS: Final = 20


def duration_and_rate(t_s: Array) -> tuple[float, float]:
    """Length n × median step, s, and rate 1 / median step, Hz, to nine digits.

    More digits than that hold only the rounding of the times.
    """
    step = float(np.median(np.diff(t_s)))
    return float(f"{len(t_s) * step:.9g}"), float(f"{1.0 / step:.9g}")


def check_time(t_s: Array, lines: Sequence[int], column: str, problems: Problems) -> None:
    """Note every row whose time is not later than that of the row before."""
    if len(t_s) < 2:
        problems.note(
            Message(
                "too-few-samples",
                "A record of one row has no duration. Bring at least 60 s at 200 Hz.",
            ),
            row=lines[0],
        )
        return
    wrong = np.flatnonzero(~(np.diff(t_s) > 0)) + 1
    shown = wrong[: problems.room]
    for place in shown:
        problems.note(
            Message(
                "time-not-increasing",
                "The time %(now).9g s does not come after %(before).9g s. Sort the rows by time and write "
                "all its digits; if another measurement begins here, give it a file or a repeat of its own.",
                {"now": float(t_s[place]), "before": float(t_s[place - 1])},
            ),
            row=lines[int(place)],
            column=column,
        )
    problems.count_further(len(wrong) - len(shown))


def warnings(record: CurrentRecord, lines: Sequence[int], filename: str) -> list[Message]:
    """What a reader of a usable record must know: gaps, channels that rest, below the method."""
    place = {"file": filename, "theta": record.theta_deg, "psi": record.psi_deg}
    found = _gaps(record.t_s, lines, place)
    _, rate = duration_and_rate(record.t_s)
    for name, values in (("jx", record.jx_ma), ("jy", record.jy_ma)):
        at = {**place, "channel": name}
        found += _resting(values, rate, lines, at) or _leaping(values, lines, at)
    return found + _below_method(record.t_s, place)


def _gaps(t_s: Array, lines: Sequence[int], place: dict[str, object]) -> list[Message]:
    steps = np.diff(t_s)
    median = float(np.median(steps))
    gaps = np.flatnonzero(steps > _GAP_STEPS * median)
    if not len(gaps):
        return []
    listed = ", ".join(f"{lines[int(i) + 1]} ({steps[i] / median:.3g}×)" for i in gaps[:_GAPS_NAMED])
    return [
        Message(
            "gap",
            "%(file)s, θ %(theta)g°, ψ %(psi)g°: %(count)d gaps in time, before row %(rows)s the usual step. "
            "Measure again if many samples are missing.",
            {**place, "count": len(gaps), "rows": listed + (", …" if len(gaps) > _GAPS_NAMED else "")},
        )
    ]


def _resting(values: Array, rate: float, lines: Sequence[int], place: dict[str, object]) -> list[Message]:
    """A channel that does not change, or not for long, or lies on its largest or smallest value."""
    starts, lengths = _runs(values)
    if len(starts) == 1:
        return [
            Message(
                "channel-stuck",
                "%(file)s, θ %(theta)g°, ψ %(psi)g°: %(channel)s has one and the same value throughout. "
                "Check the channel and measure again.",
                place,
            )
        ]
    if len(np.unique(values)) < _LEVELS:
        return []
    for extreme in (values.max(), values.min()):
        at_extreme = values[starts] == extreme
        longest = int(np.argmax(np.where(at_extreme, lengths, 0)))
        share = lengths[at_extreme].sum() / len(values)
        if lengths[longest] >= _SATURATED_RUN and share >= _SATURATED_SHARE:
            return [
                Message(
                    "channel-saturated",
                    "%(file)s, θ %(theta)g°, ψ %(psi)g°: %(channel)s lies at its extreme %(value).6g mA for "
                    "%(length)d rows from row %(row)d. Choose a larger range and measure again.",
                    {**place, "value": float(extreme), "length": int(lengths[longest]),
                     "row": lines[int(starts[longest])]},
                )
            ]  # fmt: skip
    longest = int(np.argmax(lengths))
    if lengths[longest] < max(_SATURATED_RUN, _STUCK_S * rate):
        return []
    return [
        Message(
            "channel-stuck",
            "%(file)s, θ %(theta)g°, ψ %(psi)g°: %(channel)s does not change for %(length)d rows from row "
            "%(row)d. Check the channel and measure again.",
            {**place, "length": int(lengths[longest]), "row": lines[int(starts[longest])]},
        )
    ]


def _leaping(values: Array, lines: Sequence[int], place: dict[str, object]) -> list[Message]:
    """Single values far from both neighbours, by the usual distance from them (median absolute deviation)."""
    if len(values) < _FEWEST_FOR_LEAPS:
        return []
    apart = np.abs(values[1:-1] - (values[:-2] + values[2:]) / 2.0)
    step = float(
        np.min(apart, initial=np.inf, where=apart > 0.0)
    )  # of a coarse ammeter: most values may be equal
    off = np.flatnonzero(apart > _LEAP * max(_NORMAL * float(np.median(apart)), step))
    if not len(off):
        return []
    worst = int(off[np.argmax(apart[off])]) + 1
    return [
        Message(
            "spike",
            "%(file)s, θ %(theta)g°, ψ %(psi)g°: %(channel)s leaps, most of all in row %(row)d to %(value).6g mA "
            "(usual is %(usual).6g mA), which moves the mean. Measure again; look for switching nearby and loose "
            "plugs.",
            {**place, "row": lines[worst], "value": float(values[worst]), "usual": float(np.median(values))},
        )
    ]


def _runs(values: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Starts and lengths of the runs of equal values."""
    starts = np.concatenate(([0], np.flatnonzero(values[1:] != values[:-1]) + 1))
    return starts, np.diff(np.append(starts, len(values)))


def _below_method(t_s: Array, place: dict[str, object]) -> list[Message]:
    duration, rate = duration_and_rate(t_s)
    found: list[Message] = []
    if duration < SHORTEST_S * (1.0 - TOLERANCE):
        found.append(
            Message(
                "below-method",
                "%(file)s, θ %(theta)g°, ψ %(psi)g°: %(duration).4g s is too short for the method (60 s). "
                "Measure longer; the result will say so.",
                {**place, "duration": duration},
            )
        )
    if rate < SLOWEST_HZ * (1.0 - TOLERANCE):
        found.append(
            Message(
                "below-method",
                "%(file)s, θ %(theta)g°, ψ %(psi)g°: %(rate).4g Hz is too slow for the method (200 Hz). "
                "Sample faster; the result will say so.",
                {**place, "rate": rate},
            )
        )
    return found
