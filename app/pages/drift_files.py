"""What was found of a type, a gyro and a stand as files."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response

from app.pages.base import Reader, TheLab
from app.pages.tables import csv_answer, json_answer, parquet_answer
from app.services.drift import fleet, reading, stand_reading, tables
from app.services.drift.tables import Table

router = APIRouter()
Form = Literal["csv", "json", "parquet"]
Method = Literal["least-squares", "generalised", "robust", "paper"]


@router.get("/types/{name}/fleet/{table}.{form}")
def of_type(
    person: Reader,
    lab: TheLab,
    name: str,
    table: Literal["distributions", "components", "correlations"],
    form: Form,
) -> Response:
    """What a type's gyros have in common."""
    with lab.read(person) as work:
        found = fleet.fleet(work, name)
    return _answer(tables.OF_TYPE[table](found), form, f"{table}-{name}")


@router.get("/gyros/{serial}/history/{table}.{form}")
def of_gyro(
    person: Reader, lab: TheLab, serial: str, table: Literal["changes", "trends", "forecasts", "intervals"],
    form: Form, method: Annotated[Method, Query()] = "least-squares",
) -> Response:  # fmt: skip
    """What was found of a gyro's whole life."""
    with lab.read(person) as work:
        found = reading.gyro_drift(work, serial, method=method, parameters=(), most=1).document
    return _answer(tables.OF_GYRO[table](found or tables.NOTHING), form, f"{table}-{serial}")


@router.get("/stands/{name}/drift/findings.{form}")
def of_stand(person: Reader, lab: TheLab, name: str, form: Form) -> Response:
    """What was found of a stand."""
    with lab.read(person) as work:
        found = stand_reading.stand_drift(work, name, by="year").document
    return _answer(tables.findings(found or tables.NOTHING), form, f"findings-{name}")


def _answer(table: Table, form: Form, name: str) -> Response:
    if form == "json":
        return json_answer(table.rows)
    answer = csv_answer if form == "csv" else parquet_answer
    return answer(table.rows, table.columns, name)
