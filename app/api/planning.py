"""Plans: what positions will tell before anything is measured, and which are best."""

from typing import Annotated

from fastapi import APIRouter, Query

from app.api.auth import Reader
from app.api.schemas.common import Name
from app.api.schemas.planning import Planned, PlanQuery
from app.exchange.planned import listed_positions
from app.services import plan_subjects, planning
from app.services.plan_question import Asked

router = APIRouter(tags=["stands"])


@router.get("/stands/{name}/plan", responses={404: {}})
def plan(name: Name, query: Annotated[PlanQuery, Query()], caller: Reader) -> Planned:
    """What a list of positions will tell, or the best ones of so many; nothing is stored."""
    with caller.read() as work:
        subject = plan_subjects.subject(
            work, name, _asked(query), certificate=query.certificate, gyro=query.gyro, type_name=query.type
        )
    found = planning.planned(subject, with_counts=query.counts, with_trade=query.trade)
    return Planned.model_validate(found)


def _asked(query: PlanQuery) -> Asked:
    return Asked(
        count=query.count, positions=listed_positions(query.positions, "positions") if query.positions else (),
        grid_deg=query.grid_deg, criterion=query.criterion, repeats=query.repeats, time_s=query.time_s,
        moving_s=query.moving_s, noise_deg_per_h=query.noise_deg_per_h, floor_deg_per_h=query.floor_deg_per_h,
    )  # fmt: skip
