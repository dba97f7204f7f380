"""The values of one quantity over time, as everything in `solver.drift` takes them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solver.errors import InputError, Message
from solver.records import Array


@dataclass(frozen=True, slots=True)
class History:
    """One quantity over time, in the order of time. Build it with `History.sorted_from`.

    Attributes
    ----------
    time : (n,) array
        When each value was measured, s from any common origin; not decreasing.
    value : (n,) array
        In the quantity's unit.
    u : (n,) array
        Standard uncertainty of each value from what differs from one value to the next (the noise of
        its own measurement), in the same unit; 0 where none is known. What the values share, an error
        of the ammeter's scale, say, does not belong here.
    start : (n,) int array
        Label of the power-up in which it was measured: equal labels, same start.
    """

    time: Array
    value: Array
    u: Array
    start: NDArray[np.int64]

    def __len__(self) -> int:
        """Number of values."""
        return len(self.value)

    def __getitem__(self, which: slice | Array | NDArray[np.int64] | NDArray[np.bool_]) -> "History":
        """Some of the values, still in the order of time."""
        return History(self.time[which], self.value[which], self.u[which], self.start[which])

    @classmethod
    def sorted_from(
        cls,
        time: ArrayLike,
        value: ArrayLike,
        u: ArrayLike | None = None,
        start: ArrayLike | None = None,
    ) -> "History":
        """Sort by time (values of one moment keep their order) and check once.

        Parameters
        ----------
        time, value, u, start : (n,) array_like
            As the attributes; without `u` none is known, without `start` each value has a start of its own.

        Raises
        ------
        InputError
            When lengths differ, a number is not finite, or an uncertainty is negative.
        """
        moments, values = np.asarray(time, np.float64), np.asarray(value, np.float64)
        spread = np.zeros(len(values)) if u is None else np.asarray(u, np.float64)
        starts = np.arange(len(values)) if start is None else np.asarray(start, np.int64)
        columns = (moments, values, spread, starts)
        if any(column.shape != (len(values),) for column in columns):
            raise InputError(_LENGTHS)
        if not all(np.isfinite(column).all() for column in columns):
            raise InputError(_NOT_FINITE)
        if (spread < 0.0).any():
            raise InputError(_NEGATIVE)
        order = np.argsort(moments, kind="stable")
        return cls(moments[order], values[order], spread[order], starts[order])


_LENGTHS = Message("history-lengths", "Times, values, uncertainties and starts must be equally many.")
_NOT_FINITE = Message("history-not-finite", "A history needs finite times, values and uncertainties.")
_NEGATIVE = Message("history-negative-u", "A standard uncertainty of a history is negative.")
