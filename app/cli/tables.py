"""A result as a table in a terminal."""

from collections.abc import Iterator, Mapping
from typing import Any

import typer
from rich.console import Console
from rich.table import Table

from app.exchange.limits import SOURCE_NAMES
from app.exchange.uncertainties import UNCERTAINTY_KEYS
from app.figures import decimals_of, rounded
from solver.inputs import SOURCES

_NAMES = {
    "kx": "Kx  scale factor, x", "ky": "Ky  scale factor, y", "kxy": "Kxy cross-coupling, y into x",
    "kyx": "Kyx cross-coupling, x into y", "w0x": "ω0x fixed drift, x", "w0y": "ω0y fixed drift, y",
    "wg": "ωg  g-drift, direct", "wk": "ωк  g-drift, quadrature",
}  # fmt: skip


def print_result(name: str, result: Mapping[str, Any]) -> None:
    """Print a result: parameters with U, the fit, what dominates U, what was found and tested, warnings."""
    console = Console(highlight=False)
    methods = ("least-squares", "paper") if result["method"] == "both" else (result["method"],)
    answers = {method: result[method] if result["method"] == "both" else result for method in methods}
    table = Table(title=name, title_justify="left", box=None, pad_edge=False)
    table.add_column("parameter")
    for method in methods:
        table.add_column(method, justify="right")
        table.add_column("± U", justify="right")
    table.add_column("unit")
    for key, label in _NAMES.items():
        cells = [cell for method in methods for cell in _cells(answers[method], key)]
        table.add_row(label, *cells, _unit(key))
    console.print(table)
    for method in methods:
        console.print(_fit_line(method, answers[method]), soft_wrap=True)
        for line in _limits(answers[method]):
            console.print(f"  {line}", soft_wrap=True)
    exact = taken_as_exact(result)
    if exact:
        console.print(f"taken as exact, for nothing is stated: {', '.join(exact)}", soft_wrap=True)
    for line in _findings(answers[methods[0]]):
        console.print(line, soft_wrap=True)
    _print_warnings(result, answers)


def taken_as_exact(result: Mapping[str, Any]) -> list[str]:
    """What all positions share and nobody stated an uncertainty of, in words: no U allows for its error."""
    stated = result.get("stated", {}).get("uncertainties", {})
    known = {name for key, (name, _) in UNCERTAINTY_KEYS.items() if stated.get(key)}
    return [SOURCE_NAMES[line] for line, names in SOURCES.items() if names and not known & set(names)]


def _cells(answer: Mapping[str, Any], key: str) -> tuple[str, str]:
    if "error" in answer:
        return "–", "–"
    entry = answer["parameters"][key]
    if entry["value"] is None:
        return "not determined", "–"
    expanded = entry["expanded_uncertainty"]
    decimals = decimals_of(expanded)
    if expanded is None or decimals is None:
        return f"{entry['value']:.9g}".replace("-", "−"), "–"
    return rounded(entry["value"], decimals).replace("-", "−"), rounded(expanded, decimals)


def _unit(key: str) -> str:
    return "°/h/mA" if key.startswith("k") else "°/h/g" if key in ("wg", "wk") else "°/h"


def _fit_line(method: str, answer: Mapping[str, Any]) -> str:
    if "error" in answer:
        return f"{method}: {answer['error']['message']}"
    fit, parts = (
        answer["fit"],
        [f"{method}: {answer['fit']['dof']} degrees of freedom, rank {answer['fit']['rank']}"],
    )
    if fit["condition"] is not None:
        parts.append(f"condition {fit['condition']:.3g}")
    if fit["chi2"] is not None:
        parts.append(f"χ² {fit['chi2']:.4g}, p {fit['p_value']:.3g}")
    if answer["iterations"]:
        parts.append(f"{len(answer['iterations'])} rounds")
    return ", ".join(parts)


def _limits(answer: Mapping[str, Any]) -> Iterator[str]:
    """What U consists of, whether draws confirm it, and which further terms the data support."""
    if not answer.get("budget"):
        return
    factors = [
        entry["coverage_factor"] for entry in answer["parameters"].values() if entry["coverage_factor"]
    ]
    largest: dict[str, list[str]] = {}
    for name, entry in answer["parameters"].items():
        if entry["dominated_by"]:
            largest.setdefault(entry["dominated_by"], []).append(name)
    sources = {line["code"]: line["source"] for line in answer["budget"]}
    parts = [f"{sources[code]} for {', '.join(names)}" for code, names in largest.items()]
    if factors:
        span = " to ".join(dict.fromkeys(f"{factor:.2f}" for factor in (min(factors), max(factors))))
        yield f"U is k·u for 95 %, k = {span}; it comes mostly from {'; '.join(parts)}"
    if answer.get("current_noise"):
        yield answer["current_noise"]["conclusion"]["message"]
    if answer.get("monte_carlo"):
        yield f"Monte Carlo: {answer['monte_carlo']['conclusion']['message']}"
        if answer["monte_carlo"]["verdict"] == "disagree":
            yield from _drawn(answer["monte_carlo"])
    if answer.get("model"):
        yield answer["model"]["conclusion"]["message"]


def _drawn(found: Mapping[str, Any]) -> Iterator[str]:
    """The Monte Carlo intervals, which hold where first order's U does not."""
    for name, entry in found["parameters"].items():
        low, high = entry["symmetric"]
        decimals = decimals_of(entry["tolerance"])
        if low is not None and decimals is not None:
            ends = (rounded(end, decimals).replace("-", "−") for end in (low, high))
            yield f"  {name}: {100 * found['level']:g} % within {' … '.join(ends)} {_unit(name)}"


def _findings(answer: Mapping[str, Any]) -> Iterator[str]:
    for number, finding in enumerate(answer.get("diagnosis", ()), start=1):
        yield f"diagnosis {number}: {finding['message']}"
        if finding["advice"]:
            yield f"  {finding['advice']['message']}"
    for item in answer.get("not_excluded", ()):
        yield f"note: {item['message']}"


def _print_warnings(result: Mapping[str, Any], answers: Mapping[str, Mapping[str, Any]]) -> None:
    told = [item["message"] for item in result.get("input_warnings", ())]
    for answer in answers.values():
        told += [item["message"] for item in answer.get("warnings", ())]
    for message in dict.fromkeys(told):
        typer.echo(f"warning: {message}", err=True)
