"""The Vega bundle that the wheel of vl-convert carries, made once for each version of the wheel."""

import threading
from pathlib import Path
from typing import Final

from fastapi import APIRouter, Request, Response

from app.pages.base import lab_of
from app.pages.labels import VEGA_VERSION

router = APIRouter()

_making: Final = threading.Lock()


@router.get("/lib/vega.js")
def vega(request: Request) -> Response:
    """Vega, Vega-Lite and Vega-Embed as one script; its address carries the version."""
    tag = f'"{VEGA_VERSION}"'
    headers = {"cache-control": "public, max-age=31536000, immutable", "etag": tag}
    if request.headers.get("if-none-match") == tag:
        return Response(status_code=304, headers=headers)
    script = _bundle(lab_of(request).settings.data / "cache" / f"vega-{VEGA_VERSION}.js")
    return Response(script, media_type="text/javascript; charset=utf-8", headers=headers)


def _bundle(kept: Path) -> bytes:
    """The bundle from its file, or made anew: that takes some seconds of a processor."""
    with _making:
        if kept.exists():
            return kept.read_bytes()
        from vl_convert import javascript_bundle

        script = javascript_bundle("window.vegaEmbed = vegaEmbed;").encode()
        kept.parent.mkdir(parents=True, exist_ok=True)
        unfinished = kept.with_suffix(".part")
        unfinished.write_bytes(script)
        unfinished.replace(kept)
        return script
