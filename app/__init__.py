"""Driftbook: the laboratory's book of gyros, stands, sessions and calibrations.

Layers, from the top: `cli`, `main`, `pages` and `api`, `services`, then `exchange`,
`certificates`, `store`, `jobs` and `plots` side by side, and `settings`, `errors` below. Services
are the only glue. import-linter checks it (see pyproject.toml).
"""

import os

# Before numpy is loaded. Every matrix here is small: threads of OpenBLAS would wait for each other, and
# cost twice the processor time (the demonstration: 33 s instead of 18 s).
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
