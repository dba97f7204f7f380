"""A whole session as files, a folder's or a ZIP archive's: what each file is, and what it holds."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import PurePosixPath
from typing import Final, TypeVar

from app.errors import Invalid, Problem, problem
from app.exchange.certificate import read_certificate
from app.exchange.formats import Kind, kind_of, open_table
from app.exchange.means import read_means
from app.exchange.parameters import read_parameters
from app.exchange.positions import Positions
from app.exchange.problems import SHOWN
from app.exchange.records import means_row, position_of, read_record
from app.exchange.rows import CertificateRow, CurrentRecord, Facts, MeansRow
from app.exchange.session_json import FILE_NAME, Entry, read_session_json
from solver.errors import Message

TRUTH: Final = "truth.json"
_TABLES: Final = (".csv", ".txt", ".parquet", ".npz")
_PACKED: Final = (".gz", ".zst", ".zstd")
_BY_STEM: Final[Mapping[str, Kind]] = {"certificate": "certificate", "means": "means", "currents": "means"}

Row = TypeVar("Row")


@dataclass(frozen=True, slots=True)
class SessionFiles:
    """What the files of a session hold, each in its own order; empty or None where there is nothing.

    `truth` has the true parameters of a simulated session, in laboratory units.
    """

    facts: Facts = field(default_factory=Facts)
    means: Sequence[MeansRow] = ()
    records: Sequence[CurrentRecord] = ()
    certificate: Sequence[CertificateRow] = ()
    truth: Mapping[str, float] | None = None
    warnings: Sequence[Message] = ()

    def measured(self) -> list[MeansRow]:
        """Means of every measurement: those of the records, and those given for other positions."""
        rows = [means_row(record) for record in self.records]
        recorded = Positions()
        for row in rows:
            recorded.put(row.theta_deg, row.psi_deg)
        return rows + [row for row in self.means if recorded.find(row.theta_deg, row.psi_deg) is None]


def read_session(files: Mapping[str, bytes], name: str = "") -> SessionFiles:
    """Read the files of one session.

    `session.json` says what belongs to it; without it records are found by their names
    (``theta090_psi270.csv``), and the certificate, the means and a long record by theirs or by
    their columns.

    Parameters
    ----------
    files
        Names, with ``/`` between folders, and contents; read one at a time.
    name
        Of the folder or archive, for the problems.

    Raises
    ------
    Invalid
        With the problems of every file.
    """
    gathering = _Gathering(files)
    session = gathering.everything()
    if not gathering.problems and not (session.records or session.means):
        gathering.problems.append(
            problem(
                "no-measurement",
                "There is no measurement. A session has record files named like theta090_psi270.csv, a file "
                "means.csv, or a session.json that lists its files.",
                file=name or None,
            )
        )
    if gathering.problems:
        raise Invalid(*gathering.shown())
    return session


class _Gathering:
    """Reads file after file, keeping the problems and warnings of all."""

    def __init__(self, files: Mapping[str, bytes]) -> None:
        self._files = files
        self._left = {name for name in files if _is_table(name)}
        self.problems: list[Problem] = []
        self.warnings: list[Message] = []

    def shown(self) -> list[Problem]:
        """The first problems, and how many more there are."""
        further = len(self.problems) - SHOWN
        if further <= 0:
            return self.problems
        last = problem(
            "more-problems",
            "… and %(count)d more problems. Mend these first, then read the files again.",
            count=further,
        )
        return [*self.problems[:SHOWN], last]

    def everything(self) -> SessionFiles:
        facts, entries = self._description()
        roles = self._roles(facts, entries)
        records = self._listed(entries) if entries else self._named(roles)
        means = self._only("means", roles, read_means)
        certificate = self._only("certificate", roles, read_certificate)
        truth = self._truth()
        ignored = sorted(self._left)
        if ignored:
            listed = ", ".join(ignored[:12]) + (", …" if len(ignored) > 12 else "")
            self.warnings.append(
                Message("file-ignored", "These files are not used: %(files)s.", {"files": listed})
            )
        return SessionFiles(facts, means, records, certificate, truth, self.warnings)

    def _description(self) -> tuple[Facts, list[Entry]]:
        if FILE_NAME not in self._files:
            return Facts(), []
        try:
            return read_session_json(self._files[FILE_NAME], FILE_NAME)
        except Invalid as error:
            self.problems += error.problems
            return Facts(), []

    def _truth(self) -> dict[str, float] | None:
        if TRUTH not in self._files:
            return None
        try:
            known = read_parameters(self._files[TRUTH], TRUTH)
        except Invalid as error:  # nothing is computed from it: the session is as good without
            why = {"file": TRUTH, "why": error.problems[0].text}
            self.warnings.append(Message("truth-unreadable", "%(file)s is not used: %(why)s", why))
            return None
        return {parameter: item.value for parameter, item in known.items()}

    def _rows(self, read: Callable[[bytes, str], tuple[list[Row], list[Message]]], name: str) -> list[Row]:
        """Read one file, keeping its problems and warnings."""
        self._left.discard(name)
        try:
            rows, warnings = read(self._files[name], name)
        except Invalid as error:
            self.problems += error.problems
            return []
        self.warnings += warnings
        return rows

    def _roles(self, facts: Facts, entries: Sequence[Entry]) -> dict[str, Kind | None]:
        """What each table is that is no record listed or named by its position."""
        roles: dict[str, Kind | None] = {}
        listed = {entry.file for entry in entries}
        for name in sorted(self._left - listed):
            if name == facts.certificate:
                roles[name] = "certificate"
            elif position_of(name) is None:
                roles[name] = self._kind(name)
        if facts.certificate in self._files:
            return {n: k for n, k in roles.items() if k != "certificate" or n == facts.certificate}
        if facts.certificate and _is_table(facts.certificate):
            message = Message(
                "no-file",
                "The file %(name)s is not in the session. Add it, or correct its name.",
                {"name": facts.certificate[:80]},
            )
            self.problems.append(Problem(message, file=FILE_NAME, column="/certificate"))
        return roles

    def _kind(self, name: str) -> Kind | None:
        by_stem = _BY_STEM.get(stem_of(name))
        try:
            return kind_of(open_table(self._files[name], name)) or by_stem
        except Invalid:
            return by_stem  # a file known by its name is read again, which tells its problems

    def _only(
        self,
        kind: Kind,
        roles: Mapping[str, Kind | None],
        read: Callable[[bytes, str], tuple[list[Row], list[Message]]],
    ) -> list[Row]:
        """Read the one file of a kind."""
        names = [name for name, role in roles.items() if role == kind]
        if len(names) > 1:
            message = Message(
                "several-files",
                "There are several files of one kind (%(kind)s): %(files)s. Keep one of them in the session.",
                {"kind": kind, "files": ", ".join(names[:12])},
            )
            self.problems.append(Problem(message, file=names[1]))
            return []
        return self._rows(read, names[0]) if names else []

    def _listed(self, entries: Sequence[Entry]) -> list[CurrentRecord]:
        """Records that `session.json` lists; those without a repeat are numbered in its order."""
        records: list[tuple[CurrentRecord, Problem, bool]] = []
        for entry in entries:
            pointer = f"{entry.pointer}/file"
            if entry.file not in self._files:
                message = Message(
                    "no-file",
                    "The file %(name)s is not in the session. Add it, or correct its name.",
                    {"name": entry.file[:80]},
                )
                self.problems.append(Problem(message, file=FILE_NAME, column=pointer))
                continue
            for record in self._rows(_reader(entry), entry.file):
                twice = _twice(record, FILE_NAME, f"{entry.pointer}/repeat")
                records.append((record, twice, entry.repeat is not None or record.repeat > 0))
        return self._numbered(records)

    def _named(self, roles: Mapping[str, Kind | None]) -> list[CurrentRecord]:
        """Records found by their names, and long ones found by their columns."""
        names = [n for n in sorted(self._left) if position_of(n) or roles.get(n) == "record"]
        return self._numbered(
            [
                (record, _twice(record, name, None), True)
                for name in names
                for record in self._rows(read_record, name)
            ]
        )

    def _numbered(self, records: Sequence[tuple[CurrentRecord, Problem, bool]]) -> list[CurrentRecord]:
        """Give repeats without a number the next free one; the same number twice is a problem."""
        known = Positions()
        taken: set[tuple[int, int]] = set()
        numbers = [known.put(record.theta_deg, record.psi_deg) for record, _, _ in records]
        for number, (record, twice, counted) in zip(numbers, records, strict=True):
            if counted and (number, record.repeat) in taken:
                self.problems.append(twice)
            if counted:
                taken.add((number, record.repeat))
        result: list[CurrentRecord] = []
        for number, (record, _, counted) in zip(numbers, records, strict=True):
            repeat = record.repeat if counted else next(_free(number, taken))
            taken.add((number, repeat))
            result.append(replace(record, repeat=repeat))
        return result


def _free(number: int, taken: set[tuple[int, int]]) -> Iterator[int]:
    return (repeat for repeat in range(len(taken) + 1) if (number, repeat) not in taken)


def _reader(entry: Entry) -> Callable[[bytes, str], tuple[list[CurrentRecord], list[Message]]]:
    return lambda data, name: read_record(
        data, name, theta_deg=entry.theta_deg, psi_deg=entry.psi_deg, repeat=entry.repeat
    )


def _twice(record: CurrentRecord, file: str, column: str | None) -> Problem:
    return problem(
        "duplicate-position",
        "The position θ %(theta)g°, ψ %(psi)g° with repeat %(repeat)d is there twice. "
        "Give this one another repeat, or remove it.",
        file=file,
        column=column,
        theta=record.theta_deg,
        psi=record.psi_deg,
        repeat=record.repeat,
    )


def _bare(name: str) -> PurePosixPath:
    """Name without what says how it is compressed."""
    path = PurePosixPath(name.lower())
    return path.with_suffix("") if path.suffix in _PACKED else path


def stem_of(name: str) -> str:
    """Name without folder, format and compression, lower case: ``certificate``."""
    return _bare(name).stem


def _is_table(name: str) -> bool:
    return _bare(name).suffix in _TABLES
