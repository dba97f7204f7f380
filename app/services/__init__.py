"""Use cases: what people and machines do with the laboratory. The only glue between the layers below.

A service takes a `Work` (one transaction, see `lab`) and plain values, and gives frozen views; it
knows no HTTP and never commits. Errors are `app.errors`.
"""
