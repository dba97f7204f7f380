"""One measurement with what belongs to it, and what the gyro's session before this one gave."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from app.errors import NotFound, problem
from app.services import sessions, stands
from app.services.lab import Work
from app.services.views import MeasurementView, PositionView, SessionView
from app.store import measurement

LARGE_DIFFERENCE: Final = 0.02
"""A current is surprising when it differs from the one before by more than this part of the largest.

Between two starts the fixed drift moves by hundredths of a degree per hour, a thousandth of the
currents that the Earth's rotation needs; a wrong position or a slipped digit moves them by far more.
"""
_SAME_LATITUDE_DEG: Final = 0.01

Place = tuple[float, float]


@dataclass(frozen=True, slots=True)
class RecordFacts:
    """What is known of a record file beside its samples."""

    digest: str
    samples: int
    duration_s: float
    rate_hz: float
    source_name: str
    source_digest: str


@dataclass(frozen=True, slots=True)
class MeasurementDetail:
    """One revision of one position; `number` is the position's, `revisions` are all of it."""

    measurement: MeasurementView
    session: SessionView
    number: int
    revisions: tuple[MeasurementView, ...]
    record: RecordFacts | None

    @property
    def newest(self) -> MeasurementView:
        """The revision that counts."""
        return self.revisions[-1]


@dataclass(frozen=True, slots=True)
class Before:
    """The gyro's session before: its currents in mA by position."""

    session: SessionView
    means_ma: Mapping[Place, tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Surprise:
    """A current that is far from the one of the session before, mA."""

    axis: Literal["x", "y"]
    difference_ma: float


def detail(work: Work, measurement_id: int) -> MeasurementDetail:
    """One measurement with its session, its record and the other revisions of its position."""
    row = measurement.measurement(work.db, measurement_id)
    if row is None:
        raise NotFound(
            problem("unknown-measurement", "There is no measurement %(number)d.", number=measurement_id)
        )
    session = sessions.find_session(work, row.session_id)
    places = [(item.theta_deg, item.psi_deg) for item in stands.certificate_rows(session.certificate)]
    revisions = tuple(
        sessions.measurement_view(item)
        for item in measurement.revisions(work.db, row.session_id)
        if (item.theta_deg, item.psi_deg, item.repeat) == (row.theta_deg, row.psi_deg, row.repeat)
    )
    kept = row.record
    return MeasurementDetail(
        measurement=sessions.measurement_view(row),
        session=sessions.views(work, [session])[0],
        number=sorted(places).index((row.theta_deg, row.psi_deg)) + 1,
        revisions=revisions,
        record=None
        if kept is None
        else RecordFacts(
            kept.digest, kept.samples, kept.duration_s, kept.rate_hz, kept.source_name, kept.source_digest
        ),
    )


def before(work: Work, session: SessionView) -> Before | None:
    """The gyro's last session before this one, at the same latitude and with currents; None if none."""
    for row in measurement.sessions(work.db, gyro=session.gyro, until=session.started_at, limit=20):
        if row.id == session.id or abs(row.latitude_deg - session.latitude_deg) > _SAME_LATITUDE_DEG:
            continue
        means = {
            (item.theta_deg, item.psi_deg): (item.jx_ma, item.jy_ma)
            for item in measurement.current(work.db, row.id)
            if item.jx_ma is not None and item.jy_ma is not None
        }
        if means:
            return Before(sessions.views(work, [row])[0], means)
    return None


def surprises(
    positions: Sequence[PositionView], earlier: Before | None
) -> Mapping[tuple[float, float, int], Surprise]:
    """Positions whose currents are far from those of the session before, the worse axis of each."""
    if earlier is None:
        return {}
    limit = LARGE_DIFFERENCE * max(abs(current) for pair in earlier.means_ma.values() for current in pair)
    found = {}
    for position in positions:
        known = earlier.means_ma.get((position.theta_deg, position.psi_deg))
        now = position.measurement
        if known is None or now is None or now.jx_ma is None or now.jy_ma is None:
            continue
        by_axis: tuple[Surprise, Surprise] = (
            Surprise("x", now.jx_ma - known[0]),
            Surprise("y", now.jy_ma - known[1]),
        )
        worse = max(by_axis, key=lambda item: abs(item.difference_ma))
        if abs(worse.difference_ma) > limit:
            found[position.theta_deg, position.psi_deg, position.repeat] = worse
    return found
