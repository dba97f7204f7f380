"""Charts of a loop: poles, step responses, Bode diagram; what they say in words."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app import plots
from app.figures import significant
from app.i18n import gettext
from app.pages import labels
from app.plots.bode import Sign
from app.plots.theme import Spec
from app.services.loop import RATE_STEP, LoopAnswer
from app.services.loop_documents import decibels
from simdevice.frequency import Margins
from simdevice.responses import StepResponse

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
_Piece = tuple[Sign, list[tuple[float, float]]]

_HALF_POWER_DB: Final = float(decibels(np.sqrt(0.5)))
_PHASE_ENDS: Final = (-360.0, 0.0)
_DIGITS: Final = 6  # of what a chart draws


@dataclass(frozen=True, slots=True)
class Units:
    """In which time and deflections are shown, and how many of them are in a second and a radian."""

    time: str
    per_s: float
    angle: str
    per_rad: float


def units_of(steps: StepResponse) -> Units:
    """Milliseconds and milliradians as long as they are handy."""
    short = float(steps.t[-1]) < 1.0
    small = float(np.hypot(steps.alpha, steps.beta).max()) < 1.0
    return Units(
        gettext("ms") if short else labels.unit("s"), 1e3 if short else 1.0,
        gettext("mrad") if small else gettext("rad"), 1e3 if small else 1.0,
    )  # fmt: skip


def nutation_pole(found: LoopAnswer) -> complex:
    """The pole that is nearest to the free rotor's."""
    free = 1j * found.parameters.nutation
    return min(found.poles, key=lambda pole: abs(pole - free))


def pole_chart(found: LoopAnswer) -> Spec:
    """All poles of the complex equation."""
    nutation = nutation_pole(found)
    shown = []
    for pole in found.poles:
        name = gettext("Nutation") if pole == nutation else gettext("Pole")
        sign = "+" if pole.imag >= 0 else "−"
        value = f"{significant(pole.real, 4)} {sign} {significant(abs(pole.imag), 4)}i"
        shown.append(plots.Pole(pole.real, pole.imag, f"{name}: {value} {gettext('rad/s')}"))
    return plots.poles(
        shown, gettext("Poles of the loop in the complex plane; those to the right of zero grow")
    )


def deflections(found: LoopAnswer, steps: StepResponse, units: Units) -> Spec:
    """The paper's figure 4."""
    description = gettext(
        "Deflections of the rotor about both axes by time after a step of the case rate about x"
    )
    rest = [0.0] if found.stable else []
    return _steps(steps, (steps.alpha, steps.beta), units, units.per_rad, rest, description)


def rates(found: LoopAnswer, steps: StepResponse, units: Units) -> Spec:
    """The paper's figure 5."""
    description = gettext("Measured rates about both axes by time after a step of the case rate about x")
    final = [RATE_STEP] if found.stable else []
    return _steps(steps, (steps.rate_x, steps.rate_y), units, 1.0, final, description)


def _steps(
    steps: StepResponse, values: tuple[Array, Array], units: Units, factor: float, final: list[float], description: str
) -> Spec:  # fmt: skip
    x, y = (_pairs(steps.t * units.per_s, value * factor) for value in values)
    cut = None if steps.cut_off is None else (steps.cut_off * units.per_s, gettext("cut off: it grows"))
    return plots.step_response(x, y, final, cut, description)


def gain_chart(found: LoopAnswer) -> Spec:
    """Bode diagram: |L| in dB, with the gain margins from the curve up to 0 dB."""
    curves = _curves(found, found.frequency.loop, lambda gain: np.asarray(decibels(np.abs(gain))))
    marks = [
        plots.MarginMark(
            sign, abs(side.gain.omega), -float(decibels(side.gain.value)), 0.0,
            gettext("Gain margin %(value)s dB at %(omega)s rad/s") % {
                "value": significant(float(decibels(side.gain.value)), 3), "omega": significant(side.gain.omega, 3)
            },
        )
        for sign, side in _sides(found) if side.gain
    ]  # fmt: skip
    values = [value for _, curve in curves for _, value in curve]
    ends = (
        _multiple(max(min(values), -100.0), 20, down=True),
        _multiple(min(max(values), 100.0), 20, down=False),
    )
    return plots.bode(
        curves, marks, [0.0], ends, 20.0, gettext("Loop gain in decibels by frequency, for both of its signs")
    )


def phase_chart(found: LoopAnswer) -> Spec:
    """Bode diagram: the phase of L, that of ω < 0 with the opposite sign; margins down or up to −180°."""
    curves = [
        piece for sign, curve in _curves(found, found.frequency.loop, _phase) for piece in _unbroken(sign, curve)
    ]  # fmt: skip
    marks = []
    for sign, side in _sides(found):
        if side.phase:
            turn = float(np.degrees(side.phase.value)) * (1 if sign == "positive" else -1)
            name = gettext("Phase margin %(value)s° at %(omega)s rad/s") % {
                "value": significant(abs(turn), 3), "omega": significant(side.phase.omega, 3)
            }  # fmt: skip
            marks.append(plots.MarginMark(sign, abs(side.phase.omega), -180.0 - turn, -180.0, name))
    description = gettext("Phase of the loop gain in degrees by frequency, for both of its signs")
    return plots.bode(curves, marks, [-180.0], _PHASE_ENDS, 90.0, description)


def rate_chart(found: LoopAnswer) -> Spec:
    """Measured rate by case rate in dB, the bandwidth marked."""
    curves = _curves(found, found.frequency.rate, lambda gain: np.asarray(decibels(np.abs(gain))))
    values = [value for _, curve in curves for _, value in curve]
    ends = (
        _multiple(max(min(values), -80.0), 20, down=True),
        _multiple(min(max(values), 80.0) + 3.0, 10, down=False),
    )
    marks = [
        plots.MarginMark(
            sign, side.bandwidth, _HALF_POWER_DB, ends[0],
            gettext("Bandwidth %(omega)s rad/s") % {"omega": significant(side.bandwidth, 3)},
        )
        for sign, side in _sides(found) if side.bandwidth
    ]  # fmt: skip
    description = gettext("Measured rate by case rate in decibels by frequency, for both signs of frequency")
    return plots.bode(curves, marks, [0.0, _HALF_POWER_DB], ends, 20.0, description, height=280)


def _sides(found: LoopAnswer) -> Iterator[tuple[Sign, Margins]]:
    if found.margins is not None:
        yield "positive", found.margins.positive
        yield "negative", found.margins.negative


def _curves(found: LoopAnswer, gain: ComplexArray, value: Callable[[ComplexArray], Array]) -> list[_Piece]:
    """Both signs by |ω|; ω < 0 conjugated, so that a loop with real coefficients would show the same twice."""
    omega = found.frequency.omega
    return [
        ("positive", _pairs(omega[omega > 0], value(gain[omega > 0]))),
        ("negative", _pairs(-omega[omega < 0][::-1], value(np.conj(gain[omega < 0][::-1])))),
    ]


def _phase(gain: ComplexArray) -> Array:
    """From −360° up to 0°: the line of −180° lies in the middle."""
    return np.asarray(np.degrees(np.angle(gain)) % 360.0 - 360.0)


def _unbroken(sign: Sign, curve: list[tuple[float, float]]) -> Iterator[_Piece]:
    """The curve in pieces where its phase jumps: at the nutation, and from one end of the axis to the other."""
    begin = 0
    for at in range(1, len(curve) + 1):
        if at == len(curve) or abs(curve[at][1] - curve[at - 1][1]) > 90.0:
            yield sign, curve[begin:at]
            begin = at


def _pairs(x: Array, y: Array) -> list[tuple[float, float]]:
    return [
        (float(f"{a:.{_DIGITS}g}"), float(f"{b:.{_DIGITS}g}"))
        for a, b in zip(x.tolist(), y.tolist(), strict=True)
    ]


def _multiple(value: float, step: float, *, down: bool) -> float:
    return float((np.floor if down else np.ceil)(value / step) * step)
