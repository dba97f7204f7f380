"""One measurement: its means, its record to zoom into, where it came from, the position's revisions."""

from collections.abc import Iterator
from typing import Annotated, Final

from fastapi import APIRouter, Query, Request, Response

from app import plots
from app.figures import plain
from app.i18n import gettext
from app.pages.base import Reader, TheLab, render
from app.pages.entry import anchor
from app.pages.noise_view import noise_view
from app.pages.tables import csv_answer
from app.services import measurements, noise, traces
from app.services.measurements import MeasurementDetail
from app.services.traces import Trace

router = APIRouter()

_BINS: Final = 800
_PARTS: Final = 8
_SHORTEST_S: Final = 0.05
_UA_PER_MA: Final = 1000.0

Second = Annotated[float | None, Query(ge=0)]


@router.get("/measurements/{measurement_id:int}")
def page(
    request: Request, person: Reader, lab: TheLab, measurement_id: int, since: Second = None,
    until: Second = None,
) -> Response:  # fmt: skip
    """The measurement and, where there is one, its record between two times, and the record's noise."""
    with lab.read(person) as work:
        found = measurements.detail(work, measurement_id)
        begin, end = _window(found, since, until)
        trace = (
            traces.trace(work, measurement_id, since_s=begin, until_s=end, bins=_BINS)
            if found.record
            else None
        )
        kept = noise.currents(work, measurement_id) if found.record else None
    return render(
        request, "measurements/page.html", found=found, measurement=found.measurement,
        session=found.session, trace=trace, window=(begin, end),
        charts=list(_charts(request, found, trace, (begin, end))) if trace else [],
        zooms=list(_zooms(found, (begin, end))) if trace else [], anchor=anchor,
        noise=noise_view(noise.analysed(kept)) if kept else None,
    )  # fmt: skip


@router.get("/measurements/{measurement_id:int}.csv")
def exported(
    person: Reader, lab: TheLab, measurement_id: int, since: Second = None, until: Second = None
) -> Response:
    """The stretch that is shown, as its bins' extremes; the samples themselves when it is short."""
    with lab.read(person) as work:
        found = measurements.detail(work, measurement_id)
        begin, end = _window(found, since, until)
        trace = traces.trace(work, measurement_id, since_s=begin, until_s=end, bins=_BINS)
    columns = ("t_s", "jx_low_ma", "jx_high_ma", "jy_low_ma", "jy_high_ma")
    rows = [
        dict(zip(columns, row, strict=True))
        for row in zip(
            trace.t_s, trace.jx_low_ma, trace.jx_high_ma, trace.jy_low_ma, trace.jy_high_ma, strict=True
        )
    ]
    return csv_answer(rows, columns, f"measurement-{measurement_id}")


def _window(found: MeasurementDetail, since: float | None, until: float | None) -> tuple[float, float]:
    """The stretch asked for, within the record and not shorter than some samples."""
    length = found.record.duration_s if found.record else 0.0
    begin = min(since or 0.0, max(0.0, length - _SHORTEST_S))
    end = length if until is None else min(max(until, begin + _SHORTEST_S), length)
    return begin, max(end, begin + _SHORTEST_S)


def _address(found: MeasurementDetail, begin: float, end: float) -> str:
    return f"/measurements/{found.measurement.id}?since={begin:.6g}&until={end:.6g}"


def _charts(
    request: Request, found: MeasurementDetail, trace: Trace, window: tuple[float, float]
) -> Iterator[tuple[str, plots.theme.Spec]]:
    begin, end = window
    step = (end - begin) / _PARTS
    stretches = [
        plots.Stretch(
            a, b, gettext("Enlarge %(begin)s to %(end)s s") % {"begin": plain(a, 3), "end": plain(b, 3)},
            _address(found, a, b),
        )
        for a, b in ((begin + part * step, begin + (part + 1) * step) for part in range(_PARTS))
        if b - a >= _SHORTEST_S
    ]  # fmt: skip
    row = found.measurement
    for axis, low, high, mean in (
        ("x", trace.jx_low_ma, trace.jx_high_ma, row.jx_ma),
        ("y", trace.jy_low_ma, trace.jy_high_ma, row.jy_ma),
    ):
        spec = plots.record(
            trace.t_s,
            [value * _UA_PER_MA for value in low],
            [value * _UA_PER_MA for value in high],
            "x" if axis == "x" else "y",
            None if mean is None else mean * _UA_PER_MA,
            stretches,
            gettext("Current of channel %(axis)s from %(begin)s to %(end)s s, its mean as a line")
            % {"axis": axis, "begin": plain(begin, 3), "end": plain(end, 3)},
        )
        yield f"j{axis}", spec


def _zooms(found: MeasurementDetail, window: tuple[float, float]) -> Iterator[tuple[str, str]]:
    """Links that need no chart: out, in on the middle, earlier, later, the whole record."""
    begin, end = window
    length = found.record.duration_s if found.record else 0.0
    span = end - begin
    whole = span >= length - _SHORTEST_S
    if not whole:
        yield gettext("Whole record"), f"/measurements/{found.measurement.id}"
        yield (
            gettext("Twice as much"),
            _address(found, max(0.0, begin - span / 2), min(length, end + span / 2)),
        )
    if span / 2 >= _SHORTEST_S:
        yield gettext("Middle half"), _address(found, begin + span / 4, end - span / 4)
    if begin > 0 and not whole:
        yield gettext("Earlier"), _address(found, max(0.0, begin - span), begin)
    if end < length and not whole:
        yield gettext("Later"), _address(found, end, min(length, end + span))
