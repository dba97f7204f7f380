"""Whose session is planned: stand, certificate, and what its gyro is expected to show."""

import json
from collections.abc import Mapping
from typing import Final

from app.errors import Invalid, NotFound, problem
from app.exchange.si import parameter_lab
from app.services import gyros, stands
from app.services.lab import Work
from app.services.plan_question import Asked, Question, Subject
from app.services.views import GyroView, TypeView
from app.store import equipment
from solver.errors import Message
from solver.records import PARAMETERS

_TYPICAL_SCALE_SI: Final = 10.0
"""Of a gyro of the paper's kind, rad/(s·A)."""


def typical() -> tuple[dict[str, float], Message]:
    """Parameters of a gyro of which nothing is known, in laboratory units, and where they come from."""
    scale = parameter_lab("kx", _TYPICAL_SCALE_SI)
    values = dict.fromkeys(PARAMETERS, 0.0) | {"kx": scale, "ky": scale}
    return values, Message(
        "nominal-typical",
        "a gyro of the paper’s kind: both scale factors %(scale).1f °/h/mA, no drift",
        {"scale": scale},
    )


def subject(
    work: Work,
    stand_name: str,
    asked: Asked,
    *,
    certificate: str | None = None,
    gyro: str | None = None,
    type_name: str | None = None,
) -> Subject:
    """The whole question about a stand.

    Without a certificate's number the one valid today counts; a gyro's last calibration goes before
    its type's nominal values, and those before a typical gyro's.

    Raises
    ------
    NotFound
        Unknown stand, certificate, gyro or type.
    Invalid
        The stand has no certificate that is valid today and none is named.
    """
    row = stands.find_stand(work, stand_name)
    if certificate:
        chosen = stands.find_certificate(work, row, certificate)
    else:
        valid = equipment.valid_certificate(work.db, row.id, work.now.date())
        if valid is None:
            raise Invalid(
                problem("no-valid-certificate", "Stand %(stand)s has no certificate that is valid today. "
                        "Name one.", column="certificate", stand=stand_name)
            )  # fmt: skip
        chosen = valid
    nominal, source, limits = _nominal(work, gyro or None, type_name or None)
    whole = Question(
        certificate=stands.certificate_rows(chosen), latitude_deg=row.latitude_deg,
        nominal=tuple(nominal[name] for name in PARAMETERS), asked=asked,
        statement=json.dumps(stands.statement(chosen), sort_keys=True),
        limits=tuple((name, low, high) for name, (low, high) in sorted(limits.items())),
    )  # fmt: skip
    return Subject(whole, stand_name, chosen.number, source)


def _nominal(
    work: Work, gyro: str | None, type_name: str | None
) -> tuple[dict[str, float], Message, Mapping[str, tuple[float, float]]]:
    """Nominal values, where they come from, and the limits of the type."""
    if gyro is not None:
        found = gyros.gyro(work, gyro)
        kind = _type(work, found.type)
        values, source = _of_type(kind)
        last = _last(found)
        if last is not None:
            values, source = values | last[0], last[1]
        return values, source, kind.limits
    if type_name is not None:
        kind = _type(work, type_name)
        return *_of_type(kind), kind.limits
    return *typical(), {}


def _type(work: Work, name: str) -> TypeView:
    for kind in gyros.types(work):
        if kind.name == name:
            return kind
    raise NotFound(problem("unknown-type", "There is no type %(type)s.", column="type", type=name))


def _of_type(kind: TypeView) -> tuple[dict[str, float], Message]:
    """The type's nominal values, those of a typical gyro where it has none."""
    values, source = typical()
    if kind.nominals:
        values |= {name: item.value for name, item in kind.nominals.items()}
        source = Message("nominal-type", "nominal values of type %(type)s", {"type": kind.name})
    return values, source


def _last(gyro: GyroView) -> tuple[dict[str, float], Message] | None:
    """The determined parameters of the gyro's last calibration; None where the scale factors are not among them."""
    if gyro.last_result is None:
        return None
    known = {name: view.value for name, view in gyro.last_result.parameters.items() if view.value is not None}
    if not {"kx", "ky"} <= known.keys():
        return None
    return known, Message(
        "nominal-calibration",
        "calibration %(number)d of gyro %(gyro)s",
        {"number": gyro.last_result.id, "gyro": gyro.serial},
    )
