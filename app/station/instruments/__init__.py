"""Instruments: described in TOML, spoken to over VISA; another stand or ammeter is another description."""
