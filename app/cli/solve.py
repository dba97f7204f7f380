"""Calibrating files, with no database."""

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from app.cli.sessions_on_disk import Item, items
from app.cli.tables import print_result
from app.errors import AppError, Invalid, Problem, problem
from app.exchange.certificate import read_certificate
from app.exchange.json_values import dumps, message_json
from app.exchange.plausible import CODE as CURRENT_UNIT
from app.exchange.prior import read_prior
from app.exchange.rows import CertificateRow
from app.exchange.session_folder import SessionFiles
from app.exchange.si import incomplete_uncertainties
from app.exchange.uncertainties import read_uncertainties
from app.services.solving import FEWEST_TRIALS, Stated, solved
from solver.errors import Message


class Method(StrEnum):
    """Methods by their names."""

    LEAST_SQUARES = "least-squares"
    PAPER = "paper"
    BOTH = "both"
    ROBUST = "robust"
    GENERALISED = "generalised"


def solve(
    currents: Annotated[list[Path], typer.Argument(help="Means, records, session folders, folders of them.")],
    certificate: Annotated[
        Path | None, typer.Option("--certificate", help="The stand's certificate (CSV, Parquet).")
    ] = None,
    latitude: Annotated[
        float | None,
        typer.Option("--latitude", min=-90, max=90, help="Of the stand, degrees; south negative."),
    ] = None,
    method: Annotated[Method, typer.Option("--method", help="How to solve.")] = Method.LEAST_SQUARES,
    uncertainties: Annotated[
        Path | None,
        typer.Option("--uncertainties", help="What all positions have in common: gain, level, … (JSON)."),
    ] = None,
    prior: Annotated[
        Path | None,
        typer.Option("--prior", help="What the gyro is expected to be: parameters with u (JSON)."),
    ] = None,
    monte_carlo: Annotated[
        str,
        typer.Option(
            "--monte-carlo",
            help="Draws to propagate the distributions by: 0 for none, from 10000 on, or adaptive.",
        ),
    ] = "0",
    seed: Annotated[int, typer.Option("--seed", min=0, help="Of these draws.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="For programs: one JSON object per item.")] = False,
) -> None:
    """Calibrate from files: a table for people, JSON for programs."""
    angles = _certificate(certificate) if certificate else None
    stated = Stated(
        uncertainties=read_uncertainties(_bytes(uncertainties), str(uncertainties)) if uncertainties else {},
        prior=_prior(prior) if prior else None,
        trials=_trials(monte_carlo),
        seed=seed,
    )
    every = list(items(currents))
    several = len(every) > 1
    failed = False
    for item in every:
        try:
            result = _solve_one(item, angles, certificate, latitude, method, stated)
        except AppError as error:
            if not several:
                raise
            failed = True
            _tell_failure(item, error, as_json)
            continue
        if as_json:
            typer.echo(dumps({"file": item.name, **result} if several else result))
        else:
            print_result(item.name, result)
    if failed:
        sys.exit(2)


def _certificate(path: Path) -> list[CertificateRow]:
    return read_certificate(_bytes(path), str(path))[0]


def _trials(text: str) -> int | None:
    """Number of draws; None for as many as are needed."""
    if text == "adaptive":
        return None
    trials = int(text) if text.isascii() and text.isdigit() and len(text) < 10 else -1
    if trials and trials < FEWEST_TRIALS:
        raise Invalid(problem("bad-trials", "“%(text)s” is no number of draws. Give 0 for none, a whole number from "
                              "%(fewest)d on, or adaptive.", column="--monte-carlo", text=text[:40],
                              fewest=FEWEST_TRIALS))  # fmt: skip
    return trials


def _prior(path: Path) -> dict[str, Any]:
    parameters = read_prior(_bytes(path), str(path))
    source = Message("prior-file", "the file %(file)s", {"file": path.name})
    return {
        "source": message_json(source),
        "parameters": {name: item._asdict() for name, item in parameters.items()},
    }


def _bytes(path: Path) -> bytes:
    if not path.is_file():
        raise Invalid(problem("no-file", "There is no such file.", file=str(path)))
    return path.read_bytes()


def _solve_one(
    item: Item,
    angles: list[CertificateRow] | None,
    named: Path | None,
    latitude: float | None,
    method: Method,
    stated: Stated,
) -> dict[str, Any]:
    session = item.read()
    rows = list(angles or session.certificate)
    if not rows:
        raise Invalid(problem("no-certificate", "There is no certificate with these currents. Name one with "
                              "--certificate FILE.", file=item.name))  # fmt: skip
    latitude_deg = session.facts.latitude_deg if latitude is None else latitude
    if latitude_deg is None:
        raise Invalid(
            problem(
                "no-latitude",
                "The stand's latitude is not known. Give it with --latitude DEG, south negative.",
                file=item.name,
            )
        )
    try:
        means = session.measured()
        output = solved(means, rows, latitude_deg, method.value, stated)
    except AppError as error:  # what is wrong between files has no file of its own: it is this item's
        raise type(error)(*(replace(one, file=one.file or item.name) for one in error.problems)) from error
    result: dict[str, Any] = json.loads(output["result"])
    warnings = [
        item for item in session.warnings if item.code != CURRENT_UNIT
    ]  # the result says it of all currents
    warnings += _differences(session, rows, named, latitude_deg)
    incomplete = incomplete_uncertainties(means)
    warnings += [incomplete] if incomplete else []
    if warnings:
        result["input_warnings"] = [message_json(warning) for warning in warnings]
    return result


def _differences(
    session: SessionFiles, rows: list[CertificateRow], named: Path | None, latitude_deg: float
) -> list[Message]:
    """What the command line says otherwise than the session's own files: the command line wins."""
    found = []
    if session.facts.latitude_deg is not None and session.facts.latitude_deg != latitude_deg:
        found.append(
            Message("latitude-differs", "The session's files say latitude %(theirs)g°; %(used)g° was given "
                    "and is used.", {"theirs": session.facts.latitude_deg, "used": latitude_deg})
        )  # fmt: skip
    if named and session.certificate and _by_place(session.certificate) != _by_place(rows):
        found.append(
            Message("certificate-differs", "The session's files hold another certificate; %(used)s was given "
                    "and is used.", {"used": str(named)})
        )  # fmt: skip
    return found


def _by_place(rows: Sequence[CertificateRow]) -> list[tuple[float, ...]]:
    places = [
        (row.theta_deg, row.psi_deg, row.alpha_arcsec, row.beta_arcsec, row.gamma_arcsec) for row in rows
    ]
    return sorted(places)


def _tell_failure(item: Item, error: AppError, as_json: bool) -> None:
    first = error.problems[0]
    if as_json:
        told = {**_problem_json(first), "problems": len(error.problems)}
        typer.echo(dumps({"file": item.name, "error": told}))
    else:
        typer.echo(f"driftbook: {item.name}: {first.text}", err=True)


def _problem_json(item: Problem) -> dict[str, Any]:
    places = {name: value for name, value in asdict(item).items() if name != "message" and value is not None}
    return {"code": item.message.code, "message": item.text, **places}
