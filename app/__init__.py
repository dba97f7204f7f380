"""Driftbook: the laboratory's book of gyros, stands, sessions and calibrations.

Layers, from the top: `cli`, `main`, `pages` and `api`, `services`, then `exchange`,
`certificates`, `store`, `jobs` and `plots` side by side, and `settings`, `errors` below. Services
are the only glue. import-linter checks it (see pyproject.toml).
"""
