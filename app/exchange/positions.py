"""Positions of the stand: when two are the same, and how repeats are counted."""

from collections.abc import Sequence
from typing import Final

SAME_WITHIN_DEG: Final = 1e-6
"""Two stand angles that differ by less are one position; far below what a stand can set."""

Key = tuple[int, int]
_TURN: Final = round(360.0 / SAME_WITHIN_DEG)


def same_angle(a_deg: float, b_deg: float) -> bool:
    """Whether two angles are one, a full turn apart or not."""
    difference = abs(a_deg - b_deg) % 360.0
    return min(difference, 360.0 - difference) <= SAME_WITHIN_DEG


class Positions:
    """Finds positions again, with `same_angle` for both of θ and ψ."""

    def __init__(self) -> None:
        self._cells: dict[Key, list[tuple[float, float, int]]] = {}
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def find(self, theta_deg: float, psi_deg: float) -> int | None:
        """Number of a position put in before, None if it is new."""
        row, column = _cell(theta_deg), _cell(psi_deg)
        for i in (row - 1, row, row + 1):
            for j in (column - 1, column, column + 1):
                for theta, psi, number in self._cells.get((i % _TURN, j % _TURN), ()):
                    if same_angle(theta, theta_deg) and same_angle(psi, psi_deg):
                        return number
        return None

    def put(self, theta_deg: float, psi_deg: float) -> int:
        """Number of this position, counted from 0 in order of first appearance."""
        number = self.find(theta_deg, psi_deg)
        if number is None:
            number = self._count
            cell = (_cell(theta_deg) % _TURN, _cell(psi_deg) % _TURN)
            self._cells.setdefault(cell, []).append((theta_deg, psi_deg, number))
            self._count += 1
        return number


def _cell(angle_deg: float) -> int:
    return round(angle_deg / SAME_WITHIN_DEG)


def repeats(positions: Sequence[tuple[float, float]]) -> list[int]:
    """Number the repeats of each position in order of appearance, from 0."""
    known = Positions()
    counts: dict[int, int] = {}
    numbers: list[int] = []
    for theta_deg, psi_deg in positions:
        number = known.put(theta_deg, psi_deg)
        numbers.append(counts.get(number, 0))
        counts[number] = numbers[-1] + 1
    return numbers
