"""What may be asked of a plan, and everything its answer depends on."""

import json
from dataclasses import dataclass
from typing import Final

from app.errors import Invalid, problem
from app.exchange.planned import certified_rows, circumstances_si, grid_positions
from app.exchange.rows import CertificateRow
from solver.errors import Message
from solver.positions.planning import Circumstances
from solver.positions.proposing import CRITERIA
from solver.records import PARAMETERS

COUNTS: Final = range(4, 17)
"""Numbers of positions that are compared."""
MOST_POSITIONS: Final = 64
FINEST_GRID_DEG: Final = 30.0
LONGEST_S: Final = 86_400.0


@dataclass(frozen=True, slots=True)
class Asked:
    """What is asked: the best `count` positions, or without it what the listed ones will tell.

    Attributes
    ----------
    count
        How many positions to propose; None to judge `positions`.
    positions
        θ, ψ in degrees, one repeated counts again; empty for every position of the certificate.
    grid_deg
        Step of the grid to choose from; None to choose among the certificate's positions.
    criterion
        One of `solver.positions.proposing.CRITERIA`.
    repeats
        Whether a position may be proposed several times.
    time_s, moving_s
        Of the whole session; of getting to each position and settling there.
    noise_deg_per_h, floor_deg_per_h
        Standard uncertainty of a mean over 60 s, and what no longer measuring takes away, as rates.
    """

    count: int | None = None
    positions: tuple[tuple[float, float], ...] = ()
    grid_deg: float | None = None
    criterion: str = "D"
    repeats: bool = False
    time_s: float = 2400.0
    moving_s: float = 60.0
    noise_deg_per_h: float = 0.005
    floor_deg_per_h: float = 0.0


@dataclass(frozen=True, slots=True)
class Question:
    """Everything an answer depends on.

    `nominal` holds the eight parameters in laboratory units, `limits` those of the type by name,
    `statement` what all positions have in common, as JSON.
    """

    certificate: tuple[CertificateRow, ...]
    latitude_deg: float
    nominal: tuple[float, ...]
    asked: Asked
    statement: str = "{}"
    limits: tuple[tuple[str, float, float], ...] = ()

    def candidates(self) -> tuple[CertificateRow, ...]:
        """Positions to choose from."""
        if self.asked.grid_deg is None:
            return self.certificate
        return certified_rows(grid_positions(self.asked.grid_deg), self.certificate)

    def listed(self) -> tuple[CertificateRow, ...]:
        """Positions to judge."""
        if not self.asked.positions:
            return self.certificate
        return certified_rows(self.asked.positions, self.certificate)

    def circumstances(self) -> Circumstances:
        """In the solver's terms."""
        return circumstances_si(
            dict(zip(PARAMETERS, self.nominal, strict=True)), self.latitude_deg,
            self.asked.noise_deg_per_h, self.asked.floor_deg_per_h, json.loads(self.statement),
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Subject:
    """A question with where it comes from: stand and certificate's number, and the nominal values."""

    question: Question
    stand: str | None
    certificate: str | None
    nominal_source: Message


def check(asked: Asked) -> None:
    """Refuse what nothing can be planned with.

    Raises
    ------
    Invalid
        With every problem, each at its field.
    """
    wrong = []
    if asked.count is not None and not COUNTS.start <= asked.count <= MOST_POSITIONS:
        wrong.append(problem("bad-count", "Ask for %(least)d to %(most)d positions.", column="count",
                             least=COUNTS.start, most=MOST_POSITIONS))  # fmt: skip
    if len(asked.positions) > MOST_POSITIONS:
        wrong.append(problem("too-many-positions", "A plan has at most %(most)d positions.", column="positions",
                             most=MOST_POSITIONS))  # fmt: skip
    grid = asked.grid_deg
    if grid is not None and not (FINEST_GRID_DEG <= grid <= 90.0 and 360.0 % grid == 0.0):
        wrong.append(problem("bad-grid", "The grid’s step must divide the full turn and lie between 30° and 90°, "
                             "such as 30, 45 or 90.", column="grid_deg"))  # fmt: skip
    if asked.criterion not in CRITERIA:
        wrong.append(problem("unknown-criterion", "There is no criterion “%(name)s”. Choose one of %(names)s.",
                             column="criterion", name=asked.criterion, names=", ".join(CRITERIA)))  # fmt: skip
    if not 0.0 < asked.time_s <= LONGEST_S:
        wrong.append(problem("bad-time", "The whole time must be greater than zero, and a day at most.",
                             column="time_s"))  # fmt: skip
    if not 0.0 <= asked.moving_s <= LONGEST_S:
        wrong.append(problem("bad-time", "The time for moving must not be negative, and a day at most.",
                             column="moving_s"))  # fmt: skip
    wrong += [
        problem("bad-noise", "The noise lies between 0 and 10 °/h.", column=name)
        for name in ("noise_deg_per_h", "floor_deg_per_h")
        if not 0.0 <= getattr(asked, name) <= 10.0
    ]
    if wrong:
        raise Invalid(*wrong)
