"""The rebalance loop: stable or not, with what margin, and how it answers a step."""

from typing import Annotated

from fastapi import APIRouter, Query

from app.api.auth import Reader
from app.api.schemas.loop import Loop, LoopQuery
from app.services import loop, loop_documents

router = APIRouter(tags=["gyros"])


@router.get("/loop", responses={404: {}})
def found(query: Annotated[LoopQuery, Query()], caller: Reader) -> Loop:
    """Poles, margins, bandwidth, step and frequency response of a loop; nothing is stored."""
    with caller.read() as work:
        usual = loop.usual(work, query.type)
    given = {name: value for name in loop.MEMBERS if (value := getattr(query, name)) is not None}
    answer = loop.answer(loop.changed(usual, given), query.duration_s)
    return Loop.model_validate(loop_documents.as_json(answer))
