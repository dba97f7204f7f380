"""A run put together from its parts, and lived through once: from the lock on its folder to its release."""

import uuid
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Final

from app.errors import Invalid, problem
from app.station.clock import Clock
from app.station.contracts import Place
from app.station.controls import Controls
from app.station.cycle import Cycle
from app.station.finishing import Finishing
from app.station.instruments.ammeter import DescribedAmmeter
from app.station.instruments.description import StationFile
from app.station.instruments.opening import open_ammeter, open_stand
from app.station.instruments.stand import DescribedStand, check_travel
from app.station.judging import Rules
from app.station.keeping import runs
from app.station.keeping.entries import Begun, Entry, Resumed
from app.station.keeping.history import History
from app.station.keeping.spool import Spool
from app.station.preparing import Memory, Preparing
from app.station.sending.forwarding import Forwarder
from app.station.sending.live import Live
from app.station.sending.reporting import PATIENCE_S, Reporter
from app.station.sending.service import Service
from app.station.workplace import Patience, Workplace

_SIMULATED: Final = "Driftbook,SIM-"


@dataclass(frozen=True, slots=True)
class Orders:
    """What a person asked for.

    Attributes
    ----------
    places
        Positions, where the certificate's are not meant.
    leave_out
        Whether to ask for the calibration without positions that could not be measured.
    attended, release
        As for `Cycle`.
    station
        What people call this computer.
    """

    gyro: str
    stand: str
    server: str
    token: str
    method: str
    station: str
    certificate: str | None = None
    temperature_c: float | None = None
    gyro_type: str | None = None
    places: tuple[Place, ...] = ()
    leave_out: bool = False
    attended: bool = False
    release: bool = False

    def service(self, timeout_s: float = 60.0) -> Service:
        """A new connection to the service."""
        return Service(self.server, self.token, timeout_s)


def live_through(
    orders: Orders,
    described: StationFile,
    folder: Path,
    clock: Clock,
    controls: Controls,
    told: Callable[[Entry, History], None] | None = None,
) -> History:
    """Begin the run of a folder, or go on with it, until nothing is left to do.

    Returns
    -------
    History
        Of the whole run; `finished` says what its calibration lacks.

    Raises
    ------
    Invalid
        The service's address is none, or real instruments are to be hurried; nothing was begun.
    AppError
        It cannot be begun or gone on with now; the folder keeps what there is.
    StopAsked
        Somebody ended it; likewise.
    """
    _require_real_time(described, clock)
    orders.service().close()  # refuses what is no address
    with Spool(folder, told) as spool:
        _begin(spool, orders, described)
        live = Live()
        with ExitStack() as instruments, _helpers(orders, spool, live, controls) as (forwarder, reporter):
            stand = instruments.enter_context(closing(open_stand(described.stand)))
            ammeter = instruments.enter_context(closing(open_ammeter(described.ammeter)))
            at = _workplace(described, spool, stand, ammeter, clock, controls, live)
            at.helpers = (forwarder, reporter)
            preparing = Preparing(
                spool,
                orders.service,
                Memory(runs.home() / "certificates.json"),
                partial(check_travel, described.stand),
                orders.places,
                orders.gyro_type,
            )
            finishing = Finishing(at, forwarder, orders.service, orders.method, orders.leave_out)
            Cycle(at, preparing, finishing, orders.attended, orders.release).run()
        return spool.history


def _require_real_time(described: StationFile, clock: Clock) -> None:
    """Only what is simulated can be hurried: a gyro would be taken for warm, and for settled, long before it is."""
    identities = (described.stand.identity.pattern, described.ammeter.identity.pattern)
    if clock.speed != 1.0 and not all(pattern.startswith(_SIMULATED) for pattern in identities):
        raise Invalid(
            problem(
                "real-time",
                "Real instruments take their time. Leave it out; it is for simulated ones, whose identity in the "
                "station's file begins with %(begin)s.",
                column="--speed",
                begin=_SIMULATED,
            )
        )


def _begin(spool: Spool, orders: Orders, described: StationFile) -> None:
    record = described.recording
    wanted = Begun(
        run=str(uuid.uuid4()), gyro=orders.gyro, stand=orders.stand, started_at=datetime.now(UTC),
        samples=round(record.duration_s * record.rate_hz), rate_hz=record.rate_hz,
        certificate=orders.certificate, temperature_c=orders.temperature_c,
    )  # fmt: skip
    runs.require_same(spool.folder, spool.history, wanted, orders.places)
    earlier = spool.history.begun
    # The run's name is the key of its session: begun twice with the same words it must stay one.
    again = earlier and replace(wanted, run=earlier.run, started_at=earlier.started_at)
    if earlier is None or (not spool.history.places and again != earlier):
        spool.add(wanted)
    spool.add(Resumed())


@contextmanager
def _helpers(
    orders: Orders, spool: Spool, live: Live, controls: Controls
) -> Iterator[tuple[Forwarder, Reporter]]:
    forwarder = Forwarder(spool, orders.service)
    reporter = Reporter(orders.station, spool, live, controls, lambda: orders.service(PATIENCE_S))
    forwarder.start()
    reporter.start()
    try:
        yield forwarder, reporter
    finally:
        forwarder.stop()
        reporter.stop()


def _workplace(
    described: StationFile,
    spool: Spool,
    stand: DescribedStand,
    ammeter: DescribedAmmeter,
    clock: Clock,
    controls: Controls,
    live: Live,
) -> Workplace:
    return Workplace(
        spool=spool,
        stand=stand,
        ammeter=ammeter,
        judge=Rules(
            described.settling, described.warm_up, described.checks, described.types, described.ammeter.largest_ma
        ),
        clock=clock,
        controls=controls,
        live=live,
        patience=Patience(
            described.stand.homing_s, described.stand.moving_s, described.settling.allowed_s,
            described.warm_up.allowed_s,
        ),
        at_place_deg=described.stand.arrival_deg,
        block_samples=round(described.recording.block_samples),
    )  # fmt: skip
