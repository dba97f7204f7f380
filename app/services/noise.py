"""What a record of currents says of its noise, computed from the stored samples when it is asked for."""

import io
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
import pyarrow.parquet as pq
from numpy.typing import NDArray

from app.errors import NotFound, problem
from app.exchange.noise import noise_document
from app.services import sessions, verdicts
from app.services.lab import Work
from app.services.sessions import measurement_view
from app.services.views import MeasurementView
from app.store import measurement, results
from app.store.tables.measurement import Measurement
from solver.signals.channel_noise import ChannelNoise, channel_noise
from solver.units import ampere_from_ma

Channel = Literal["jx", "jy"]
_SCALES: Final[Mapping[Channel, str]] = {"jx": "kx", "jy": "ky"}


@dataclass(frozen=True, slots=True)
class Currents:
    """A stored record, mA, and the scale factors of the gyro's last result, °/h/mA, where it has one."""

    measurement: MeasurementView
    session: int
    duration_s: float
    rate_hz: float
    samples_ma: Mapping[Channel, NDArray[np.float64]]
    scales_deg_per_h_per_ma: Mapping[Channel, float]
    scales_from: int | None


@dataclass(frozen=True, slots=True)
class RecordNoise:
    """Noise of both channels: in SI as the solver gives it, and in laboratory units."""

    currents: Currents
    channels: Mapping[Channel, ChannelNoise]
    documents: Mapping[Channel, Mapping[str, Any]]


def currents(work: Work, measurement_id: int) -> Currents:
    """The samples of a measurement that has a record."""
    row = measurement.measurement(work.db, measurement_id)
    if row is None or row.record is None:
        raise _no_record()
    return _currents(work, row)


def currents_at(work: Work, session_id: int, theta_deg: float, psi_deg: float, repeat: int = 0) -> Currents:
    """The samples of the measurement that counts at a position."""
    sessions.find_session(work, session_id)
    place = (theta_deg % 360.0, psi_deg % 360.0, repeat)
    row = measurement.newest(work.db, session_id).get(place)
    if row is None or row.jx_ma is None:
        raise NotFound(
            problem(
                "not-measured",
                "Position θ %(theta)g°, ψ %(psi)g° of session %(session)d is not measured.",
                theta=theta_deg,
                psi=psi_deg,
                session=session_id,
            )
        )
    if row.record is None:
        raise _no_record()
    return _currents(work, row)


def analysed(kept: Currents) -> RecordNoise:
    """Both channels seen from every side. It takes some time: call it with no transaction open."""
    channels = {
        channel: channel_noise(ampere_from_ma(samples), 1.0 / kept.rate_hz)
        for channel, samples in kept.samples_ma.items()
    }
    documents = {
        channel: noise_document(found, kept.scales_deg_per_h_per_ma.get(channel))
        for channel, found in channels.items()
    }
    return RecordNoise(kept, channels, documents)


def _currents(work: Work, row: Measurement) -> Currents:
    kept = row.record
    if kept is None:
        raise _no_record()
    table = pq.read_table(io.BytesIO(work.files.read(kept.digest, "parquet")))
    session = sessions.find_session(work, row.session_id)
    last = results.newest_of_gyros(work.db, [session.gyro_id]).get(session.gyro_id)
    parameters = verdicts.summary(last).parameters if last is not None else {}
    scales: dict[Channel, float] = {}
    for channel, name in _SCALES.items():
        view = parameters.get(name)
        if view is not None and view.value is not None:
            scales[channel] = view.value
    return Currents(
        measurement=measurement_view(row),
        session=row.session_id,
        duration_s=kept.duration_s,
        rate_hz=kept.rate_hz,
        samples_ma={channel: table[f"{channel}_ma"].to_numpy() for channel in _SCALES},
        scales_deg_per_h_per_ma=scales,
        scales_from=last.id if last is not None and scales else None,
    )


def _no_record() -> NotFound:
    return NotFound(
        problem("no-record", "This measurement has no record of currents; only its means were given.")
    )
