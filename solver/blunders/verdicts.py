"""What a technician reads of a diagnosis: one sentence for each kind of blunder, with its cure."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from solver.errors import Message
from solver.estimators.observability import UNITS, lab_units
from solver.records import PARAMETERS, Array, Observations
from solver.units import deg_from_rad, deg_per_h_from_rad_per_s, ma_from_ampere

_MOST_NAMED: Final = 8
_OFF: Final = 2.0


def place(theta: float, psi: float, repeat: int = 0) -> str:
    """Name a position in no language: ``θ 90° ψ 180° ·2`` for its first repeat."""
    name = f"θ {deg_from_rad(theta):.6g}° ψ {deg_from_rad(psi):.6g}°"
    return name + (f" ·{repeat + 1}" if repeat else "")


def places(observations: Observations, rows: Sequence[int]) -> str:
    """Name the positions of some rows."""
    at = observations
    return _shortened([place(float(at.theta[r]), float(at.psi[r]), int(at.repeat[r])) for r in rows], ", ")


def _shortened(named: Sequence[str], between: str) -> str:
    more = len(named) - _MOST_NAMED
    return between.join(named[:_MOST_NAMED]) + (f"{between}… (+{more})" if more > 0 else "")


def number(value: float) -> str:
    """Four digits, thousands written out."""
    return f"{value:.0f}" if 1e4 <= abs(value) < 1e9 else f"{value:.4g}"


def factor_text(factor: float) -> str:
    """``60`` or ``1/60``."""
    return f"{factor:.6g}" if factor >= 1 else f"1/{1 / factor:.6g}"


def _current(current: float) -> str:
    return f"{ma_from_ampere(current):.7g}"


def _rate(rate: float) -> str:
    return f"{deg_per_h_from_rad_per_s(rate):+.3g}"


def verdict(
    code: str,
    observations: Observations,
    rows: Sequence[int],
    details: Mapping[str, Any],
    fall: tuple[str, float, float],
) -> Message:
    """The sentence of a finding.

    Parameters
    ----------
    code
    observations
        As given.
    rows
        Measurements that it speaks of.
    details
        Of the hypothesis.
    fall
        What falls (χ², s of the residuals, or the distance from the prior), before and after.
    """
    shown = {"measure": fall[0], "before": number(fall[1]), "after": number(fall[2])}
    named = {**shown, "positions": places(observations, rows)}
    if code in _IN_THE_FIT:
        return _in_the_fit(code, observations, rows, details, named, contented=fall[2] >= fall[1])
    return _of_the_session(code, details, shown)


_IN_THE_FIT: Final = frozenset(
    {"outlier", "positions-swapped", "position-wrong", "channel-stuck", "channel-saturated", "warm-up"}
)


def _in_the_fit(
    code: str,
    observations: Observations,
    rows: Sequence[int],
    details: Mapping[str, Any],
    named: dict[str, str],
    *,
    contented: bool,
) -> Message:
    if code == "outlier":
        return Message(
            code,
            "The currents at %(positions)s do not fit the others (channel %(channel)s): without them %(measure)s "
            "falls from %(before)s to %(after)s. Measure this position again.",
            {**named, "channel": details["channel"]},
        )
    if code == "positions-swapped":
        one, other = (places(observations, [row]) for row in rows)
        return Message(
            code,
            "Positions %(one)s and %(other)s look exchanged: with them exchanged %(measure)s falls from %(before)s "
            "to %(after)s. Check the records, then exchange them or measure both again.",
            {**named, "one": one, "other": other},
        )
    if code == "position-wrong":
        return Message(
            code,
            "The measurement at %(positions)s looks as if it had been made at %(actual)s: taken as that, %(measure)s "
            "falls from %(before)s to %(after)s. Check the stand's indexing and measure this position again.",
            {**named, "actual": place(*details["actual"])},
        )
    if code == "channel-stuck" and contented:  # so early that the fit is content without it
        return Message(
            code,
            "Channel %(channel)s of the ammeter looks stuck: it shows one and the same value, %(value)s mA, at the "
            "last of the positions, %(positions)s, which no gyro would. Check the ammeter and measure these "
            "positions again.",
            {
                "channel": details["channel"],
                "value": _current(details["value"]),
                "positions": named["positions"],
            },
        )
    if code == "channel-stuck":
        return Message(
            code,
            "Channel %(channel)s of the ammeter looks stuck: it shows %(value)s mA at the last of the positions, "
            "%(positions)s. Without these readings %(measure)s falls from %(before)s to %(after)s. Check the "
            "ammeter and measure these positions again.",
            {**named, "channel": details["channel"], "value": _current(details["value"])},
        )
    if code == "channel-saturated":
        return Message(
            code,
            "Channel %(channel)s of the ammeter looks saturated: it shows no more than %(limit)s mA at %(positions)s. "
            "Without these readings %(measure)s falls from %(before)s to %(after)s. Choose a larger range and "
            "measure these positions again.",
            {**named, "channel": details["channel"], "limit": _current(details["limit"])},
        )
    return Message(
        code,
        "The biases drifted during the session, as in a warm-up (x by %(x)s °/h, y by %(y)s °/h from beginning to "
        "end): with that drift taken out %(measure)s falls from %(before)s to %(after)s. Let the gyro warm up, then "
        "measure the session again.",
        {**named, "x": _rate(details["drift"][0]), "y": _rate(details["drift"][1])},
    )


def _of_the_session(code: str, details: Mapping[str, Any], fall: dict[str, str]) -> Message:
    if code == "angle-unit":
        return Message(
            code,
            "The certificate's angles look as if they had been read in a wrong unit: multiplied by %(factor)s "
            "(60: arcminutes, 3600: degrees taken for arcseconds), %(measure)s falls from %(before)s to %(after)s. "
            "Check the unit in the certificate's header.",
            {**fall, "factor": factor_text(details["factor"])},
        )
    if code == "channels-swapped":
        return Message(
            code,
            "The channels x and y look exchanged: with them exchanged %(measure)s falls from %(before)s to "
            "%(after)s. Check the ammeter's wiring and the columns of the file.",
            fall,
        )
    if code == "channel-sign":
        return Message(
            code,
            "The sign of channel %(channel)s looks reversed: with it reversed %(measure)s falls from %(before)s to "
            "%(after)s. Check the polarity of the ammeter's leads.",
            {**fall, "channel": details["channel"]},
        )
    if code == "psi-reversed":
        return Message(
            code,
            "The angle ψ looks counted the other way: with ψ reversed %(measure)s falls from %(before)s to "
            "%(after)s. Check the stand's sense of rotation about its inner axis.",
            fall,
        )
    if code == "theta-reversed":
        return Message(
            code,
            "The angle θ looks counted the other way: with θ reversed %(measure)s falls from %(before)s to "
            "%(after)s. Check the stand's sense of rotation about its outer axis.",
            fall,
        )
    if code == "latitude-sign":
        return Message(
            code,
            "The latitude looks as if it had the wrong sign: with the other sign %(measure)s falls from %(before)s "
            "to %(after)s. Check whether the stand is north or south of the equator.",
            fall,
        )
    if code == "latitude-complement":
        return Message(
            code,
            "The latitude looks as if its complement to 90° had been given: with the complement %(measure)s falls "
            "from %(before)s to %(after)s. Check the stand's latitude.",
            fall,
        )
    return Message(
        "current-unit",
        "The currents look as if they had been read in a wrong unit: multiplied by %(factor)s, %(measure)s falls "
        "from %(before)s to %(after)s. Check the unit in the header of the currents' file (A, mA or µA).",
        {**fall, "factor": factor_text(details["factor"])},
    )


def unexplained(measure: str, value: float, expected: int) -> Message:
    """A misfit that no single blunder explains."""
    return Message(
        "unexplained",
        "The misfit is far too large: %(measure)s is %(value)s where %(expected)d is expected, and no single mistake "
        "explains it. Look for several mistakes, or check the stated uncertainty of the currents.",
        {"measure": measure, "value": number(value), "expected": expected},
    )


def scattered(scatter: float) -> Message:
    """Residuals without stated noise that no gyro's noise could be, relative to what is measured."""
    return Message(
        "unexplained",
        "The residuals scatter by %(percent)s %% of the Earth rate, far more than a gyro's noise, and no single "
        "mistake explains it: the parameters cannot be relied upon. Look for several mistakes among the positions, the "
        "certificate and the currents.",
        {"percent": number(100.0 * scatter)},
    )


def differences(of: Array, apart: Array) -> str:
    """Name the parameters by which a gyro is not the one expected, in no language.

    Parameters
    ----------
    of : (8,) array
        Differences from what is expected, SI.
    apart : (8,) array
        The same in their standard uncertainties; NaN where nothing is expected.
    """
    size = np.nan_to_num(np.abs(apart))
    return ", ".join(
        f"{name} {value:+.4g} {UNITS[name]} ({u:.1f} u)"
        for name, value, u in zip(PARAMETERS, lab_units(of), size, strict=True)
        if u > max(_OFF, size.max() / 10)
    )


def far_from_prior(changes: str, distance: float, compared: int) -> Message:
    """A gyro that is not the one expected, in a session without a mistake to explain it."""
    return Message(
        "far-from-prior",
        "The gyro is not the one expected: %(changes)s; D² is %(distance)s where %(expected)d is expected, and no "
        "mistake in the session explains it. Check that it is this gyro, the stand's latitude and the currents' "
        "unit; if all that is right, the gyro has changed.",
        {"changes": changes, "distance": number(distance), "expected": compared},
    )


def or_changed(changes: str) -> Message:
    """What else could be where only a prior tells of a mistake."""
    return Message(
        "or-changed",
        "Only the expectation tells: if the session is right as it is, the gyro has changed (%(changes)s).",
        {"changes": changes},
    )


def cannot_exclude(codes: Sequence[str], *, prior_given: bool) -> Message:
    """Mistakes of the session as a whole that these data do not tell from none."""
    values = {"kinds": ", ".join(codes)}
    if prior_given:
        return Message(
            "not-excluded",
            "Neither the fit nor the prior can exclude: %(kinds)s. Give a prior that also speaks of the other "
            "parameters, or with smaller standard uncertainties.",
            values,
        )
    return Message(
        "not-excluded",
        "The fit alone cannot exclude: %(kinds)s. Give a prior (--prior FILE): the type's nominal values or the "
        "gyro's last calibration.",
        values,
    )


def twins_alike(observations: Observations, pairs: Sequence[tuple[int, int]]) -> Message:
    """Positions that are the same in all but their misalignment."""
    named = [f"{places(observations, [one])} ↔ {places(observations, [other])}" for one, other in pairs]
    return Message(
        "positions-swapped",
        "An exchange of positions that differ by their misalignment alone would not show, nor change the result by "
        "much: %(pairs)s.",
        {"pairs": _shortened(named, "; ")},
    )


def errors_hidden(observations: Observations, faint: Sequence[tuple[int, str]], noticed: float) -> Message:
    """Measurements that the others hardly check."""
    named = [f"{places(observations, [row])} ({channel})" for row, channel in faint]
    return Message(
        "errors-hidden",
        "A wrong current might not show, even by %(noticed)g u, but spoil the result: %(positions)s. The other "
        "positions hardly tell what it should be. Measure more positions, or these again.",
        {"noticed": noticed, "positions": _shortened(named, ", ")},
    )


def small_angles(factors: Sequence[float]) -> Message:
    """Certificate angles that do not matter enough for their unit to show."""
    return Message(
        "angle-unit",
        "The certificate's angles are too small to show in the fit whether their unit is right: multiplied by "
        "%(factors)s they would fit as well. Check the unit in the certificate's header.",
        {"factors": ", ".join(factor_text(factor) for factor in factors)},
    )


def separate(others: Sequence[str], parameters: Sequence[str]) -> Message:
    """What would tell equally good explanations apart."""
    values = {"others": "; ".join(others), "parameters": ", ".join(parameters)}
    if parameters:
        return Message(
            "equivalent",
            "These explain the data as well: %(others)s. A prior with smaller uncertainties for %(parameters)s would "
            "tell them apart, or larger certified misalignments.",
            values,
        )
    return Message(
        "equivalent",
        "These explain the data as well: %(others)s. Measuring the named positions again would tell them apart.",
        values,
    )
