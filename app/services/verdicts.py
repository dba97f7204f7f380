"""Whether a parameter conforms to the limits of its type.

Guard band w = U (ILAC-G8:2019, 4.2.2): inside the limits by more than U conforms, by less is
conditional, beyond fails.
"""

from collections.abc import Iterable, Mapping

from app.exchange.si import PARAMETER_UNITS
from app.services.views import COVERAGE_FACTOR, ParameterView, ResultSummary, Verdict
from app.store.tables import Calibration, CalibrationParameter

_WORST_FIRST: tuple[Verdict, ...] = ("fails", "undetermined", "conditional", "no-limit", "conforms")


def coverage_factor(row: CalibrationParameter) -> float:
    """K of a stored parameter; a result of solver 1.0.0 has none of its own."""
    return row.coverage_factor or COVERAGE_FACTOR


def judge(
    value: float | None, u: float | None, low: float | None, high: float | None, k: float = COVERAGE_FACTOR
) -> Verdict:
    """Judge one value against its limits.

    Without an uncertainty a value inside its limits is conditional: nobody knows how far inside.
    """
    if value is None:
        return "undetermined"
    if low is None or high is None:
        return "no-limit"
    if not low <= value <= high:
        return "fails"
    guard = k * u if u is not None else float("inf")
    return "conforms" if low + guard <= value <= high - guard else "conditional"


def worst(verdicts: Iterable[Verdict]) -> Verdict:
    """The verdict on all of them together; ``no-limit`` only when none has a limit."""
    found = set(verdicts)
    if "conforms" in found:
        found.discard("no-limit")
    return next(verdict for verdict in _WORST_FIRST if verdict in found)


def main_method(calibration: Calibration) -> str:
    """The method whose values stand for the result: least squares where both were asked for."""
    return "least-squares" if calibration.method == "both" else calibration.method


def summary(calibration: Calibration) -> ResultSummary:
    """A result in one line."""
    kind = calibration.session.gyro.type
    limits = {limit.parameter: (limit.low, limit.high) for limit in kind.limits}
    parameters = parameter_views(calibration, main_method(calibration), limits)
    verdict = worst(view.verdict for view in parameters.values())
    offending = tuple(
        name
        for name, view in parameters.items()
        if view.verdict == verdict and verdict in ("fails", "conditional", "undetermined")
    )
    return ResultSummary(
        id=calibration.id,
        revision=calibration.revision,
        method=calibration.method,
        solved_at=calibration.created_at,
        verdict=verdict,
        offending=offending,
        parameters=parameters,
    )


def parameter_views(
    calibration: Calibration, method: str, limits: Mapping[str, tuple[float, float]]
) -> dict[str, ParameterView]:
    """One method's parameters with limits and verdicts, in the order they were stored."""
    views = {}
    for row in calibration.parameters:
        if row.method != method:
            continue
        low, high = limits.get(row.parameter, (None, None))
        k = coverage_factor(row)
        views[row.parameter] = ParameterView(
            name=row.parameter,
            value=row.value,
            u=row.standard_uncertainty,
            k=k,
            unit=PARAMETER_UNITS[row.parameter][0],
            low=low,
            high=high,
            verdict=judge(row.value, row.standard_uncertainty, low, high, k),
        )
    return views
