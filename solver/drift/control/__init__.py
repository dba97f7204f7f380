"""Control charts against a frozen baseline: what it is, charts, run rules, and how often they alarm falsely."""
