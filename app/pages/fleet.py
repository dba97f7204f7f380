"""All gyros of a type: distributions, the worst and the best, what is due, what goes together."""

from typing import Literal

from fastapi import APIRouter, Request, Response

from app.pages import drift_labels, drift_words, fleet_view, labels
from app.pages.base import Reader, TheLab, render
from app.pages.tables import csv_answer, json_answer, parquet_answer
from app.services.drift import fleet
from app.services.drift.due import STATES
from app.services.drift.fleet_rows import COLUMNS, rows

router = APIRouter()


@router.get("/types/{name}/fleet")
def page(
    request: Request, person: Reader, lab: TheLab, name: str, parameter: str = "w0x",
    sort: str = fleet_view.WORST_FIRST,
) -> Response:  # fmt: skip
    """The fleet of one type, its table about one parameter."""
    with lab.read(person) as work:
        found = fleet.fleet(work, name)
    parameter = parameter if parameter in fleet_view.ORDER else "w0x"
    sort = sort if sort.removeprefix("-") in fleet_view.SORTS else fleet_view.WORST_FIRST
    sources, scatter = fleet_view.pooled(found)
    return render(
        request, "fleet/page.html", fleet=found, panels=list(fleet_view.panels(found)),
        rows=fleet_view.rows(found, parameter, sort), parameter=parameter, sort=sort, order=fleet_view.ORDER,
        unit=labels.PARAMETER_UNITS[parameter], sources=sources, scatter=scatter,
        chart=fleet_view.correlation_chart(found), probability=drift_words.probability,
        states=STATES, drift=drift_labels,
    )  # fmt: skip


@router.get("/types/{name}/fleet.{form}")
def exported(person: Reader, lab: TheLab, name: str, form: Literal["csv", "json", "parquet"]) -> Response:
    """Every gyro with all its parameters as a file."""
    with lab.read(person) as work:
        table = rows(fleet.fleet(work, name))
    if form == "json":
        return json_answer(table)
    answer = csv_answer if form == "csv" else parquet_answer
    return answer(table, COLUMNS, f"fleet-{name}")
