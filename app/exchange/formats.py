"""Which format a file has is told by its first bytes, never by its name."""

import io
import zipfile
from typing import Literal

from app.exchange.columnar import read_npz, read_parquet
from app.exchange.compression import unpack
from app.exchange.csv_table import read_csv
from app.exchange.headers import quantity_of
from app.exchange.problems import refuse
from app.exchange.table import Table

Kind = Literal["certificate", "means", "record"]

_PARQUET = b"PAR1"
_ZIP = (b"PK\x03\x04", b"PK\x05\x06")


def open_table(data: bytes, filename: str) -> Table:
    """Read CSV, Parquet or npz, as it is or compressed by gzip or zstd.

    Parameters
    ----------
    data
        The whole file.
    filename
        Its name as the user gave it, for the problems.

    Raises
    ------
    Invalid
        Naming what is wrong, where, and what to do.
    """
    plain = unpack(data, filename)
    if plain.startswith(_PARQUET):
        return read_parquet(plain, filename)
    if plain.startswith(_ZIP):
        _refuse_spreadsheet(plain, filename)
        return read_npz(plain, filename)
    return read_csv(plain, filename)


def _refuse_spreadsheet(data: bytes, filename: str) -> None:
    try:
        names = zipfile.ZipFile(io.BytesIO(data)).namelist()
    except (zipfile.BadZipFile, OSError, ValueError, RuntimeError, NotImplementedError):
        return  # the npz reader says that it is damaged
    if "[Content_Types].xml" in names or "mimetype" in names:
        raise refuse(
            "spreadsheet",
            "This is a spreadsheet. Save the sheet as “CSV UTF-8” and bring that file.",
            file=filename,
        )
    if not any(name.endswith(".npy") for name in names):
        raise refuse(
            "not-a-table",
            "This ZIP archive holds no columns. Bring it as a whole session, or bring the files in it.",
            file=filename,
        )


def kind_of(table: Table) -> Kind | None:
    """Tell what a table holds from its columns; None when it is none of the known files."""
    split = [quantity_of(name) for name in table.names]
    quantities = {item[0] for item in split if item}
    if "t" in quantities:
        return "record"
    if quantities & {"jx", "jy"}:
        return "means"
    return "certificate" if quantities & {"alpha", "beta", "gamma"} else None
