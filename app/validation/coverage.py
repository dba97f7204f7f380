"""Coverage: how often 95 % intervals hold the truth, on simulated sessions.

Every session has a gyro, a certificate and noise of its own. The stand truly stands where the
certificate errs by its stated uncertainty: each position by itself and all together. Currents come
from `simdevice`, which turns with scipy's `Rotation` and shares nothing with the solver's geometry.
Each channel carries white noise and noise with a correlation time of 0.1 s; further sessions of the full study
have 0.5 and 1 s, or state u(J) with 6, 10 and 20 degrees of freedom.

The full study makes every record, 60 s at 200 Hz, and takes mean and uncertainty from it as a real
session's. The quick one makes 640 records, takes from them how the stated uncertainty and its degrees
of freedom scatter, and draws the means: that of Gaussian noise is exactly Gaussian, of the variance that
the autocorrelation says, and independent of the scatter about it.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import special

from app.i18n import marked
from app.validation.report import Case, Check, Group, Progress, in_range
from simdevice.bench import Bench, steady_currents
from simdevice.certificate import as_printed, certify, sixteen_positions
from simdevice.gyro import Gyro
from simdevice.stand import Stand
from solver.calibrate import Calibration, calibrate
from solver.inputs import CommonUncertainty
from solver.propagation.uncertainty import coverage_factor
from solver.records import PARAMETERS, Array, Method, Observations
from solver.signals.noise import mean_with_uncertainty
from solver.units import (
    rad_from_arcsec,
    rad_from_deg,
    rad_per_s_from_deg_per_h,
    scale_from_deg_per_h_per_ma,
)

LEVEL: Final = 0.95
QUICK, FULL = 400, 4000
METHODS: Final[tuple[Method, ...]] = ("least-squares", "paper", "generalised")
"""The first one alone in the quick study, which must not take long."""
_JOINT: Final = 0.001
"""Probability that one of the quick study's shares falls outside by chance, whichever it is."""
_FULL_RANGE: Final[Mapping[Method, tuple[float, float]]] = {
    "least-squares": (0.94, 0.96),
    "generalised": (0.94, 0.96),
    "paper": (0.94, 0.97),
}
"""The uncertainty of a mean errs on the safe side; the paper's method does not weigh by it, so it shows there most."""
_POSITIONS: Final = sixteen_positions()
_SAMPLES, _RATE = 12_000, 200.0
_CORRELATION_TIME: Final = 0.1
_SLOWER: Final = (0.5, 1.0)
_STATED_DOF: Final = (6.0, 10.0, 20.0)
_SLOWER_RECORDS: Final = 320
_CORRELATED_SHARE: Final = 0.3
"""Standard deviation of the correlated noise over that of the white noise."""
_RECORDS: Final = 640
_NOISE: Final = float(rad_per_s_from_deg_per_h(0.005))
_SPREAD, _U_RANDOM, _U_COMMON = (float(rad_from_arcsec(angle)) for angle in (15.0, 60.0, 30.0))
_LATITUDE: Final = float(rad_from_deg(55.7558))
_TYPE: Final = np.concatenate(
    (
        scale_from_deg_per_h_per_ma(np.array([2060.0, 2040.0, 0.0, 0.0])),
        rad_per_s_from_deg_per_h(np.array([0.0, 0.0, 0.0, 0.0])),
    )
)
_INDIVIDUAL: Final = np.concatenate(
    (
        scale_from_deg_per_h_per_ma(np.array([40.0, 40.0, 12.0, 12.0])),
        rad_per_s_from_deg_per_h(np.array([2.0, 2.0, 5.0, 1.0])),
    )
)
_SOURCE: Final = marked(
    "Driftbook’s own: sessions of simulated gyros (simdevice, scipy’s Rotation) at 55.76° N, 0.005 °/h of "
    "autocorrelated noise in each mean, certificate angles wrong by 60″ each and 30″ together"
)


Stated = tuple[Array, Array]
"""Standard uncertainties, in units of the true one, and their degrees of freedom; (records,) each."""


def group(progress: Progress, full: bool, seed: int) -> Group:
    """Run the study: 400 sessions, or with `full` 4,000 with their records."""
    count = FULL if full else QUICK
    methods = METHODS if full else METHODS[:1]
    stated = _stated_of_records(progress, seed)
    held = np.zeros((len(methods), len(PARAMETERS)))
    error = ""
    try:
        for number in range(count):
            progress(0.1 + 0.9 * number / count, _TITLE)
            held += _session(np.random.default_rng([seed, 2, number]), methods, None if full else stated[1:])
    except Exception as reason:  # told in the report: the other suites go on
        error = f"{type(reason).__name__}: {reason}"
    further = _further(seed) if full else []  # half a minute, which the quick study does not have
    note = _FULL_NOTE if full else _QUICK_NOTE
    range_of_all = binomial_range(count, len(PARAMETERS))
    cases = [
        Case(
            _NAMES[method],
            _SOURCE,
            _FUNCTION,
            () if error else _shares(shares / count, _FULL_RANGE[method] if full else range_of_all),
            note,
            error,
        )
        for method, shares in zip(methods, held, strict=True)
    ]
    return Group("coverage", _TITLE, (_of_means(stated), *cases, *further))


def _further(seed: int) -> list[Case]:
    """Least squares with slower noise, and with u(J) stated of few degrees of freedom."""
    found: list[Case] = []
    for number, (name, draw) in enumerate(_conditions(seed).items()):
        error, held = "", np.zeros((1, len(PARAMETERS)))
        try:
            for session in range(QUICK):
                rng = np.random.default_rng([seed, 3, number, session])
                held += _session(rng, METHODS[:1], draw(rng))
        except Exception as reason:  # told in the report: the others go on
            error = f"{type(reason).__name__}: {reason}"
        checks = () if error else _shares(held[0] / QUICK, binomial_range(QUICK, len(PARAMETERS)))
        found.append(Case(name, _SOURCE, _FUNCTION, checks, _FURTHER_NOTE, error))
    return found


def _conditions(seed: int) -> Mapping[str, Callable[[np.random.Generator], Stated]]:
    """Stated uncertainties of each kind of session, by its name."""

    def slower(number: int) -> Callable[[np.random.Generator], Stated]:
        rng = np.random.default_rng([seed, 4, number])
        parts = [_from_records(rng, 32, _SLOWER[number]) for _ in range(_SLOWER_RECORDS // 32)]
        _, u, dof = np.concatenate(parts, axis=1)
        return lambda _rng: (u, dof)

    def stated(dof: float) -> Callable[[np.random.Generator], Stated]:
        return lambda rng: (np.sqrt(rng.chisquare(dof, _SLOWER_RECORDS) / dof), np.full(_SLOWER_RECORDS, dof))

    draws = [slower(number) for number in range(len(_SLOWER))] + [stated(dof) for dof in _STATED_DOF]
    return dict(zip(_FURTHER_NAMES, draws, strict=True))


_TITLE: Final = marked("Coverage of 95 % intervals")
_RECORDS_NAME: Final = marked("Means of autocorrelated records")
_FUNCTION: Final = "solver.calibrate.calibrate, Calibration.budget"
_NAMES: Final = {
    "least-squares": marked("Parameters by least squares"),
    "generalised": marked("Parameters by generalised least squares"),
    "paper": marked("Parameters by the paper’s iteration"),
}
_FURTHER_NAMES: Final = (
    marked("Least squares, noise correlated over 0.5 s"),
    marked("Least squares, noise correlated over 1 s"),
    marked("Least squares, u(J) of 6 degrees of freedom"),
    marked("Least squares, u(J) of 10 degrees of freedom"),
    marked("Least squares, u(J) of 20 degrees of freedom"),
)
_FURTHER_NOTE: Final = marked(
    "400 sessions, means drawn with their true variance, u(J) as records of such noise or χ² of that many degrees of "
    "freedom give it. The range is that of the eight shares together with probability 99.9 %."
)
_QUICK_NOTE: Final = marked(
    "400 sessions, means drawn with the variance that their autocorrelation says. The range is that of all "
    "shares of this method together with probability 99.9 % when each interval holds the truth with 95 %."
)
_FULL_NOTE: Final = marked(
    "4,000 sessions, each with its 32 records of 60 s at 200 Hz. The stated uncertainty of a mean errs on the safe "
    "side; the paper’s iteration, which does not weigh by it, shows that most and is given up to 97 %."
)


def variance_of_mean(time: float = _CORRELATION_TIME) -> float:
    """Variance of the mean of a record over that of its white noise's samples.

    Of n samples with autocorrelation φ^k: [(1 + φ)/(1 − φ) − 2φ(1 − φⁿ)/(n(1 − φ)²)]/n.
    """
    n, phi = _SAMPLES, _memory(time)
    correlated = (1 + phi) / (1 - phi) - 2 * phi * (1 - phi**n) / (n * (1 - phi) ** 2)
    return (1.0 + _CORRELATED_SHARE**2 * correlated) / n


def noise_records(rng: np.random.Generator, count: int, time: float = _CORRELATION_TIME) -> Array:
    """Records of noise, (count, 12,000); their means have the variance 1."""
    from scipy import signal  # slow to import, and only this study needs it

    phi = _memory(time)
    settled = round(10 * time * _RATE)
    shocks = rng.standard_normal((count, _SAMPLES + settled)) * (1 - phi**2) ** 0.5
    correlated = np.asarray(signal.lfilter([1.0], [1.0, -phi], shocks, axis=1))[:, settled:]
    correlated *= _CORRELATED_SHARE
    correlated += rng.standard_normal((count, _SAMPLES))
    correlated /= variance_of_mean(time) ** 0.5
    return correlated


def _memory(time: float) -> float:
    return float(np.exp(-1.0 / (time * _RATE)))


def _stated_of_records(progress: Progress, seed: int) -> tuple[Array, Array, Array]:
    """Means of some records in units of the true u, their standard uncertainties and degrees of freedom."""
    rng = np.random.default_rng([seed, 1])
    found: list[Array] = []
    for start in range(0, _RECORDS, 32):
        progress(0.1 * start / _RECORDS, _RECORDS_NAME)
        found.append(_from_records(rng, 32))
    means, u, dof = np.concatenate(found, axis=1)
    return means, u, dof


def _from_records(rng: np.random.Generator, count: int, time: float = _CORRELATION_TIME) -> Array:
    """Mean, its standard uncertainty and degrees of freedom of records, in units of the true u, (3, count)."""
    found = [mean_with_uncertainty(record) for record in noise_records(rng, count, time)]
    return np.array([(item.value, item.standard_uncertainty, item.dof) for item in found]).T


def _of_means(stated: tuple[Array, Array, Array]) -> Case:
    means, u, dof = stated
    held = float(np.mean(np.abs(means) <= coverage_factor(dof, LEVEL) * u))
    low, high = binomial_range(len(means), 1)
    return Case(
        _RECORDS_NAME,
        marked("Driftbook’s own: records of 60 s at 200 Hz, white noise and noise correlated over 0.1 s"),
        "solver.signals.noise.mean_with_uncertainty",
        (in_range(marked("share of intervals that hold the true mean"), LEVEL, held, low, high),),
        marked("640 records; the range is that of the share with probability 99.9 %."),
    )


def _session(rng: np.random.Generator, methods: Sequence[Method], stated: Stated | None) -> NDArray[np.bool_]:
    """Whether each interval of one session held the truth, (methods, 8)."""
    truth = _TYPE + _INDIVIDUAL * rng.standard_normal(8)
    theta, psi = (np.array([getattr(place, name) for place in _POSITIONS]) for name in ("theta", "psi"))
    angles = as_printed(_SPREAD * rng.standard_normal((len(_POSITIONS), 3)))
    certificate = certify(theta, psi, angles, u_random=_U_RANDOM, u_systematic=_U_COMMON)
    stand = Stand(_LATITUDE, certificate, seed=int(rng.integers(2**62)))
    gyro = Gyro(**dict(zip(PARAMETERS, truth.tolist(), strict=True)))
    currents = np.stack(steady_currents(Bench(gyro, stand), _POSITIONS))
    mean, u, dof = _measured(rng, currents.size, stated).reshape(3, 2, -1)
    noise = _NOISE / abs(gyro.kx)
    (jx, jy), (u_jx, u_jy) = currents + noise * mean, noise * u
    u_angle = np.full(len(_POSITIONS), _U_RANDOM)
    observations = Observations.sorted_from(
        theta=theta, psi=psi, alpha=angles[:, 0], beta=angles[:, 1], gamma=angles[:, 2],
        jx=jx, jy=jy, u_jx=u_jx, u_jy=u_jy, dof_jx=dof[0], dof_jy=dof[1],
        u_alpha=u_angle, u_beta=u_angle, u_gamma=u_angle, latitude=_LATITUDE,
    )  # fmt: skip
    common = CommonUncertainty.of(dict.fromkeys(("alpha", "beta", "gamma"), _U_COMMON))
    return np.array([_held(calibrate(observations, method, common), method, truth) for method in methods])


def _held(found: Calibration, method: Method, truth: Array) -> NDArray[np.bool_]:
    budget = found.budget(method)
    if budget is None:
        raise ValueError(f"{method} gives no uncertainty")
    return np.asarray(np.abs(found.solved[method].estimate.values - truth) <= budget.expanded)


def _measured(rng: np.random.Generator, count: int, stated: Stated | None) -> Array:
    """What `count` records give, as `_from_records`: from the records themselves, or drawn."""
    if stated is None:
        return _from_records(rng, count)
    u, dof = stated
    chosen = rng.integers(len(u), size=count)
    return np.stack((rng.standard_normal(count), u[chosen], dof[chosen]))


def _shares(shares: Array, accepted: tuple[float, float]) -> tuple[Check, ...]:
    low, high = accepted
    return tuple(
        in_range(name, LEVEL, float(share), low, high) for name, share in zip(PARAMETERS, shares, strict=True)
    )


def binomial_range(count: int, together: int) -> tuple[float, float]:
    """Range of `together` shares of `count` trials, each with 95 %: all inside with 99.9 % at least."""
    tail = _JOINT / together / 2
    fewest = np.floor(special.bdtrik(tail, count, LEVEL)) + 1
    most = count - np.floor(special.bdtrik(tail, count, 1 - LEVEL)) - 1
    return float(fewest) / count, float(most) / count
