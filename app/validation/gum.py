"""Examples of the GUM's annex H and Student's t of its table G.2, to the printed digits."""

from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np

from app.i18n import marked
from app.validation.numbers import load
from app.validation.report import Check, Group, Progress, as_printed, attempt, in_range
from solver.least_squares import solve
from solver.propagation.uncertainty import coverage_factor, propagate
from solver.records import Array
from solver.variance_components import from_summaries

_TITLE: Final = marked("GUM: uncertainty to first order")
_ROUNDED_ON_THE_WAY: Final = 1.0
"""Tolerance, in units of the last place, where the GUM goes on with values that it has rounded."""
_PAIRS: Final = ((0, 1), (0, 2), (1, 2))


def group(progress: Progress) -> Group:
    """Compute every example."""
    data = load("gum")
    progress(0.0, _TITLE)
    cases = (
        attempt(
            marked("H.1: end gauge, effective degrees of freedom"),
            marked("JCGM 100:2008 (GUM), H.1.5 and H.1.6: table H.1 and eq. (G.2b); https://www.bipm.org/en/committees/jc/jcgm/publications"),
            "solver.propagation.uncertainty.propagate", lambda: _end_gauge(data["h1"]),
        ),
        attempt(
            marked("H.2: resistance and reactance measured at once, correlated"),
            marked("JCGM 100:2008 (GUM), H.2, tables H.2 and H.3; https://www.bipm.org/en/committees/jc/jcgm/publications"),
            "solver.propagation.uncertainty.propagate", lambda: _impedance(data["h2"]),
            marked("The GUM goes on with rounded values; without that u(X) is 0.2956 Ω: a unit of the last place."),
        ),
        attempt(
            marked("H.3: calibration of a thermometer, line with correlated coefficients"),
            marked("JCGM 100:2008 (GUM), H.3, table H.6; https://www.bipm.org/en/committees/jc/jcgm/publications"),
            "solver.least_squares.solve, solver.propagation.uncertainty.propagate", lambda: _thermometer(data["h3"]),
        ),
        attempt(
            marked("H.5: Zener voltage standard, analysis of variance"),
            marked("JCGM 100:2008 (GUM), H.5, table H.9; https://www.bipm.org/en/committees/jc/jcgm/publications"),
            "solver.variance_components.from_summaries", lambda: _zener(data["h5"]),
            marked("F of the GUM is of rounded deviations, 5·57²/85² = 2.248; without rounding it is 2.262."),
        ),
        attempt(
            marked("Student’s t, table G.2"),
            marked("JCGM 100:2008 (GUM), table G.2; https://www.bipm.org/en/committees/jc/jcgm/publications"),
            "solver.propagation.uncertainty.coverage_factor", lambda: _student(data["g2"]),
        ),
    )  # fmt: skip
    return Group("gum", _TITLE, cases)


def _end_gauge(data: Mapping[str, Any]) -> Iterator[Check]:
    components = np.array(data["components"], dtype=np.float64)
    found = propagate(np.ones(len(components)), np.diag(components**2), data["dof"])
    yield as_printed("u(l)", data["u"], found.standard_uncertainties[0], "nm")
    yield as_printed("ν_eff(l)", data["dof_effective"], found.dof[0], last_place=_ROUNDED_ON_THE_WAY)
    k = float(coverage_factor(int(found.dof[0]), 0.99))
    yield as_printed("k, 99 %", data["k99"], k)
    yield as_printed("U₉₉(l)", data["U99"], k * round(float(found.standard_uncertainties[0])), "nm")


def _impedance(data: Mapping[str, Any]) -> Iterator[Check]:
    observed = np.array([data["voltage_v"], data["current_ma"], data["phase_rad"]])
    voltage, current_ma, phase = mean = observed.mean(axis=1)
    covariance = np.cov(observed) / observed.shape[1]
    dof = np.full(3, observed.shape[1] - 1.0)
    inputs = propagate(np.eye(3), covariance, dof)
    for index, (name, unit) in enumerate((("u(V)", "V"), ("u(I)", "mA"), ("u(φ)", "rad"))):
        yield as_printed(name, data["u"][index], inputs.standard_uncertainties[index], unit)
    for (i, j), name, printed in zip(_PAIRS, ("r(V, I)", "r(V, φ)", "r(I, φ)"), data["r"], strict=True):
        yield as_printed(name, printed, inputs.correlation[i, j])
    z = voltage / current_ma * 1e3
    values = z * np.array([np.cos(phase), np.sin(phase), 1.0])
    by_phase = z * np.array([-np.sin(phase), np.cos(phase), 0.0])
    sensitivity = np.column_stack((values / mean[0], -values / mean[1], by_phase))
    found = propagate(sensitivity, covariance, dof)
    for index, name in enumerate("RXZ"):
        yield as_printed(name, data["values"][index], values[index], "Ω")
        yield as_printed(
            f"u({name})",
            data["u_values"][index],
            found.standard_uncertainties[index],
            "Ω",
            _ROUNDED_ON_THE_WAY,
        )
    for (i, j), name, printed in zip(
        _PAIRS, ("r(R, X)", "r(R, Z)", "r(X, Z)"), data["r_values"], strict=True
    ):
        yield as_printed(name, printed, found.correlation[i, j])
    yield in_range("ν_eff(R)", 4, found.dof[0], 4 - 1e-9, 4 + 1e-9)


def _thermometer(data: Mapping[str, Any]) -> Iterator[Check]:
    t, b = np.array(data["temperature_c"]), np.array(data["correction_c"])
    values, covariance, s = _line(t - 20.0, b)
    found = propagate(np.eye(2), covariance)
    yield as_printed("y₁", data["y1"], values[0], "°C")
    yield as_printed("u(y₁)", data["u_y1"], found.standard_uncertainties[0], "°C")
    yield as_printed("y₂", data["y2"], values[1])
    yield as_printed("u(y₂)", data["u_y2"], found.standard_uncertainties[1])
    yield as_printed("r(y₁, y₂)", data["r"], found.correlation[0, 1])
    yield as_printed("s(b)", data["s"], s, "°C")
    for number, printed in enumerate(data["predicted_c"]):
        yield as_printed(f"b(t{number + 1})", printed, values[0] + values[1] * (t[number] - 20.0), "°C")
    at_30 = propagate([1.0, 10.0], covariance, np.full(2, len(t) - 2.0))
    yield as_printed("b(30 °C)", data["at_30"], values[0] + 10.0 * values[1], "°C")
    yield as_printed("u(b(30 °C))", data["u_at_30"], at_30.standard_uncertainties[0], "°C")
    yield in_range("ν(b(30 °C))", 9, at_30.dof[0], 9 - 1e-9, 9 + 1e-9)
    values, covariance, _ = _line(t - t.mean(), b)
    centred = propagate(np.eye(2), covariance)
    yield as_printed("y₁′", data["y1_centred"], values[0], "°C")
    yield as_printed("u(y₁′)", data["u_y1_centred"], centred.standard_uncertainties[0], "°C")
    yield in_range("r(y₁′, y₂′)", 0.0, centred.correlation[0, 1], -1e-9, 1e-9)


def _line(x: Array, y: Array) -> tuple[Array, Array, float]:
    design = np.column_stack((np.ones(len(x)), x))
    solution = solve(design, y)
    rest = y - design @ solution.values
    variance = float(rest @ rest) / (len(y) - 2)
    return solution.values, variance * solution.covariance, variance**0.5


def _zener(data: Mapping[str, Any]) -> Iterator[Check]:
    found = from_summaries(data["mean_uv_above_10_v"], data["deviation_uv"], data["repeats"])
    yield as_printed("V̄ − 10 V", data["mean"], found.mean, "µV")
    yield as_printed("s_a", data["s_a"], found.mean_square_between**0.5, "µV")
    yield as_printed("s_b", data["s_b"], found.mean_square_within**0.5, "µV")
    yield as_printed("F", data["f"], found.f, last_place=1.5)
    yield as_printed("s_B", data["s_between"], found.variance_between**0.5, "µV")
    yield as_printed("u(V̄)", data["u_mean"], found.u_mean, "µV")
    yield as_printed("u(V̄)", data["u_pooled"], found.u_mean_pooled, "µV", detail=marked("days alike"))
    # F lies between F₀.₉₅(9, 40) = 2.12 and F₀.₉₇₅(9, 40) = 2.45
    yield in_range("p(F)", "0.037", found.p_value, 0.025, 0.05)


def _student(data: Mapping[str, Any]) -> Iterator[Check]:
    for level in ("95", "99"):
        for dof, printed in zip(data["dof"], data[level], strict=True):
            k = float(coverage_factor(dof, float(level) / 100))
            yield as_printed(f"t(ν = {dof}), {level} %", printed, k)
        normal = float(coverage_factor(np.inf, float(level) / 100))
        yield as_printed(f"t(ν = ∞), {level} %", data["normal"][level], normal)
