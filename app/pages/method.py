"""The method, as the product documents it to its users."""

from fastapi import APIRouter, Request, Response

from app.pages.base import Reader, render

router = APIRouter()


@router.get("/method")
def method(request: Request, person: Reader) -> Response:
    """Observation equations, both methods, and the misprints found in the source."""
    return render(request, "method/page.html")
