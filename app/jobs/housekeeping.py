"""What DBOS leaves to its paid service: old rows, and jobs that nobody looks at."""

import threading
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import Final

import structlog
from dbos import DBOSClient

from app.jobs import problems
from app.jobs.ledger import Ledger

_FINISHED: Final = ["SUCCESS", "CANCELLED", "ERROR"]
_GIVEN_UP: Final = "MAX_RECOVERY_ATTEMPTS_EXCEEDED"
_BATCH: Final = 500
_log = structlog.get_logger(__name__)


class Housekeeper:
    """A thread that keeps DBOS's rows in order.

    Parameters
    ----------
    client, queue, executor_id
        DBOS, our queue and our name there.
    ledger
        Told of the jobs that DBOS gave up.
    is_running
        Whether a job runs in this process.
    every_s
        Time between two rounds, s. A job that is ours but not running for so long is put into the
        queue again.
    keep
        How long rows of finished jobs are kept. Nothing of ours needs them.
    """

    def __init__(
        self,
        client: DBOSClient,
        ledger: Ledger,
        *,
        queue: str,
        executor_id: str,
        is_running: Callable[[str], bool],
        every_s: float = 60,
        keep: timedelta = timedelta(days=3),
    ) -> None:
        self._client = client
        self._ledger = ledger
        self._queue = queue
        self._executor_id = executor_id
        self._is_running = is_running
        self._every_s = every_s
        self._keep = keep
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._loop, name="driftbook-jobs-housekeeping", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """End and wait for the end."""
        self._stop.set()
        self._thread.join()

    def _loop(self) -> None:
        while not self._stop.is_set():
            self._do(self.fail_given_up, self.delete_old)
            if not self._stop.wait(self._every_s):
                # Not sooner: just after the start DBOS itself queues again what it finds interrupted.
                self._do(self.requeue_stranded)

    def _do(self, *chores: Callable[[], None]) -> None:
        for chore in chores:
            try:
                chore()
            except Exception:
                # The database may be away for a while; the next round comes.
                _log.exception("jobs-housekeeping", chore=chore.__name__)

    def requeue_stranded(self) -> None:
        """Queue again what we took from the queue and do not work on.

        Its attempt ended in an error of the database's, say, which left no outcome behind.
        """
        before_ms = (time.time() - self._every_s) * 1000
        stranded = [
            flow.workflow_id
            for flow in self._client.list_workflows(
                status="PENDING", executor_id=self._executor_id, load_input=False, load_output=False
            )
            if (flow.updated_at or 0) < before_ms and not self._is_running(flow.workflow_id)
        ]
        if stranded:
            _log.warning("jobs-requeued", jobs=stranded)
            self._client.resume_workflows(stranded, queue_name=self._queue)

    def fail_given_up(self) -> None:
        """Fail what DBOS itself gave up: the service died each time before the ledger was asked."""
        for flow in self._client.list_workflows(
            status=_GIVEN_UP, limit=_BATCH, load_input=False, load_output=False
        ):
            self._ledger.fail(flow.workflow_id, [problems.given_up(flow.recovery_attempts or 0)])
            self._client.delete_workflows([flow.workflow_id])

    def delete_old(self) -> None:
        """Delete DBOS's rows of jobs finished long ago, in short transactions."""
        before = (datetime.now(UTC) - self._keep).isoformat()
        while not self._stop.is_set():
            old = self._client.list_workflows(
                status=_FINISHED, completed_before=before, limit=_BATCH, load_input=False, load_output=False
            )
            if not old:
                return
            self._client.delete_workflows([flow.workflow_id for flow in old])
