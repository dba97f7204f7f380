"""The job engine: DBOS inside, nothing of it outside."""

import asyncio
import logging
import threading
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import ClassVar, Final

import filelock
import sqlalchemy as sa
import structlog
from dbos import DBOS, DBOSClient, EnqueueOptions
from sqlalchemy.orm import Session

from app.errors import Conflict, problem
from app.jobs import process
from app.jobs.database import make_engine, provide_unixepoch
from app.jobs.housekeeping import Housekeeper
from app.jobs.ledger import Ledger, Task
from app.jobs.runner import Abandoned, Run, Runs

__all__ = ["JobEngine", "Ledger", "Task", "migrate"]

_APPLICATION: Final = "driftbook"
_QUEUE: Final = "driftbook-jobs"
_WORKFLOW: Final = "run_job"
# Pinned: left to itself DBOS makes it of the source and its own version, and strands what was queued
# before an upgrade. Nothing of a job lies in DBOS but its id, so one version does for ever.
_VERSION: Final = "1"
# The ledger counts attempts and decides; this only ends what never reaches the ledger.
_MAX_RECOVERIES: Final = 200
_KILL_S: Final = 10.0
_log = structlog.get_logger(__name__)


def migrate(database_url: str) -> None:
    """Create or upgrade DBOS's tables; a working engine does it by itself at its start."""
    with ExitStack() as undo:
        _migrate(_connect(database_url, undo)[1])


class JobEngine:
    """Runs jobs in child processes; what is enqueued survives any crash.

    Parameters
    ----------
    database_url
        The store's database: an SQLite file, or PostgreSQL. Jobs share it to be enqueued in the
        store's transactions.
    ledger
        The jobs' own rows.
    slots
        How many jobs may compute at once in this process.
    executor_id
        Name of this worker: stable, because only a worker of the same name takes up what it left
        behind, and unique among the living, because it would take it up from a living one too.
    poll_s
        How often the queue is looked at, s.
    preload
        Modules every child process is born with.
    """

    _working: ClassVar[threading.Lock] = threading.Lock()  # DBOS is one per process

    def __init__(
        self,
        database_url: str,
        ledger: Ledger,
        *,
        slots: int,
        executor_id: str = "embedded",
        poll_s: float = 0.1,
        preload: Sequence[str] = (),
    ) -> None:
        self._url = sa.make_url(database_url).render_as_string(hide_password=False)
        self._ledger = ledger
        self._slots = slots
        self._executor_id = executor_id
        self._poll_s = poll_s
        self._preload = preload
        self._runs = Runs()
        self._client: DBOSClient | None = None
        self._dbos: DBOS | None = None
        self._closing = ExitStack()

    def start(self, *, work: bool = True) -> None:
        """Begin to work, interrupted jobs of this worker included; not inside an event loop.

        Parameters
        ----------
        work
            False: only enqueue and cancel, for workers elsewhere; DBOS's tables must exist (`migrate`).

        Raises
        ------
        Conflict
            When a worker of this name works on this database already.
        """
        _refuse_in_event_loop()
        if self._client is not None:
            raise RuntimeError("the job engine is started already")
        with ExitStack() as undo:
            if work:
                self._claim(undo)
            engine, client = _connect(self._url, undo)
            self._runs = Runs()
            if work:
                process.warm(self._preload)
                self._launch(engine, client, undo)
                self._keep_house(client, undo)
            self._client = client
            self._closing = undo.pop_all()

    def stop(self, *, grace_s: float = 5) -> None:
        """Take up nothing more, wait a little for what runs, kill the rest, and close everything.

        What was killed is taken up again at the next start.
        """
        if self._client is None:
            return
        if self._dbos is not None:
            self._drain(self._dbos, grace_s)
        self._closing.close()
        self._client = self._dbos = None

    def enqueue(self, session: Session, job_id: str, *, priority: int = 100) -> None:
        """Enqueue in the caller's transaction: the job exists when, and only when, it is committed.

        Parameters
        ----------
        session
            A writing session on the same database.
        job_id
            Enqueued twice it is one job.
        priority
            1 is first; equal ones keep their order.
        """
        provide_unixepoch(session.connection())
        options: EnqueueOptions = {
            "queue_name": _QUEUE,
            "workflow_name": _WORKFLOW,
            "workflow_id": job_id,
            "app_version": _VERSION,
            "priority": priority,
        }
        self._started.enqueue_in_transaction(session, options, job_id)

    def cancel(self, job_id: str) -> None:
        """Stop a job whose row in the ledger is cancelled already (and committed)."""
        run = self._runs.get(job_id)
        if run is not None:
            run.cancel()
        else:
            self._started.cancel_workflow(job_id)

    @property
    def _started(self) -> DBOSClient:
        if self._client is None:
            raise RuntimeError("the job engine is not started")
        return self._client

    def _claim(self, undo: ExitStack) -> None:
        """Be the only worker in this process, and of this name on this database."""
        if not self._working.acquire(blocking=False):
            raise RuntimeError("another job engine works in this process; one of them is enough")
        undo.callback(self._working.release)
        url = sa.make_url(self._url)
        if url.get_backend_name() == "sqlite" and url.database:
            path = Path(f"{url.database}.{self._executor_id}.lock")
            lock = filelock.FileLock(path, thread_local=False)
            try:
                lock.acquire(blocking=False)
            except filelock.Timeout:
                raise Conflict(
                    problem(
                        "already-running",
                        "Driftbook is running on %(database)s already. Use that one, or stop it first.",
                        database=url.database,
                    )
                ) from None
            undo.callback(lock.release)

    def _launch(self, engine: sa.Engine, client: DBOSClient, undo: ExitStack) -> None:
        # Before the launch, whose threads read the queue's settings at once.
        _migrate(client)
        client.register_queue(_QUEUE, worker_concurrency=self._slots, polling_interval_sec=self._poll_s)

        def is_cancelled(job_id: str) -> bool:
            flows = client.list_workflows(
                workflow_ids=[job_id], status="CANCELLED", load_input=False, load_output=False
            )
            return bool(flows)

        # A new registry for every launch; this function is its only workflow.
        @DBOS.workflow(name=_WORKFLOW, max_recovery_attempts=_MAX_RECOVERIES)
        def run_job(job_id: str) -> None:
            self._work(Run(job_id, self._ledger, is_cancelled))

        undo.callback(DBOS.destroy, destroy_registry=True)
        _log_through_structlog()
        self._dbos = DBOS(
            config={
                "name": _APPLICATION,
                "system_database_engine": engine,
                "application_version": _VERSION,
                "executor_id": self._executor_id,
                "log_level": "WARNING",
                "enable_otlp": False,
                "notification_listener_polling_interval_sec": 0.25,  # idle; only delays the stop
            }
        )
        DBOS.launch()

    def _keep_house(self, client: DBOSClient, undo: ExitStack) -> None:
        housekeeper = Housekeeper(
            client,
            self._ledger,
            queue=_QUEUE,
            executor_id=self._executor_id,
            is_running=lambda job_id: self._runs.get(job_id) is not None,
        )
        housekeeper.start()
        undo.callback(housekeeper.stop)

    def _work(self, run: Run) -> None:
        if not self._runs.enter(run):
            raise Abandoned  # the other run will tell the outcome; should it not, the job comes again
        try:
            run.execute()
        except Exception:
            _log.exception("job-left", job=run.job_id)
            raise Abandoned from None
        finally:
            self._runs.leave(run)

    def _drain(self, dbos: DBOS, grace_s: float) -> None:
        for stop in dbos.background_thread_stop_events:  # nothing more is taken from the queue
            stop.set()
        if not self._runs.wait_until_none(grace_s):
            self._runs.abandon()
        # DBOS's destroy() does not wait for threads that are just writing an outcome, or only in seconds.
        end = time.monotonic() + _KILL_S
        while dbos._active_workflows_set.activeList():
            if time.monotonic() > end:
                _log.error("jobs-not-stopped", jobs=dbos._active_workflows_set.activeList())
                return
            time.sleep(0.02)


def _connect(url: str, undo: ExitStack) -> tuple[sa.Engine, DBOSClient]:
    engine = make_engine(url)
    undo.callback(engine.dispose)
    client = DBOSClient(system_database_engine=engine, application_name=_APPLICATION, lazy=True)
    undo.callback(client.destroy)
    return engine, client


def _migrate(client: DBOSClient) -> None:
    # DBOS.migrate() would make a connection of its own, without what database.py does to it.
    client._sys_db.run_migrations()


def _refuse_in_event_loop() -> None:
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return
    raise RuntimeError("start the job engine outside the event loop: await asyncio.to_thread(engine.start)")


class _ThroughStructlog(logging.Handler):
    """DBOS's warnings in the service's own log instead of DBOS's stream."""

    def emit(self, record: logging.LogRecord) -> None:
        structlog.get_logger(record.name).log(record.levelno, record.getMessage(), exc_info=record.exc_info)


def _log_through_structlog() -> None:
    logger = logging.getLogger("dbos")
    if not any(isinstance(handler, _ThroughStructlog) for handler in logger.handlers):
        logger.addHandler(_ThroughStructlog())
        logger.propagate = False
