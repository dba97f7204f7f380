"""A validation report as text: a summary for the terminal, everything for a file."""

import io
import sys
from collections.abc import Mapping, Sequence
from typing import Any, Final

from rich.console import Console
from rich.markup import escape
from rich.table import Table

_WORDS: Final = {"pass": "[green]✓ pass[/]", "fail": "[bold red]✗ FAIL[/]"}
_WIDTH: Final = 118


def print_summary(report: Mapping[str, Any]) -> None:
    """Print one line per case, and every check that failed."""
    console = Console(highlight=False, width=None if sys.stdout.isatty() else _WIDTH)
    for group in report["groups"]:
        console.print(_summary(group))
    for case in _cases(report):
        if case["verdict"] == "fail":
            _explain(console, case, [item for item in case["checks"] if item["verdict"] == "fail"])
    console.print(_conclusion(report))


def text(report: Mapping[str, Any]) -> str:
    """Everything, with dates, versions and every check."""
    written = io.StringIO()
    console = Console(file=written, width=_WIDTH, highlight=False, no_color=True)
    console.print("Driftbook: validation report")
    console.print(f"{report['started_at']}, {report['mode']}, seed {report['seed']}")
    for name, value in report["environment"].items():
        console.print(f"  {name:<10} {value}")
    console.print(f"  {'input':<10} {report['input_hash']}\n")
    console.print(_conclusion(report))
    for group in report["groups"]:
        console.print(_summary(group))
    for case in _cases(report):
        _explain(console, case, case["checks"])
    return "\n".join(line.rstrip() for line in written.getvalue().splitlines()) + "\n"


def _cases(report: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    return [case for group in report["groups"] for case in group["cases"]]


def _conclusion(report: Mapping[str, Any]) -> str:
    failed = report["cases_failed"]
    said = f"{failed} of {report['cases']} cases failed" if failed else f"all {report['cases']} cases passed"
    return f"{_WORDS[report['verdict']]}: {said}, {report['duration_s']:.1f} s\n"


def _summary(group: Mapping[str, Any]) -> Table:
    table = Table(title=group["title"], title_justify="left", box=None, pad_edge=False)
    table.add_column("case", min_width=40)
    table.add_column("checks", justify="right")
    table.add_column("digits", justify="right")
    table.add_column("required", justify="right")
    table.add_column("verdict")
    for case in group["cases"]:
        table.add_row(
            escape(case["name"]), str(len(case["checks"])), _digits(case["digits"]),
            _digits(case["required_digits"]), _WORDS[case["verdict"]],
        )  # fmt: skip
    return table


def _explain(console: Console, case: Mapping[str, Any], checks: Sequence[Mapping[str, Any]]) -> None:
    console.print(f"[bold]{escape(case['name'])}[/]: {_WORDS[case['verdict']]}")
    console.print(f"  source   {escape(case['source'])}")
    console.print(f"  by       {escape(case['function'])}")
    for key in ("note", "error"):
        if case[key]:
            console.print(f"  {key:<8} {escape(case[key])}")
    table = Table(box=None, pad_edge=False)
    for name in ("  quantity", "expected", "obtained", "unit", "digits", "accepted", "verdict"):
        table.add_column(name, justify="right" if name in ("expected", "obtained", "digits") else "left")
    for check in checks:
        table.add_row(
            "  " + escape(_named(check)), _value(check["expected"]), _value(check["obtained"]),
            check["unit"], _digits(check["digits"]), _accepted(check), _WORDS[check["verdict"]],
        )  # fmt: skip
    console.print(table if checks else "")
    console.print()


def _named(check: Mapping[str, Any]) -> str:
    return f"{check['name']}, {check['detail']}" if check["detail"] else str(check["name"])


def _value(value: float | str | None) -> str:
    return escape(value) if isinstance(value, str) else "–" if value is None else f"{value:.15g}"


def _digits(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f}"


def _accepted(check: Mapping[str, Any]) -> str:
    if check["required_digits"] is not None:
        return f"≥ {check['required_digits']:g} digits"
    if check["low"] is not None:
        return f"{check['low']:.6g} … {check['high']:.6g}"
    return "equal"
