"""What every test stands on."""

import os

# Tests run side by side; threads of the linear algebra would only wait for each other's processors.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from importlib.util import find_spec

from hypothesis import HealthCheck, settings

# The tests in a browser need packages of their own (group ``browser``); the others do without.
collect_ignore = [] if find_spec("playwright") else ["browser"]

# No assertion on time: a machine may be busy.
settings.register_profile("house", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("house")
