"""A service that does nothing but jobs, to be killed: worker.py DATABASE EXECUTOR.

It deliberately has no ``if __name__ == "__main__"``: were it imported in a child, as multiprocessing
does with main scripts, the child would refuse to start a service of its own and fail the job.
"""

import sys
import threading
from pathlib import Path

from keeping import Jobs

from app.jobs.engine import JobEngine

jobs = Jobs(Path(sys.argv[1]))
engine = JobEngine(jobs.url, jobs, slots=2, executor_id=sys.argv[2])
engine.start()
sys.stdout.write("ready\n")
sys.stdout.flush()
threading.Event().wait()
