"""The tests in a browser need packages of their own (group ``browser``); the others do without."""

from importlib.util import find_spec

collect_ignore = [] if find_spec("playwright") else ["browser"]
