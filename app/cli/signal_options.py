"""Options of `driftbook simulate` for the parts of the signal, and the bench that they make."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final

import typer

from app.errors import Invalid, problem
from simdevice import faults
from simdevice.bench import Bench
from simdevice.scenarios import Scenario
from simdevice.thermal import ZERO_CELSIUS, Decay, Temperature, WarmUp
from solver.units import SECONDS_PER_HOUR, ampere_from_ma, rad_per_s_from_deg_per_h

_ROOT_HOUR: Final = SECONDS_PER_HOUR**0.5
_ON_THE_SIGNAL: Final = "Signal (default: the scenario's)"
_LARGEST_RATE: Final = 1000.0
_LARGEST_MA: Final = 1000.0


def _option(name: str, unit: str, most: float, words: str) -> Any:
    return typer.Option(
        f"--{name}", min=0, max=most, metavar=unit, help=words, rich_help_panel=_ON_THE_SIGNAL
    )


def _text(name: str, form: str, words: str) -> Any:
    return typer.Option(f"--{name}", metavar=form, help=words, rich_help_panel=_ON_THE_SIGNAL)


FaultTexts = Annotated[
    list[str] | None,
    typer.Option(
        "--fault",
        metavar="KIND[@THETA/PSI][!]",
        help="What goes wrong with a record, such as stuck-x@90/180; again for more. Without a place the seed "
        "draws one; ! hits every repeat instead of the first. Kinds: " + ", ".join(faults.OF_RECORD) + ".",
    ),
]
NoiseOfMean = Annotated[
    float | None,
    typer.Option("--noise-deg-per-h", min=0, max=100, help="Noise of a position's mean.",
                 rich_help_panel=_ON_THE_SIGNAL),
]  # fmt: skip
AngleRandomWalk = Annotated[
    float | None, _option("angle-random-walk", "DEG/√H", _LARGEST_RATE, "N of the white rate noise, °/√h.")
]
BiasInstability = Annotated[
    float | None,
    _option(
        "bias-instability", "DEG/H", _LARGEST_RATE, "B of the flicker noise, °/h; its Allan floor is 0.664·B."
    ),
]
RateRandomWalk = Annotated[
    float | None,
    _option("rate-random-walk", "DEG/H/√H", _LARGEST_RATE, "K of the rate's random walk, °/h/√h."),
]
TurnOn = Annotated[
    float | None,
    _option(
        "turn-on", "DEG/H", _LARGEST_RATE, "Standard deviation of each bias from power-up to power-up, °/h."
    ),
]
WarmUpText = Annotated[
    str | None,
    _text("warm-up", "DEG/H[,DEG/H]/S", "Excess of the biases at power-up, °/h (both, or x and y), and the time "
          "constant of its decay, s, such as 0.3,-0.2/600."),
]  # fmt: skip
TemperatureText = Annotated[
    str | None,
    _text("temperature", "C[/K-PER-H]", "At power-up, °C, and its rise, K/h, such as 20/1.5; the parameters follow it "
          "by the type's coefficients and hold at 20 °C."),
]  # fmt: skip
SincePowerUp = Annotated[
    float | None,
    _option("since-power-up", "S", 1e6, "From power-up to the first record, s: how warm the gyro is."),
]
Mains = Annotated[
    float | None,
    _option("mains", "MA", _LARGEST_MA, "Amplitude of 50 Hz in both currents, mA; random phase."),
]
Ripple = Annotated[
    float | None,
    _option("ripple", "MA", _LARGEST_MA, "Amplitude at the rotor's frequency, mA. No filter stands before the "
            "sampling: above half the rate it shows at its alias."),
]  # fmt: skip
Jitter = Annotated[
    float | None,
    _option(
        "jitter",
        "S",
        1.0,
        "Standard deviation of the moments of sampling, s; the times written stay nominal.",
    ),
]


@dataclass(frozen=True, slots=True)
class SignalOptions:
    """What the options say, in laboratory units; None where they are silent."""

    noise_deg_per_h: float | None = None
    angle_random_walk: float | None = None
    bias_instability: float | None = None
    rate_random_walk: float | None = None
    turn_on: float | None = None
    warm_up: str | None = None
    temperature: str | None = None
    since_power_up: float | None = None
    mains: float | None = None
    ripple: float | None = None
    jitter: float | None = None
    faults: tuple[str, ...] = ()


def with_signal(bench: Bench, scenario: Scenario, options: SignalOptions) -> Bench:
    """The bench with what the options say instead of what the scenario says.

    Raises
    ------
    Invalid
        Names the option.
    """
    bench = _with_noise(bench, options)
    if options.since_power_up is not None:
        with blaming("--since-power-up"):
            bench = replace(bench, timetable=replace(bench.timetable, first=options.since_power_up))
    if options.warm_up is not None:
        with blaming("--warm-up"):
            bench = replace(bench, warm_up=_warm_up(options.warm_up))
    if options.temperature is not None:
        with blaming("--temperature"):
            known = replace(_temperature(options.temperature), sensitivity=scenario.kind.sensitivity)
            bench = replace(bench, temperature=known)
    if options.mains is not None:
        with blaming("--mains"):
            amplitude = ampere_from_ma(options.mains)
            bench = replace(bench, interference=replace(bench.interference, mains=amplitude))
    if options.ripple is not None:
        with blaming("--ripple"):
            amplitude = ampere_from_ma(options.ripple)
            bench = replace(bench, interference=replace(bench.interference, ripple=amplitude))
    if options.jitter is not None:
        with blaming("--jitter"):
            bench = replace(bench, interference=replace(bench.interference, jitter=options.jitter))
    with blaming("--fault"):
        struck = tuple(faults.parse(text, faults.OF_RECORD) for text in options.faults)
        return replace(bench, faults=struck)


@contextmanager
def blaming(option: str) -> Iterator[None]:
    """What is refused within is a problem of this option."""
    try:
        yield
    except ValueError as error:
        raise Invalid(problem("bad-option", "%(reason)s", column=option, reason=str(error))) from error


def _with_noise(bench: Bench, options: SignalOptions) -> Bench:
    if options.noise_deg_per_h is not None and options.angle_random_walk is not None:
        raise Invalid(
            problem("two-noises", "This and --noise-deg-per-h both say how strong the white noise is. Give one.",
                    column="--angle-random-walk")
        )  # fmt: skip
    noise = bench.noise
    if options.noise_deg_per_h is not None:
        with blaming("--noise-deg-per-h"):
            walk = rad_per_s_from_deg_per_h(options.noise_deg_per_h) * bench.duration**0.5
            noise = replace(noise, angle_random_walk=walk)
    if options.angle_random_walk is not None:
        with blaming("--angle-random-walk"):
            walk = rad_per_s_from_deg_per_h(options.angle_random_walk) * _ROOT_HOUR
            noise = replace(noise, angle_random_walk=walk)
    if options.bias_instability is not None:
        with blaming("--bias-instability"):
            noise = replace(noise, bias_instability=rad_per_s_from_deg_per_h(options.bias_instability))
    if options.rate_random_walk is not None:
        with blaming("--rate-random-walk"):
            walk = rad_per_s_from_deg_per_h(options.rate_random_walk) / _ROOT_HOUR
            noise = replace(noise, rate_random_walk=walk)
    if options.turn_on is not None:
        with blaming("--turn-on"):
            noise = replace(noise, turn_on=rad_per_s_from_deg_per_h(options.turn_on))
    return replace(bench, noise=noise)


def _warm_up(text: str) -> WarmUp:
    """``0.3/600`` or ``0.3,-0.2/600``."""
    amplitudes, slash, time_constant = text.partition("/")
    numbers = _numbers(amplitudes, ",")
    if not slash or len(numbers) > 2:
        raise ValueError(f"“{text}”: write °/h and seconds, such as 0.3/600, or 0.3,-0.2/600 for x and y.")
    seconds = _number(time_constant)
    x, y = (Decay(rad_per_s_from_deg_per_h(number), seconds) for number in (numbers[0], numbers[-1]))
    return WarmUp(x, y)


def _temperature(text: str) -> Temperature:
    """``20`` or ``20/1.5``."""
    numbers = _numbers(text, "/")
    if len(numbers) > 2:
        raise ValueError(f"“{text}”: write °C at power-up and K/h, such as 20/1.5.")
    if not numbers[0] > -ZERO_CELSIUS:
        raise ValueError(f"{numbers[0]:g} °C is not above absolute zero.")
    drift = numbers[1] / SECONDS_PER_HOUR if len(numbers) == 2 else 0.0
    return Temperature(at_power_up=numbers[0] + ZERO_CELSIUS, drift=drift)


def _numbers(text: str, separator: str) -> list[float]:
    return [_number(part) for part in text.split(separator)]


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"“{text}” is no number.") from None
