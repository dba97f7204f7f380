"""Who calls: the bearer token, and whether its scopes reach."""

from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Request, Security
from fastapi.security import HTTPAuthorizationCredentials, HTTPBearer

from app.errors import Unauthenticated, problem
from app.services import access
from app.services.lab import Lab, Person, Work

_bearer = HTTPBearer(
    scheme_name="token",
    auto_error=False,
    description="A token made with `driftbook token create`: `Authorization: Bearer TOKEN`. "
    "The scope `read` reaches every GET, `upload` everything else.",
)


@dataclass(frozen=True, slots=True)
class Caller:
    """Whoever calls, at the laboratory."""

    lab: Lab
    person: Person

    def read(self) -> AbstractContextManager[Work]:
        """A consistent view."""
        return self.lab.read(self.person)

    def write(self) -> AbstractContextManager[Work]:
        """One transaction, committed at the block's end, before the answer is sent."""
        return self.lab.write(self.person)


def _caller(
    request: Request, credentials: Annotated[HTTPAuthorizationCredentials | None, Security(_bearer)]
) -> Caller:
    lab: Lab = request.app.state.lab
    if credentials is None:
        raise Unauthenticated(
            problem("no-token", "Send a token in the header “Authorization: Bearer TOKEN”.")
        )
    with lab.read(access.NOBODY) as work:
        return Caller(lab, access.bearer(work, credentials.credentials))


def _reading(caller: Annotated[Caller, Depends(_caller)]) -> Caller:
    access.require(caller.person, "read")
    return caller


def _uploading(caller: Annotated[Caller, Depends(_caller)]) -> Caller:
    access.require(caller.person, "upload")
    return caller


Reader = Annotated[Caller, Depends(_reading)]
Uploader = Annotated[Caller, Depends(_uploading)]
