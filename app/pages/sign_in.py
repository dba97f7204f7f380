"""Sign-in by password or link, and sign-out."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from app.errors import AppError
from app.pages.base import TheLab, is_secure, local_path, login_cookie, render, see
from app.pages.forms import Form, Sent
from app.services import access
from app.services.lab import Lab

router = APIRouter()

_KEPT_S = 90 * 86400  # the server ends it much earlier when it is not used


@router.get("/sign-in")
def form(request: Request, wanted: Annotated[str, Query(alias="next")] = "/") -> Response:
    """Ask for name and password."""
    return render(request, "sign_in/form.html", form=Form({"next": local_path(wanted)}))


@router.post("/sign-in")
def by_password(request: Request, lab: TheLab, sent: Sent) -> Response:
    """Open a sign-in for this browser."""
    typed = Form.of(sent, "name", "password", "next")
    try:
        with lab.write(access.NOBODY) as work:
            secret = access.sign_in(work, typed.value("name").strip(), typed.value("password"))
    except AppError as error:
        shown = typed.with_problems(*error.problems)
        return render(request, "sign_in/form.html", status=422, form=shown)
    return _signed_in(lab, secret, local_path(typed.value("next")))


@router.get("/sign-in/link/{secret}")
def by_link(request: Request, lab: TheLab, secret: str) -> Response:
    """Open a sign-in for this browser with the secret of a link."""
    try:
        with lab.write(access.NOBODY) as work:
            login = access.sign_in_by_link(work, secret)
    except AppError as error:
        return render(request, "sign_in/form.html", status=422, form=Form().with_problems(*error.problems))
    return _signed_in(lab, login, "/")


@router.post("/sign-out")
def sign_out(request: Request, lab: TheLab) -> Response:
    """Revoke this browser's sign-in."""
    name = login_cookie(lab)
    with lab.write(access.NOBODY) as work:
        access.sign_out(work, request.cookies.get(name, ""))
    answer = see("/sign-in")
    answer.delete_cookie(name, secure=is_secure(lab), httponly=True, samesite="lax")
    return answer


def _signed_in(lab: Lab, secret: str, target: str) -> Response:
    answer = see(target)
    answer.set_cookie(
        login_cookie(lab), secret, max_age=_KEPT_S, httponly=True, samesite="lax", secure=is_secure(lab)
    )
    return answer
