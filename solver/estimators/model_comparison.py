"""Do the data support more than the eight parameters? Optional terms, each tested and all together.

Each candidate adds one column to the observation equations (`solver.estimators.terms`).

Test
    On equations whitened by the covariance of all inputs (u(J) given) or as they are, with Δχ² what k further
    columns take away from the sum of squares χ² that the full model of ν degrees of freedom leaves,

        F = (Δχ²/k)/(χ²/ν)

    follows Fisher's distribution with k and ν degrees of freedom if the terms are zero (for one term F = t²).
    It asks only that the *ratios* of the uncertainties are right: noise larger than stated does not
    support a term. With given uncertainties Δχ² itself, χ² distributed with k degrees of freedom,
    stands beside it.

Which terms
    Forward selection: of the terms not yet taken, the one with the smallest p joins the model if p is
    below the level over the number of terms still to choose from; then all are tested anew beside it. These are
    Holm's steps (S. Holm, Scand. J. Statist. 6, 1979, 65-70): where no term is real, one is named in at most
    1 % of the sessions, however many are tested. Each term's own test is also given with Holm's adjusted p.

Not testable
    A term that the positions do not determine: its column is a combination of the others, or its
    standard uncertainty would exceed a tenth of the Earth rate, or with it a direction of K would no longer stand
    out from the currents' noise (`solver.estimators.observability`).
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import special

from solver.constants import EARTH_RATE
from solver.error_model import Equations
from solver.errors import Message
from solver.estimators.observability import Invisible, natural_scale, visible_from
from solver.estimators.rate_noise import Problem, inverse_scale, invisible_in, root_inverse, rough
from solver.estimators.terms import SYMBOLS, TERMS, Term, term_columns
from solver.inputs import CommonUncertainty
from solver.records import Array, Observations

LEVEL: Final = 0.01
"""Probability of naming any term in a session whose gyro has none."""
_ROUNDS: Final = 2
_ROUNDING: Final = 1e-10
_VAGUE: Final = 0.1
_NOTHING: Final = 1e-12


@dataclass(frozen=True, slots=True)
class TermTest:
    """One term beside the eight parameters, or several jointly.

    Attributes
    ----------
    terms : tuple of str
        Members of `TERMS`.
    values, standard_uncertainties : (k,) array
        Of the terms, rad/s (per g or g²); the drifts over the whole session. NaN where not testable.
    f, p_value : float or None
        F and the probability of a larger one if the terms are zero; None where not testable.
    p_holm : float or None
        The same, adjusted for all the single tests; None for the joint test.
    delta_chi2, p_chi2 : float or None
        Δχ² and its p, with given uncertainties.
    dof : int
        ν of the full model.
    reason : Message or None
        Why the test is not possible.
    """

    terms: tuple[Term, ...]
    values: Array
    standard_uncertainties: Array
    f: float | None
    p_value: float | None
    p_holm: float | None
    delta_chi2: float | None
    p_chi2: float | None
    dof: int
    reason: Message | None


@dataclass(frozen=True, slots=True)
class ModelComparison:
    """What further terms the data support.

    Attributes
    ----------
    level : float
        Of all the tests together.
    tests : tuple of TermTest
        One for each of `TERMS`, by itself.
    joint : TermTest
        All testable terms together.
    supported : tuple of str
        Chosen by forward selection, in the order of choice.
    chosen : TermTest or None
        The supported terms together: their values in one model.
    time_assumed : bool
        Whether the positions are taken as measured one after the other at equal times.
    duration : float
        From the first position's time to the last one's, s, over which the drifts count; NaN where assumed.
    verdict : Message
        In words.
    """

    level: float
    tests: tuple[TermTest, ...]
    joint: TermTest
    supported: tuple[Term, ...]
    chosen: TermTest | None
    time_assumed: bool
    duration: float
    verdict: Message


def compare_models(
    equations: Equations,
    observations: Observations,
    common: CommonUncertainty | None = None,
    level: float = LEVEL,
) -> ModelComparison:
    """Test the optional terms.

    Parameters
    ----------
    equations, observations, common
        As for `solver.estimators.generalised.generalised`; without u(J) all equations count alike.
    level : float
        Probability of naming any term where there is none.
    """
    base = _Base.of(equations, observations, common)
    columns, time_assumed = term_columns(observations)
    reasons = {term: base.not_testable(columns[term]) for term in TERMS}
    testable = tuple(term for term in TERMS if reasons[term] is None)
    single = [base.test((term,), columns, reasons[term]) for term in TERMS]
    adjusted = holm([one.p_value for one in single if one.p_value is not None])
    numbers = iter(adjusted)
    tests = tuple(_with_holm(one, None if one.p_value is None else next(numbers)) for one in single)
    joint = base.test(testable, columns, None if testable else _nothing_testable())
    supported = () if base.only_rounding else _forward(base, columns, testable, level)
    chosen = base.test(supported, columns, None) if supported else None
    verdict = _verdict(supported, testable)
    duration = float(np.ptp(observations.time)) if len(observations) else np.nan
    return ModelComparison(level, tests, joint, supported, chosen, time_assumed, duration, verdict)


def holm(p_values: list[float]) -> list[float]:
    """Adjusted p of several tests by Holm's step-down procedure, in their order."""
    adjusted, largest = [1.0] * len(p_values), 0.0
    for step, index in enumerate(np.argsort(p_values, kind="stable")):
        largest = max(largest, min(1.0, (len(p_values) - step) * p_values[index]))
        adjusted[index] = largest
    return adjusted


@dataclass(frozen=True, slots=True)
class _Base:
    """The model of eight on whitened equations.

    `whitening` is None for equal weights; `span` (2n, r) is an orthonormal basis of its columns, `rest` (2n,) what
    they leave of the right side, `noise` (n, 2) that of the currents, A.
    """

    equations: Equations
    whitening: Array | None
    span: Array
    rest: Array
    noise: Array

    @classmethod
    def of(
        cls, equations: Equations, observations: Observations, common: CommonUncertainty | None
    ) -> "_Base":
        problem = Problem(equations, observations, common)
        invisible = invisible_in(problem)
        whitening = _whitening(problem, invisible)
        design, right_side = equations.design, equations.right_side
        if whitening is not None:
            design, right_side = whitening @ design, whitening @ right_side
        u, s, _ = np.linalg.svd(design / natural_scale(design), full_matrices=False)
        rank = min(8 - len(invisible.directions), int(np.sum(s > _ROUNDING * s[0])))
        span = u[:, :rank]
        return cls(equations, whitening, span, right_side - span @ (span.T @ right_side), invisible.noise)

    @property
    def only_rounding(self) -> bool:
        """Whether the residuals are rounding alone, whose pattern says nothing."""
        if self.whitening is not None:
            return False
        return bool(np.linalg.norm(self.rest) <= _NOTHING * np.linalg.norm(self.equations.right_side))

    def whiten(self, columns: Array) -> Array:
        """Columns as the equations are weighted."""
        return columns if self.whitening is None else self.whitening @ columns

    def not_testable(self, column: Array) -> Message | None:
        """Why one term by itself cannot be tested, or None."""
        whitened = self.whiten(column)
        dof = len(column) - self.span.shape[1] - 1
        if dof < 1:
            return _no_freedom()
        left = whitened - self.span @ (self.span.T @ whitened)
        square = float(left @ left)
        if not np.sqrt(square) > _ROUNDING * max(float(np.linalg.norm(whitened)), np.finfo(float).tiny):
            return _invisible()
        rest = self.rest - left * float(left @ self.rest) / square
        variance = 1.0 if self.whitening is not None else float(rest @ rest) / dof
        if variance > (_VAGUE * EARTH_RATE) ** 2 * square or self._hides_scale(column):
            return _invisible()
        return None

    def _hides_scale(self, column: Array) -> bool:
        """Whether, with this term, noise of the currents could make up for a change of K."""
        if not self.noise.any():
            return False
        design = self.equations.design
        exact = np.column_stack((design[:, 4:], column))
        exact /= np.maximum(np.linalg.norm(exact, axis=0), np.finfo(float).tiny)
        currents = design[:, :4] - exact @ np.linalg.lstsq(exact, design[:, :4])[0]
        x, y = np.sum(self.noise**2, axis=0)
        seen = np.linalg.svd(currents / np.sqrt([x, y, y, x]), compute_uv=False)
        return bool(seen[-1] < visible_from(len(column)))

    def test(self, terms: tuple[Term, ...], columns: dict[Term, Array], reason: Message | None) -> TermTest:
        """Test terms jointly beside the eight parameters."""
        count = len(terms)
        dof = len(self.rest) - self.span.shape[1] - count
        if reason is None and dof < 1:
            reason = _no_freedom()
        if reason is not None:
            blank = np.full(count, np.nan)
            return TermTest(terms, blank, blank, None, None, None, None, None, max(dof, 0), reason)
        extra = self.whiten(np.column_stack([columns[term] for term in terms]))
        extra = extra - self.span @ (self.span.T @ extra)
        lengths = np.linalg.norm(extra, axis=0)
        q, r = np.linalg.qr(extra / lengths)
        if np.abs(np.diagonal(r)).min() < _ROUNDING:
            blank = np.full(count, np.nan)
            return TermTest(terms, blank, blank, None, None, None, None, None, dof, _invisible())
        part = q.T @ self.rest
        root = np.linalg.inv(r) / lengths[:, None]
        left = self.rest - q @ part
        chi2, taken = float(left @ left), float(part @ part)
        given = self.whitening is not None
        variance = 1.0 if given else chi2 / dof
        f = (taken / count) / (chi2 / dof) if chi2 > 0 else np.inf
        return TermTest(
            terms=terms,
            values=root @ part,
            standard_uncertainties=np.sqrt(variance * np.sum(root**2, axis=1)),
            f=float(f),
            p_value=float(special.fdtrc(count, dof, f)),
            p_holm=None,
            delta_chi2=taken if given else None,
            p_chi2=float(special.chdtrc(count, taken)) if given else None,
            dof=dof,
            reason=None,
        )


def _whitening(problem: Problem, invisible: Invisible) -> Array | None:
    """L⁻¹ of all stated inputs at the generalised estimate; None without u(J) or without K."""
    equations = problem.equations
    design, right_side, whitening = equations.design, equations.right_side, None
    if equations.u_currents is None or invisible.parameters[:4].any():
        return None
    for _ in range(_ROUNDS):
        values = rough(design, right_side, invisible)
        if inverse_scale(values) is None:
            break
        whitening = root_inverse(problem.inputs(values).residual_covariance)
        design, right_side = whitening @ equations.design, whitening @ equations.right_side
    return whitening


def _forward(
    base: _Base, columns: dict[Term, Array], testable: tuple[Term, ...], level: float
) -> tuple[Term, ...]:
    """Terms chosen one after the other."""
    chosen: tuple[Term, ...] = ()
    open_terms = list(testable)
    while open_terms:
        tests = {term: _beside(base, columns, chosen, term) for term in open_terms}
        best = min(open_terms, key=lambda term: tests[term])
        if not tests[best] < level / len(open_terms):
            break
        chosen = (*chosen, best)
        open_terms.remove(best)
    return chosen


def _beside(base: _Base, columns: dict[Term, Array], chosen: tuple[Term, ...], term: Term) -> float:
    """P of one term beside those already chosen; 1 where it cannot be told from them."""
    full = base.test((*chosen, term), columns, None)
    if full.f is None:
        return 1.0
    if not chosen:
        return float(special.fdtrc(1, full.dof, full.f))
    t = full.values[-1] / full.standard_uncertainties[-1]
    scale = 1.0
    if base.whitening is not None:  # t by the full model's own scatter, as F is
        left = float(base.rest @ base.rest) - (full.delta_chi2 or 0.0)
        scale = left / full.dof
    return float(special.fdtrc(1, full.dof, t * t / scale))


def _with_holm(test: TermTest, p_holm: float | None) -> TermTest:
    values = {name: getattr(test, name) for name in TermTest.__dataclass_fields__}
    return TermTest(**{**values, "p_holm": p_holm})


def _invisible() -> Message:
    return Message(
        "term-unobservable",
        "These positions do not show this term: its effect is the same as that of other parameters, or smaller "
        "than the noise. Measure positions with other θ and ψ, at other times.",
    )


def _no_freedom() -> Message:
    return Message(
        "term-no-freedom", "No equation is left over to judge a further term by. Measure more positions."
    )


def _nothing_testable() -> Message:
    return Message("term-none", "None of the terms can be tested with these positions.")


def _verdict(supported: tuple[Term, ...], testable: tuple[Term, ...]) -> Message:
    if not testable:
        return _nothing_testable()
    if not supported:
        return Message("no-further-term", "The data support no further term.")
    return Message(
        "further-terms",
        "The data support %(terms)s beside the eight parameters.",
        {"terms": ", ".join(SYMBOLS[term] for term in supported)},
    )
