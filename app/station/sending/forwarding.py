"""Records on their way from the station's disk to the service, in a thread of its own.

A record is sent until the service acknowledges it, and the acknowledgement is in the journal before the next
one is sent. With the service away the pauses grow to a minute; measuring goes on meanwhile.
"""

import threading
from collections.abc import Callable
from contextlib import closing
from typing import Final

from app.errors import AppError
from app.station.keeping.entries import Damaged, Opened, Rejected, Said, Sent
from app.station.keeping.history import Attempt
from app.station.keeping.spool import RecordDamaged, Spool
from app.station.sending.client import ServerRefused, Unreachable
from app.station.sending.service import Service
from solver.errors import Message

FIRST_PAUSE_S: Final = 0.5
LONGEST_PAUSE_S: Final = 60.0
_IDLE_S: Final = 0.2
_OF_THE_RECORD: Final = frozenset({400, 413, 415, 422})
"""Refusals that are about the bytes sent, which will not change; any other may be mended at the service."""


class Forwarder(threading.Thread):
    """Sends what is to be sent until `stop`.

    Attributes
    ----------
    trouble
        Why nothing can be sent just now; None when all is well.
    refused
        The service's answer when it answers and takes nothing.
    failed
        What ended the thread against its will.
    """

    def __init__(
        self, spool: Spool, service: Callable[[], Service], first_pause_s: float = FIRST_PAUSE_S
    ) -> None:
        super().__init__(name="forwarding", daemon=True)
        self.trouble: str | None = None
        self.refused: ServerRefused | None = None
        self.failed: BaseException | None = None
        self._spool, self._service = spool, service
        self._first_pause_s = first_pause_s
        self._end = threading.Event()

    def run(self) -> None:
        """Work until told to stop."""
        try:
            with closing(self._service()) as service:
                pause_s = self._first_pause_s
                while not self._end.is_set():
                    pause_s = self._piece(service, pause_s)
        except BaseException as error:  # the cycle raises it: nothing is lost silently in a thread
            self.failed = error

    def stop(self) -> None:
        """End after the request at hand."""
        self._end.set()
        self._spool.news.set()
        self.join()

    def _piece(self, service: Service, pause_s: float) -> float:
        """Do the next piece of work, or wait; give the pause after the next failure."""
        try:
            worked = self._forward(service)
        except (Unreachable, ServerRefused) as error:
            self._tell(error)
            self._end.wait(pause_s)
            return min(2.0 * pause_s, LONGEST_PAUSE_S)
        if worked:
            self._mended()
        else:
            self._spool.news.wait(_IDLE_S)
            self._spool.news.clear()
        return self._first_pause_s

    def _forward(self, service: Service) -> bool:
        """Open the session or send one record; False when there is nothing to do."""
        with self._spool.lock:
            begun, session = self._spool.history.begun, self._spool.history.session
            waiting, planned = self._spool.history.to_send(), bool(self._spool.history.places)
        if (
            begun is None or not planned
        ):  # nothing is opened for a run whose instruments have not answered yet
            return False
        if session is None:
            self._spool.add(Opened(service.open_session(begun)))
            return True
        if not waiting:
            return False
        self._send(service, session, waiting[0])
        return True

    def _send(self, service: Service, session: int, attempt: Attempt) -> None:
        try:
            content = self._spool.record(attempt)
            service.put_record(session, attempt, content)
        except RecordDamaged as damaged:
            self._spool.add(Damaged(attempt.number, Said.of(damaged.problems[0].message)))
        except ServerRefused as refused:
            if refused.answered not in _OF_THE_RECORD:
                raise
            self._spool.add(Rejected(attempt.number, Said.of(refused.problems[0].message)))
        else:
            self._spool.add(Sent(attempt.number))

    def _tell(self, error: AppError) -> None:
        message = error.problems[0].message
        if self.trouble is None or (isinstance(error, ServerRefused) and self.trouble != message.text):
            self._spool.note("warning", message)
        self.trouble = message.text
        self.refused = error if isinstance(error, ServerRefused) else None

    def _mended(self) -> None:
        if self.trouble is not None:
            self._spool.note("info", Message("server-back", "The service answers again."))
        self.trouble = self.refused = None
