"""Gyro types and named scenarios, each with a truth that is known.

The numbers are of a plausible size for dynamically tuned gyros; only the torquer scale of type
GVK-6 (10 rad/(s·A)) is the paper's. They are inputs of a simulation, not properties of any
make.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Final

import numpy as np

from simdevice import dynamics
from simdevice.ammeter import Ammeter, Channel
from simdevice.bench import Bench
from simdevice.certificate import ANGLE_SPREAD, U_RANDOM, U_SYSTEMATIC, Position, draw_certificate
from simdevice.dynamics import LoopParameters
from simdevice.gyro import Gyro
from simdevice.interference import Interference
from simdevice.noise import RateNoise
from simdevice.stand import Stand
from simdevice.streams import Part, derived_seed, stream
from simdevice.thermal import ROOM, Decay, Temperature, WarmUp
from simdevice.timetable import Timetable
from solver.units import rad_from_arcsec, rad_from_deg, rad_per_s_from_deg_per_h

MOSCOW: Final = rad_from_deg(55.7558)
"""Latitude of the stand where a scenario says no other, rad."""


def _dph(rate: float) -> float:
    return rad_per_s_from_deg_per_h(rate)


def _walk(deg_per_root_hour: float) -> float:
    """°/√h to rad/√s."""
    return rad_per_s_from_deg_per_h(deg_per_root_hour) * 60.0


@dataclass(frozen=True, slots=True)
class GyroType:
    """A make of gyro.

    Attributes
    ----------
    name
        As on the type plate.
    nominal
        The type's mean parameters.
    spread
        Standard deviation between individuals, by parameter, SI; 0 where not named.
    start_scatter
        Standard deviation between starts (power-ups) of one individual, likewise.
    noise
        Its white rate noise, which is all that most scenarios have.
    full_noise
        The same white noise with the type's other coefficients.
    warm_up
        What the biases have too much after power-up.
    sensitivity
        To temperature, by parameter, SI per K.
    loop
        Rebalance loop; None where it is not known.
    """

    name: str
    nominal: Gyro
    spread: Mapping[str, float]
    start_scatter: Mapping[str, float]
    noise: RateNoise
    full_noise: RateNoise
    warm_up: WarmUp
    sensitivity: Mapping[str, float]
    loop: LoopParameters | None = None


GVK_6: Final = GyroType(
    name="GVK-6",
    nominal=Gyro(
        kx=10.0, ky=9.9, kxy=0.05, kyx=-0.04, w0x=_dph(1.5), w0y=_dph(-0.8), wg=_dph(6.0), wk=_dph(2.0)
    ),
    spread={
        "kx": 0.1, "ky": 0.1, "kxy": 0.03, "kyx": 0.03,
        "w0x": _dph(1.5), "w0y": _dph(1.5), "wg": _dph(3.0), "wk": _dph(1.0),
    },
    start_scatter={
        "kx": 5e-4, "ky": 5e-4, "w0x": _dph(0.03), "w0y": _dph(0.03), "wg": _dph(0.02), "wk": _dph(0.02),
    },
    noise=RateNoise(angle_random_walk=_walk(3e-4)),
    full_noise=RateNoise(_walk(3e-4), _dph(5e-4), _dph(5e-4) / 60.0, _dph(0.03)),
    warm_up=WarmUp(Decay(_dph(0.3), 600.0), Decay(_dph(-0.2), 700.0)),
    sensitivity={"kx": -1e-3, "ky": -1e-3, "w0x": _dph(0.02), "w0y": _dph(-0.015), "wg": _dph(0.01)},
    loop=dynamics.GVK_6,
)  # fmt: skip

DTG_4: Final = GyroType(
    name="DTG-4",
    nominal=Gyro(
        kx=4.0, ky=4.05, kxy=-0.02, kyx=0.03, w0x=_dph(-4.0), w0y=_dph(3.0), wg=_dph(-9.0), wk=_dph(3.5)
    ),
    spread={
        "kx": 0.06, "ky": 0.06, "kxy": 0.02, "kyx": 0.02,
        "w0x": _dph(3.0), "w0y": _dph(3.0), "wg": _dph(4.0), "wk": _dph(2.0),
    },
    start_scatter={
        "kx": 4e-4, "ky": 4e-4, "w0x": _dph(0.1), "w0y": _dph(0.1), "wg": _dph(0.06), "wk": _dph(0.06),
    },
    noise=RateNoise(angle_random_walk=_walk(8e-4)),
    full_noise=RateNoise(_walk(8e-4), _dph(2e-3), _dph(2e-3) / 60.0, _dph(0.1)),
    warm_up=WarmUp(Decay(_dph(-0.8), 500.0), Decay(_dph(0.6), 500.0)),
    sensitivity={"kx": -8e-4, "ky": -8e-4, "w0x": _dph(-0.05), "w0y": _dph(0.04), "wg": _dph(-0.03)},
)  # fmt: skip

TYPES: Final[Mapping[str, GyroType]] = {kind.name: kind for kind in (GVK_6, DTG_4)}
"""The simulated types by name."""


def _alike(channel: Channel) -> Ammeter:
    return Ammeter(channel, channel)


LABORATORY_AMMETER: Final = _alike(Channel(step=1e-9, limit=1e-3, noise=5e-9))
"""Steps of 1 nA up to 1 mA, 5 nA of noise in a sample, no error of gain or zero."""


@dataclass(frozen=True, slots=True)
class Scenario:
    """A named situation; `bench` makes it out of a seed.

    Attributes
    ----------
    name, summary
        For a command line and its help.
    gyro
        The truth.
    kind
        The gyro's type: where coefficients come from that a user asks for beyond the scenario.
    noise, ammeter, latitude, base
        Of the gyro, the instrument and the stand; latitude and base angles in rad.
    angle_spread
        Standard deviation of the certified angles, rad.
    u_random, u_systematic
        The certificate's standard uncertainties, rad; the truth deviates by them.
    timetable, warm_up, temperature, interference, loop
        As those of a `Bench`.
    """

    name: str
    summary: str
    kind: GyroType = GVK_6
    gyro: Gyro = GVK_6.nominal
    noise: RateNoise = GVK_6.noise
    ammeter: Ammeter = field(default_factory=lambda: LABORATORY_AMMETER)
    latitude: float = MOSCOW
    base: tuple[float, float, float] = (0.0, 0.0, 0.0)
    angle_spread: float = ANGLE_SPREAD
    u_random: float = U_RANDOM
    u_systematic: float = U_SYSTEMATIC
    timetable: Timetable = field(default_factory=Timetable)
    warm_up: WarmUp = field(default_factory=WarmUp)
    temperature: Temperature | None = None
    interference: Interference = field(default_factory=Interference)
    loop: LoopParameters | None = None

    def bench(self, seed: int, positions: tuple[Position, ...] | None = None) -> Bench:
        """The bench of this scenario.

        Parameters
        ----------
        seed
            Draws the certificate, the truth's deviation from it, and the session's noise. The
            gyro's truth is the scenario's, whatever the seed. Set rate, duration or another gyro
            with `dataclasses.replace`.
        positions
            Places that the stand's certificate covers; default: the sixteen.
        """
        stand_seed = derived_seed(seed, Part.STAND_SEED)
        certificate = draw_certificate(
            stand_seed,
            positions,
            spread=self.angle_spread,
            u_random=self.u_random,
            u_systematic=self.u_systematic,
        )
        stand = Stand(self.latitude, certificate, self.base, stand_seed)
        return Bench(
            self.gyro, stand, self.ammeter, self.noise, seed=seed,
            timetable=self.timetable, warm_up=self.warm_up, temperature=self.temperature,
            interference=self.interference, loop=self.loop,
        )  # fmt: skip


_ALL = (
    Scenario("gvk-6", "The nominal GVK-6 on a good stand in Moscow."),
    Scenario("dtg-4", "The nominal DTG-4: coarser, noisier.", kind=DTG_4, gyro=DTG_4.nominal, noise=DTG_4.noise),
    Scenario(
        "quiet",
        "No noise, an ideal ammeter, a perfectly known stand: the parameters come back to rounding.",
        noise=RateNoise(),
        ammeter=Ammeter(),
        u_random=0.0,
        u_systematic=0.0,
    ),
    Scenario("exact-stand", "A perfectly known stand: only noise stands between result and truth.",
             u_random=0.0, u_systematic=0.0),
    Scenario("noisy", "Ten times the rate noise and a coarse ammeter.",
             noise=RateNoise(10 * GVK_6.noise.angle_random_walk),
             ammeter=_alike(Channel(step=1e-7, limit=1e-4, noise=5e-8))),
    Scenario("south", "Southern latitude.", latitude=rad_from_deg(-33.9)),
    Scenario("equator", "No vertical Earth rate.", latitude=0.0),
    Scenario("pole", "No horizontal Earth rate: not every parameter can be found.", latitude=np.pi / 2),
    Scenario("reversed", "The x torquer is wired backwards: a negative scale factor.",
             gyro=GVK_6.nominal.shifted({"kx": -2 * GVK_6.nominal.kx})),
    Scenario("skewed", "Degrees of certified misalignment.", angle_spread=rad_from_deg(2.0)),
    Scenario("poor-stand", "A certificate uncertain by tens of arcseconds.",
             u_random=rad_from_arcsec(20.0), u_systematic=rad_from_arcsec(15.0)),
    Scenario("tilted-base", "A base off level by arcminutes, and off north by more.",
             base=(rad_from_deg(0.02), rad_from_deg(-0.03), rad_from_deg(0.1))),
    Scenario("poor-ammeter", "Gain and zero errors of the ammeter.",
             ammeter=Ammeter(Channel(gain=1.0003, offset=4e-9, step=1e-9, limit=1e-3, noise=5e-9),
                             Channel(gain=0.9998, offset=-3e-9, step=1e-9, limit=1e-3, noise=5e-9))),
    Scenario("saturated", "An ammeter whose range is too small for some positions.",
             ammeter=_alike(Channel(step=1e-9, limit=2e-6, noise=5e-9))),
    Scenario("anisoelastic", "A g²-sensitive drift that the eight parameters do not describe.",
             gyro=GVK_6.nominal.shifted({"wn": _dph(0.3)})),
    Scenario("full-noise", "Every part of the signal at the GVK-6's coefficients, an hour after power-up.",
             noise=GVK_6.full_noise, warm_up=GVK_6.warm_up, loop=GVK_6.loop,
             temperature=Temperature(swing=0.05, period=1800.0, sensitivity=GVK_6.sensitivity),
             interference=Interference(mains=2e-9, ripple=5e-9, jitter=1e-6),
             ammeter=Ammeter(Channel(gain=1.00001, offset=1e-10, step=1e-9, limit=1e-3, noise=5e-9),
                             Channel(gain=0.99999, offset=-1e-10, step=1e-9, limit=1e-3, noise=5e-9))),
    Scenario("cold-start", "Measured from power-up on: the biases drift as the gyro warms up.",
             warm_up=GVK_6.warm_up, timetable=Timetable(first=15.0)),
    Scenario("restless", "Twenty times the bias instability and rate random walk.",
             noise=replace(GVK_6.full_noise, bias_instability=20 * GVK_6.full_noise.bias_instability,
                           rate_random_walk=20 * GVK_6.full_noise.rate_random_walk)),
    Scenario("drifting-temperature", "A room that warms by 2 K in an hour; the gyro follows it.",
             temperature=Temperature(at_power_up=ROOM - 2.0, drift=2.0 / 3600.0, sensitivity=GVK_6.sensitivity)),
    Scenario("mains", "The mains, 50 Hz, picked up with 20 nA.", interference=Interference(mains=2e-8)),
    Scenario("ripple", "Ripple of 50 nA at the rotor's 249.9 Hz: at 200 samples per second it shows at 49.9 Hz.",
             interference=Interference(ripple=5e-8)),
    Scenario("jitter", "A sampling clock that jitters by 0.2 ms, over ripple of 50 nA, which shows it.",
             interference=Interference(ripple=5e-8, jitter=2e-4)),
)  # fmt: skip

SCENARIOS: Final[Mapping[str, Scenario]] = {scenario.name: scenario for scenario in _ALL}
"""Every scenario by name."""


def scenario(name: str) -> Scenario:
    """The scenario of that name.

    Raises
    ------
    ValueError
        Names those that there are.
    """
    try:
        return SCENARIOS[name]
    except KeyError:
        raise ValueError(f"There is no scenario {name}. There are: {', '.join(SCENARIOS)}.") from None


def draw_gyro(kind: GyroType, seed: int) -> Gyro:
    """An individual of a type: the nominal gyro with every parameter off by its spread."""
    return kind.nominal.shifted(scatter(stream(seed, Part.INDIVIDUAL), kind.spread))


def scatter(generator: np.random.Generator, spread: Mapping[str, float]) -> dict[str, float]:
    """One normal draw for each named parameter, of that standard deviation.

    Every parameter has its own place in the stream, so naming one more changes no other.
    """
    names = [item.name for item in fields(Gyro)]
    unknown = set(spread) - set(names)
    if unknown:
        raise ValueError(f"A gyro has no parameter {', '.join(sorted(unknown))}.")
    deviates = dict(zip(names, generator.standard_normal(len(names)).tolist(), strict=True))
    return {name: deviates[name] * std for name, std in spread.items()}
