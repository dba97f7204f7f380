import math

import pytest

from simdevice.timetable import Timetable


def test_slots_follow_each_other() -> None:
    timetable = Timetable(first=100.0, move=10.0, settle=5.0)
    assert [timetable.begin(slot, 60.0) for slot in (0, 1, 16)] == [100.0, 175.0, 1300.0]


@pytest.mark.parametrize("name", ["first", "move", "settle"])
@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
def test_an_impossible_time_is_refused(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"timetable's {name}"):
        Timetable(**{name: value})
