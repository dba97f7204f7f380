"""Background jobs: accepted once, computed in a child process, finished or failed in plain words.

::

    services ── engine.JobEngine.enqueue(session, job_id)      in the transaction that stores the input
                       │  DBOS: durable queue in the same database, survives kill -9
                       ▼
                runner.Run ── process.compute ──► child         a forkserver child that can be killed
                       │
                       ▼
                ledger.Ledger                             the service's own rows: attempts, progress, result

- `engine.JobEngine` starts and stops the engine, enqueues and cancels.
- `ledger.Task` says what a child computes; `ledger.Ledger` is what the services implement over their
  ``job`` table. The ledger is the truth about a job. DBOS only says that a job must be looked at, at
  least once; a job seen twice is harmless, because `Ledger.begin` answers None.
- `problems` holds the sentences a failed job ends with.
- `tables.DBOS_TABLES` names the tables that are DBOS's, for Alembic's ``include_name``.

This package alone imports dbos. Nothing here is imported on loading the package itself: the child
server loads `child` and must stay small.
"""
