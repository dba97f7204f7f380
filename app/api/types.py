"""Types of gyros: their limits, and what their parameters are expected to be."""

from collections.abc import Container, Iterator
from contextlib import contextmanager
from dataclasses import replace

from fastapi import APIRouter

from app.api.auth import Reader, Uploader
from app.api.pagination import Listing
from app.api.schemas.common import Name
from app.api.schemas.equipment import GyroType, Interval, NewLimits, NewNominals
from app.errors import Invalid, Problem
from app.services import gyros
from app.services.lab import Work
from app.services.views import Nominal, TypeView

router = APIRouter(tags=["gyros"])


@router.get("/types")
def listing(caller: Reader) -> Listing[GyroType]:
    """Every type with its limits and nominal values, in one part."""
    with caller.read() as work:
        return Listing(items=[_shown(item) for item in gyros.types(work)], next=None)


@router.put("/types/{name}/limits")
def set_limits(name: Name, body: NewLimits, caller: Uploader) -> GyroType:
    """Enter a type's limits, in laboratory units; an unknown type is created."""
    limits = {key: (limit.low, limit.high) for key, limit in body.limits.items()}
    spread = {
        key: limit.repeatability for key, limit in body.limits.items() if limit.repeatability is not None
    }
    with caller.write() as work, _placed("limits", limits):
        gyros.set_limits(work, name, limits, repeatability=spread)
        return _found(work, name)


@router.put("/types/{name}/interval")
def set_interval(name: Name, body: Interval, caller: Uploader) -> GyroType:
    """Enter how many days a calibration of a type's gyros holds; an unknown type is created."""
    with caller.write() as work:
        gyros.set_interval(work, name, body.days)
        return _found(work, name)


@router.put("/types/{name}/nominals")
def set_nominals(name: Name, body: NewNominals, caller: Uploader) -> GyroType:
    """Enter what a type's parameters are expected to be, in laboratory units; an unknown type is created.

    They serve to notice exchanged channels, wrong signs, a wrong latitude or unit.
    """
    nominals = {
        key: Nominal(item.value, item.standard_uncertainty, item.per_kelvin)
        for key, item in body.nominals.items()
    }
    with caller.write() as work, _placed("nominals", nominals):
        gyros.set_nominals(work, name, nominals)
        return _found(work, name)


@contextmanager
def _placed(member: str, keys: Container[str]) -> Iterator[None]:
    """Name the problem of a parameter by its place in the body."""

    def placed(item: Problem) -> Problem:
        if item.column is None or item.column not in keys:
            return item
        step = item.column.replace("~", "~0").replace("/", "~1")
        return replace(item, column=f"/{member}/{step}")

    try:
        yield
    except Invalid as error:
        raise Invalid(*(placed(item) for item in error.problems)) from error


def _found(work: Work, name: str) -> GyroType:
    return _shown(next(item for item in gyros.types(work) if item.name == name.strip()))


def _shown(view: TypeView) -> GyroType:
    limits = {
        name: {"low": low, "high": high, "repeatability": view.repeatability.get(name)}
        for name, (low, high) in view.limits.items()
    }
    nominals = {
        name: {"value": item.value, "standard_uncertainty": item.u, "per_kelvin": item.per_kelvin}
        for name, item in view.nominals.items()
    }
    return GyroType.model_validate(
        {
            "name": view.name, "note": view.note, "gyros": view.gyros, "limits": limits, "nominals": nominals,
            "interval_days": view.interval_days,
        }
    )  # fmt: skip
