"""Sameness of positions, and the numbering of repeats."""

from hypothesis import given
from hypothesis import strategies as st

from app.exchange.positions import Positions, repeats, same_angle

angle = st.floats(0, 360, exclude_max=True)


def test_a_full_turn_and_a_millionth_of_a_degree_make_no_difference() -> None:
    assert same_angle(0.0, 359.9999995)
    assert same_angle(-90.0, 270.0)
    assert same_angle(10.0, 10.0000009)
    assert not same_angle(10.0, 10.0000012)
    assert not same_angle(0.0, 180.0)


@given(st.lists(st.tuples(angle, angle), max_size=20), st.tuples(angle, angle))
def test_finding_agrees_with_looking_at_each(
    known: list[tuple[float, float]], wanted: tuple[float, float]
) -> None:
    positions = Positions()
    for place in known:
        positions.put(*place)
    alike = [place for place in known if same_angle(place[0], wanted[0]) and same_angle(place[1], wanted[1])]
    assert (positions.find(*wanted) is not None) == bool(alike)


@given(angle, angle, st.floats(-0.9e-6, 0.9e-6), st.floats(-0.9e-6, 0.9e-6))
def test_a_position_slightly_off_is_found_again(
    theta: float, psi: float, d_theta: float, d_psi: float
) -> None:
    positions = Positions()
    assert positions.put(theta, psi) == 0
    assert positions.put((theta + d_theta) % 360, (psi + d_psi) % 360) == 0
    assert len(positions) == 1


def test_repeats_count_up_in_order_of_appearance() -> None:
    assert repeats([(0.0, 0.0), (0.0, 90.0), (360.0, 0.0), (0.0, 90.0), (0.0, 0.0)]) == [0, 0, 1, 1, 2]
    assert repeats([]) == []
