"""One target: move there, settle, acquire block by block onto the disk, judge. Every piece can be taken up again."""

import zlib
from contextlib import closing
from typing import Final, NoReturn

from app.errors import AppError, problem
from app.station.clock import Clock
from app.station.contracts import Currents, InstrumentFault, Place, StandStatus
from app.station.controls import TargetLeft
from app.station.instruments.stand import apart_deg
from app.station.keeping.blocks import BlockFile
from app.station.keeping.entries import Abandoned, Acquiring, Finding, Judged, Said, Started, Target, Verdict
from app.station.keeping.history import Attempt
from app.station.workplace import Workplace
from solver.errors import Message

_FORGOTTEN: Final = Message(
    "acquisition-forgotten", "The ammeter does not know the acquisition any more; it is begun anew."
)
_MOVED: Final = Message(
    "stand-was-moved", "The stand was moved while nobody looked on; the record is begun anew."
)
_EMPTY: Final = Message("acquisition-empty", "The ammeter acquired nothing; the record is begun anew.")
_TAKEN: Final = Message(
    "ammeter-taken",
    "The ammeter has another acquisition than the one begun here: another program uses it. The record is begun anew.",
)
_UNREST: Final = problem(
    "not-settled", "The currents do not settle. Look for vibration, draughts, a loose plug."
)
_UNSURE: Final = problem(
    "rest-unknown",
    "The currents are too noisy to tell whether they have settled. Look for vibration or a loose plug; if this "
    "noise is the gyro's own, give [settling] in the station's file a longer window_s or a larger limit_na_per_s.",
)
_MOST_LOST: Final = 3
"""Acquisitions lost one after the other; then a person has to see to it."""
_FEWEST: Final = 2
_STANDSTILL_DEG: Final = 1e-3
_STANDSTILL_S: Final = 20.0
_STANDSTILL_LOOKS: Final = 20
"""Also so many looks: at a thousandfold speed seconds pass between two of them."""


class _Lost(Exception):
    """The attempt at hand was abandoned."""


class TakeFailed(AppError):
    """What was being measured cannot be measured now; the problem's code names why."""


def measure(at: Workplace, target: Target) -> None:
    """Bring a target's attempt to its end: judged, or abandoned to be begun anew."""
    attempt = at.history.open_attempt or _begin(at, target)
    with closing(at.spool.blocks(attempt.number)) as blocks:
        try:
            if attempt.acquiring is None:
                _start(at, attempt, approach(at, attempt))
            else:
                _take_up(at, attempt, blocks)
            overload = _collect(at, attempt, blocks)
        except TargetLeft:
            return
        except _Lost:
            _require_progress(at, attempt)
            return
        except (TakeFailed, InstrumentFault) as failed:
            _fail(at, attempt, failed)
            return
        at.lost = 0
        _judge(at, attempt, blocks, overload)


def _require_progress(at: Workplace, attempt: Attempt) -> None:
    """Do not begin anew for ever: raise `TakeFailed` when one acquisition after the other was lost."""
    at.lost += 1
    if at.lost < _MOST_LOST:
        return
    if attempt.abandoned is not None and attempt.abandoned.code == _TAKEN.code:
        raise TakeFailed(
            problem(
                "ammeter-shared",
                "Another program uses the ammeter, and ends this one's acquisitions again and again. Let one program "
                "at a time use it, then start the same command again.",
            )
        )
    raise TakeFailed(
        problem(
            "acquisitions-lost",
            "Three acquisitions were lost one after the other; the log says why. See to it, then start the same "
            "command again.",
        )
    )


def _begin(at: Workplace, target: Target) -> Attempt:
    number = len(at.history.attempts)
    at.spool.add(Started(number, target, at.history.takes_at(target.place)))
    return at.history.attempts[number]


def approach(at: Workplace, attempt: Attempt) -> Currents:
    """Go there and wait for settled currents, the last of them; a further take goes away first, to index anew."""
    target, take = attempt.target, attempt.started.take
    away = _away(at, target) if take else None
    if away is not None:
        go(at, away, target, take)
    go(at, target.place, target, take)
    return settle(at, target, take)


def _away(at: Workplace, target: Target) -> Place | None:
    """The last place but the target's own that the stand did reach."""
    reached = (item.target.place for item in reversed(at.history.attempts) if item.acquiring is not None)
    return next((place for place in reached if place != target.place), None)


def go(at: Workplace, place: Place, target: Target | None = None, take: int = 0) -> None:
    """Move to a place and wait until the encoders confirm it; seek the reference first if there is none.

    Raises
    ------
    TakeFailed
        The stand does not arrive.
    """
    if not at.look().homed:
        home(at)
    at.live.turn_to("moving", target, take)
    at.stand.move(place)
    deadline, progress = at.clock.deadline(at.patience.move_s), _Progress(at.clock)
    while (status := at.look()).moving:
        if deadline.passed or progress.none(status.place):
            at.stand.stop()
            raise TakeFailed(
                problem(
                    "stall",
                    "The stand does not arrive at %(place)s: at %(stands)s it was stopped.",
                    place=shown(place),
                    stands=shown(status.place),
                )
            )
        at.wait()
    _require_at(at, at.look(), place)  # a look whose encoders were asked before it came to rest is of no use


class _Progress:
    """Whether the encoders of a moving stand change at all."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._place: Place | None = None
        self._since_s, self._looks = 0.0, 0

    def none(self, place: Place) -> bool:
        """Take a look in; tell whether there was no change for so long and so many looks that it has stalled."""
        if self._place is None or apart_deg(self._place, place) > _STANDSTILL_DEG:
            self._place, self._since_s, self._looks = place, self._clock.lab_s(), 0
        self._looks += 1
        return self._looks > _STANDSTILL_LOOKS and self._clock.lab_s() - self._since_s > _STANDSTILL_S


def home(at: Workplace) -> None:
    """Seek the reference.

    Raises
    ------
    TakeFailed
        The stand does not find it.
    """
    at.live.turn_to("homing")
    at.stand.home()
    deadline = at.clock.deadline(at.patience.home_s)
    while (status := at.look()).moving:
        if deadline.passed:
            at.stand.stop()
            break
        at.wait()
    if not status.homed:
        raise TakeFailed(
            problem(
                "no-reference", "The stand does not find its reference. Look at the stand, then start again."
            )
        )


def _require_at(at: Workplace, status: StandStatus, place: Place) -> None:
    if not status.homed:
        raise TakeFailed(problem("lost-reference", "The stand lost its reference on the way to %(place)s.",
                                 place=shown(place)))  # fmt: skip
    if apart_deg(status.place, place) > at.at_place_deg:
        raise TakeFailed(
            problem(
                "stall",
                "The stand stands at %(stands)s instead of %(place)s: it stalled, or was moved by hand.",
                stands=shown(status.place),
                place=shown(place),
            )
        )


def settle(at: Workplace, target: Target | None = None, take: int = 0) -> Currents:
    """Wait until the measured currents keep still; the last ones.

    Raises
    ------
    TakeFailed
        They do not.
    """
    at.live.turn_to("settling", target, take)
    still = at.judge.settling()
    deadline = at.clock.deadline(at.patience.settle_s)
    while True:
        at.watch()
        currents = at.ammeter.reading()
        settled = still.add(at.clock.lab_s(), currents)
        at.live.show(currents=currents, settled=settled is True)
        if settled:
            return currents
        if deadline.passed:
            raise TakeFailed(_UNREST if settled is False else _UNSURE)
        at.wait()


def _start(at: Workplace, attempt: Attempt, reading: Currents) -> None:
    begun = at.history.begun
    assert begun is not None
    label = 1 << 30 | (zlib.crc32(begun.run.encode()) & 0xFFFFF) << 10 | (attempt.number & 0x3FF)
    at.spool.add(Acquiring(attempt.number, label, at.clock.now(), reading))
    at.ammeter.start(label, attempt.started.take, begun.samples, begun.rate_hz)


def _take_up(at: Workplace, attempt: Attempt, blocks: BlockFile) -> None:
    """Make sure that an acquisition begun before a break can be gone on with."""
    begun, acquiring = at.history.begun, attempt.acquiring
    assert begun is not None
    assert acquiring is not None
    if blocks.samples >= begun.samples:
        return
    label = at.ammeter.status().label
    if label != acquiring.label:
        # Before its first sample came the acquisition may never have begun: then the label is that of an earlier one.
        _give_up(at, attempt, _TAKEN if label and blocks.samples else _FORGOTTEN)
    status = at.look()
    if status.moving or not status.homed or apart_deg(status.place, attempt.target.place) > at.at_place_deg:
        _give_up(at, attempt, _MOVED)


def _collect(at: Workplace, attempt: Attempt, blocks: BlockFile) -> bool:
    """Bring all samples onto the disk; tell whether the ammeter reported an overload.

    An acquisition that ends with fewer samples than it was asked for is whole: the checks tell what it lacks.
    """
    begun, acquiring = at.history.begun, attempt.acquiring
    assert begun is not None
    assert acquiring is not None
    last = at.live.now.currents
    at.live.turn_to("acquiring", attempt.target, attempt.started.take)
    at.live.show(currents=last, settled=True, fraction=blocks.samples / begun.samples)
    deadline, overload = at.clock.deadline(at.patience.silence_s), False
    had = blocks.samples
    while blocks.samples < begun.samples:
        acquired = at.ammeter.status()
        if acquired.label not in (None, 0, acquiring.label):
            _give_up(at, attempt, _TAKEN)
        if acquired.label == 0 or acquired.samples < blocks.samples:
            _give_up(at, attempt, _FORGOTTEN)
        overload = acquired.overload
        _require_at(at, at.watch(), attempt.target.place)
        ready = min(acquired.samples, begun.samples) - blocks.samples
        if ready >= at.block_samples or (ready and not acquired.running):
            currents = _fetch(at, blocks, min(ready, at.block_samples))
            at.live.show(currents=currents, fraction=blocks.samples / begun.samples)
            deadline = at.clock.deadline(at.patience.silence_s + at.block_samples / begun.rate_hz)
        elif not acquired.running:
            break
        elif deadline.passed:
            at.ammeter.stop()
            raise TakeFailed(problem("ammeter-stalled", "The ammeter acquires, and no samples come."))
        else:
            at.wait()
    if blocks.samples < _FEWEST:
        _give_up(at, attempt, _EMPTY)
    if blocks.samples > had:
        _require_at(at, at.look(), attempt.target.place)  # to the end
    return overload


def _fetch(at: Workplace, blocks: BlockFile, most: int) -> Currents:
    """Bring the next samples onto the disk; their mean."""
    block = at.ammeter.fetch(blocks.samples, most)
    if block.first != blocks.samples or not 0 < len(block.t_s) <= most:
        raise TakeFailed(problem("ammeter-block", "The ammeter gave other samples than those asked for."))
    blocks.append(block)
    return Currents(float(block.jx_ma.mean()), float(block.jy_ma.mean()))


def _judge(at: Workplace, attempt: Attempt, blocks: BlockFile, overload: bool) -> None:
    record, digest = at.spool.keep_record(attempt, blocks)
    findings = tuple(at.judge.findings(record, overload, attempt.target, at.history))
    jx_ma, jy_ma = float(record.jx_ma.mean()), float(record.jy_ma.mean())
    at.spool.add(Judged(attempt.number, worst(findings), findings, jx_ma, jy_ma, digest))


def _fail(at: Workplace, attempt: Attempt, failed: AppError) -> None:
    """Keep a take that came to no record as refused, for its reason; nothing moves on."""
    message = failed.problems[0].message
    at.spool.add(Judged(attempt.number, "refused", (Finding(Said.of(message)),)))
    at.halt()


def _give_up(at: Workplace, attempt: Attempt, why: Message) -> NoReturn:
    at.spool.add(Abandoned(attempt.number, Said.of(why)))
    raise _Lost


def worst(findings: tuple[Finding, ...]) -> Verdict:
    """What a take with these findings is worth."""
    verdicts = {finding.verdict for finding in findings}
    if "refused" in verdicts:
        return "refused"
    return "suspicious" if "suspicious" in verdicts else "accepted"


def shown(place: Place) -> str:
    """A place as people write it."""
    return f"{place.theta_deg:.6g}/{place.psi_deg:.6g}"
