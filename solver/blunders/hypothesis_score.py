"""One number for every hypothesis, and whether it is significant by itself.

See `solver.blunders.diagnosis` for the objective. `Session` holds what all hypotheses share, `Score` what one of
them comes to.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import special

from solver.blunders.current_model import CurrentModel, Solutions, regressors
from solver.blunders.hypotheses import Hypothesis
from solver.blunders.hypothesis_fit import UNTOLD, Data, Fitted, fit, other_inputs, rough
from solver.blunders.prior import Prior
from solver.constants import EARTH_RATE
from solver.current_noise import current_noise
from solver.error_model import observation_equations
from solver.estimators.estimation import least_squares
from solver.inputs import CommonUncertainty
from solver.records import Array, Observations

LEVEL: Final = 1e-3
"""False alarms of outlier and warm-up each, over all their members."""
DISCRETE_LEVEL: Final = 2e-4
"""The same for each kind without a free unknown that merely changes rows."""
OCCAM: Final = 10.0
"""2·ln(range/u) of a free unknown: anything up to 150 u is as likely; a larger one, of δ, costs 2·ln(δ/u)."""
REPETITION: Final = 25.0
"""Fall of χ² that a stuck or saturated channel must explain: the noise of two readings gives that once in 1e5."""
CLEAR_RATIO: Final = 40.0
"""ν·ln of the fall of s² that is asked where χ² stays improbable (with ν = 24, five times)."""
UNTOLD_RATIO: Final = 25.0
"""The same where no noise is stated (three times: a second blunder as large leaves half)."""
DOUBT: Final = 1e-3
"""Probability of χ² below which the stated noise is no longer trusted for tests."""
LEAST_FREEDOM: Final = 3
"""Left over with a blunder taken out, to estimate the noise where it is not stated."""
_ROUNDING: Final = 1e-10


@dataclass(frozen=True, slots=True)
class Sum:
    """A sum of squares, without u(J) in units of no meaning, with its degrees of freedom."""

    squares: float
    dof: int

    @property
    def variance(self) -> float:
        """Mean square; the sum itself where no freedom is left."""
        return self.squares / max(self.dof, 1)


@dataclass(frozen=True, slots=True)
class Score:
    """What one hypothesis comes to.

    Attributes
    ----------
    hypothesis
        None for good data.
    fitted
        None where the scale factors do not show.
    rates
        Of the eight parameters' fit; None without it.
    currents
        Of `CurrentModel`, which has two unknowns more.
    distance
        D² from the prior; None without prior or fit.
    """

    hypothesis: Hypothesis | None
    fitted: Fitted | None
    rates: Sum | None
    currents: Sum
    distance: float | None = None

    @property
    def best(self) -> Sum:
        """The eight parameters' where there is one."""
        return self.rates or self.currents

    @property
    def scatter(self) -> float:
        """Without u(J): the residuals' standard deviation, of the rates relative to the Earth's, or of the currents."""
        return float(np.sqrt(self.best.variance)) * (1.0 if self.rates is None else UNTOLD / EARTH_RATE)


@dataclass(slots=True)
class Session:
    """What the hypotheses of one session share.

    Attributes
    ----------
    x : (n, 5) array
        Regressors.
    u : (n, 2) array
        Of the currents, A; without u(J) their size.
    others : (2n, 2n) array or None
        V' of `solver.blunders.hypothesis_fit`.
    told
        Whether u(J) is given.
    good
        Of the data as given.
    rest : (n, 2) array
        Residuals of the currents in `model`.
    visible
        Whether the scale factors show in the data as given.
    """

    observations: Observations
    common: CommonUncertainty | None
    prior: Prior | None
    x: Array
    model: CurrentModel
    u: Array
    others: Array | None
    told: bool
    good: Score
    rest: Array
    visible: bool
    by_currents: bool = False
    """Compare all by `CurrentModel`, because what explains the data leaves the scale factors undetermined."""

    @classmethod
    def of(
        cls, observations: Observations, common: CommonUncertainty | None, prior: Prior | None
    ) -> "Session":
        """Fit the data as given."""
        at = observations
        noise = current_noise(at)
        told = noise is not None
        x = regressors(at)
        currents = np.stack((at.jx, at.jy), axis=1)
        if noise is not None:
            least = np.finfo(float).eps * float(np.abs(currents).max()) or 1.0
            u = np.maximum(noise.u, least)  # less than rounding means nothing
        else:  # each channel in units of its size
            square = np.sqrt(np.mean(currents**2, axis=0))
            u = np.tile(np.where(square > 0, square, 1.0), (len(at), 1))
        model = CurrentModel.of(x, currents, 1.0 / u**2)
        solutions = model.solve(x[None], currents[None], model.weights[None], told=told)
        start, visible = solutions.start[0], bool(np.isfinite(solutions.start[0, 0]))
        others = other_inputs(at, start, common) if told and visible else None
        score = Score(None, None, None, Sum(float(solutions.squares[0]), int(solutions.dof[0])))
        session = cls(
            observations, common, prior, x, model, u, others, told, score, solutions.rest[0], visible
        )
        session.good = session.scores([None], solutions)[0]
        return session

    def scores(
        self, hypotheses: Sequence[Hypothesis | None], solutions: Solutions | None = None
    ) -> list[Score]:
        """Fit hypotheses; None is good data. `solutions`: their fits of `model`, where they are there."""
        if not hypotheses:
            return []
        count, n = len(hypotheses), len(self.x)
        x = np.stack([self.x if h is None or h.x is None else h.x for h in hypotheses])
        own = np.arange(n)
        order = np.stack([own if h is None or h.order is None else h.order for h in hypotheses])
        missing = np.zeros((count, n, 2), dtype=np.bool_)
        course = np.zeros((count, n))
        for index, hypothesis in enumerate(hypotheses):
            if hypothesis is not None and hypothesis.missing is not None:
                missing[index] = hypothesis.missing
            if hypothesis is not None and hypothesis.course is not None:
                course[index] = hypothesis.course
        currents, u = self.model.currents[order], self.u[order]
        weights = np.where(missing, 0.0, 1.0 / u**2)
        solutions = solutions or self.model.solve(x, currents, weights, told=self.told)
        fits: list[Fitted | None] = [None] * count
        start = solutions.start
        unable = np.isnan(start[:, 0])
        if self.visible and unable.any():
            told_u = u[unable] if self.told else None
            start[unable] = rough(Data(x[unable], currents[unable], told_u, missing[unable], course[unable]))
        able = np.flatnonzero(np.isfinite(start[:, 0]))
        for part in (able[~missing[able].any(axis=(1, 2))], able[missing[able].any(axis=(1, 2))]):
            if len(part):
                data = Data(
                    x[part], currents[part], u[part] if self.told else None, missing[part], course[part]
                )
                for index, fitted in zip(part, fit(data, start[part], self.others), strict=True):
                    fits[index] = fitted
        return [
            self._score(h, f, float(solutions.squares[i]), int(solutions.dof[i]))
            for i, (h, f) in enumerate(zip(hypotheses, fits, strict=True))
        ]

    def _score(self, hypothesis: Hypothesis | None, fitted: Fitted | None, squares: float, dof: int) -> Score:
        """Add what a repeated reading is expected to scatter."""
        scatter, count = 0.0, 0
        weight = by_currents = 0.0
        if hypothesis is not None and hypothesis.repeated is not None and np.ptp(hypothesis.repeated):
            values, channel = hypothesis.repeated, "xy".index(hypothesis.details["channel"])
            scatter, count = float(np.sum((values - values.mean()) ** 2)), len(values) - 1
            weight = by_currents = float(self.model.weights[:, channel].max())
            if fitted is not None and not self.told:
                weight = float(fitted.values[channel] / UNTOLD) ** 2
        rates = None if fitted is None else Sum(fitted.squares + scatter * weight, fitted.dof + count)
        currents = Sum(squares + scatter * by_currents, dof + count)
        return Score(hypothesis, fitted, rates, currents, self._distance(fitted))

    def reported(self) -> float:
        """χ² of the data as given, as a result by least squares states it.

        With grossly wrong data the weights, by which χ² is judged, depend on where their iteration begins.
        """
        if self.good.rates is None or not self.told:
            return self.good.best.squares
        equations = observation_equations(self.observations)
        chi2 = least_squares(equations, self.observations, self.common).estimate.fit.chi2
        return self.good.rates.squares if chi2 is None else chi2

    def comparable(self, score: Score) -> tuple[Sum, Sum]:
        """Sums of good data and of a hypothesis in one and the same kind of fit."""
        if self.by_currents or score.rates is None or self.good.rates is None:
            return self.good.currents, score.currents
        return self.good.rates, score.rates

    def fall(self, score: Score) -> float:
        """By how much the misfit falls: χ², or without u(J) ν·ln s²."""
        good, other = self.comparable(score)
        return good.squares - other.squares if self.told else self._ratio(good, other)

    def _ratio(self, good: Sum, other: Sum) -> float:
        if good.dof < 1:
            return 0.0
        return good.dof * float(np.log((good.variance + self._rounding) / (other.variance + self._rounding)))

    @property
    def _rounding(self) -> float:
        """Mean square that says nothing: rounding of the currents."""
        return _ROUNDING**2 * float(np.sum(self.model.weights * self.model.currents**2))

    def nearer(self, score: Score) -> float:
        """By how much D² falls, as it counts (`Prior.cost`)."""
        if self.prior is None or self.good.distance is None or score.distance is None:
            return 0.0
        return self.prior.cost(self.good.distance) - self.prior.cost(score.distance)

    def total(self, score: Score) -> float:
        """T, by which hypotheses are ranked, beside that of good data."""
        assert score.hypothesis is not None
        occam = 2.0 * float(np.log(score.hypothesis.members)) + self._free(score)
        return occam - self.fall(score) - self.nearer(score)

    def _free(self, score: Score) -> float:
        """Occam's price of the free unknowns, by the size that they take."""
        free = score.hypothesis.free if score.hypothesis is not None else 0
        if not free:
            return 0.0
        good, other = self.comparable(score)
        unit = 1.0 if self.told else max(other.variance, _ROUNDING**2 * good.squares, np.finfo(float).tiny)
        return free * max(OCCAM, float(np.log(max(good.squares - other.squares, unit) / (free * unit))))

    def _distance(self, fitted: Fitted | None) -> float | None:
        if self.prior is None or fitted is None:
            return None
        return self.prior.distance(fitted.values, self.covariance(fitted), fitted.known)[0]

    def covariance(self, fitted: Fitted) -> Array:
        """Of a fit; without u(J) from its residuals."""
        if self.told:
            return fitted.covariance
        return fitted.covariance * (fitted.squares / max(fitted.dof, 1))

    def improbable(self, score: Score, level: float) -> bool:
        """Whether its χ² is too large for the stated noise."""
        best = score.best
        return self.told and best.dof > 0 and bool(special.chdtrc(best.dof, best.squares) < level)

    def gain(self, score: Score) -> float:
        """The fall as a test takes it: against the noise that is left where that is more than stated."""
        fall = self.fall(score)
        return self._ratio(*self.comparable(score)) if fall > 0 and self.improbable(score, DOUBT) else fall

    def significant(self, score: Score) -> bool:
        """Whether good data would hardly ever look as much better under this hypothesis."""
        hypothesis = score.hypothesis
        if hypothesis is None or self.comparable(score)[1].dof < (0 if self.told else LEAST_FREEDOM):
            return False
        if not self.told and self.comparable(score)[0].variance <= self._rounding:
            return False
        gain, doubtful = self.gain(score), not self.told or self.improbable(score, DOUBT)
        if hypothesis.repeated is not None:
            return gain > (
                REPETITION if self.told and not doubtful else CLEAR_RATIO if self.told else UNTOLD_RATIO
            )
        if hypothesis.free:
            clear = not doubtful or not self.told or gain > CLEAR_RATIO
            return clear and self._by_chance(score, doubtful) * hypothesis.members < LEVEL
        if doubtful:
            return gain > (CLEAR_RATIO if self.told else UNTOLD_RATIO)
        return gain > discrete_threshold(hypothesis.members)

    def _by_chance(self, score: Score, doubtful: bool) -> float:
        """Probability that free unknowns alone improve the fit of good data as much."""
        assert score.hypothesis is not None
        free = score.hypothesis.free
        good, other = self.comparable(score)
        fall = max(good.squares - other.squares, 0.0)
        if not doubtful:
            return float(special.chdtrc(free, fall))
        if other.dof < 1:
            return 1.0
        return float(special.fdtrc(free, other.dof, (fall / free) / other.variance)) if other.squares else 0.0


def discrete_threshold(members: int) -> float:
    """Fall of χ² which a change without free unknowns gives, at most, by chance at `DISCRETE_LEVEL`.

    A change that moves the predictions by δ standard deviations makes χ² of good data fall by
    2·z·δ − δ², never more than z².
    """
    return float(special.ndtri(DISCRETE_LEVEL / members)) ** 2
