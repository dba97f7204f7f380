"""What comes next: a conclusion from the journal alone, so that a station started again draws the same one."""

from dataclasses import dataclass

from app.station.keeping.entries import Target
from app.station.keeping.history import History


@dataclass(frozen=True, slots=True)
class Prepare:
    """Find out which positions there are."""


@dataclass(frozen=True, slots=True)
class WarmUp:
    """Wait at the first position until the currents no longer creep."""


@dataclass(frozen=True, slots=True)
class Measure:
    """Go on with a target's attempt, or begin one."""

    target: Target


@dataclass(frozen=True, slots=True)
class Compare:
    """See the takes that count beside each other."""


@dataclass(frozen=True, slots=True)
class Forward:
    """Wait until the service has everything."""


@dataclass(frozen=True, slots=True)
class Solve:
    """Ask the service for the calibration and wait for it."""


@dataclass(frozen=True, slots=True)
class Finish:
    """Nothing is left to do."""


Step = Prepare | WarmUp | Measure | Compare | Forward | Solve | Finish


def next_step(history: History, *, leave_out: bool) -> Step:
    """Draw the conclusion.

    Parameters
    ----------
    history
        What the journal says.
    leave_out
        Whether the calibration shall be asked for without the positions that could not be measured. One that
        the service has in an earlier take cannot be left out from here.
    """
    if not history.places:
        return Prepare()
    attempt = history.open_attempt
    if attempt is not None and attempt.acquiring is not None:
        return Measure(attempt.target)  # what the ammeter has acquired is brought home before anything moves
    if attempt is None and not history.compared:
        return Compare()
    target = attempt.target if attempt is not None else next(filter(history.wanted, history.targets), None)
    if target is not None:
        return Measure(target) if history.warmed else WarmUp()
    if history.session is None or history.to_send():
        return Forward()
    if history.result is None and all(
        leave_out and not history.on_server(target) for target in missing(history)
    ):
        return Solve()
    return Finish()


def missing(history: History) -> tuple[Target, ...]:
    """Targets that the calibration lacks against the operator's will, in the cycle's order."""
    wanted = (target for target in history.targets if target not in history.skipped)
    return tuple(target for target in wanted if not _is_there(history, target))


def _is_there(history: History, target: Target) -> bool:
    take = history.usable(target)
    return take is not None and take.rejected is None
