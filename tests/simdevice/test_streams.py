import pytest

from simdevice.streams import Part, derived_seed, stream


def test_equal_keys_give_equal_numbers() -> None:
    first = stream(5, Part.RATE_WHITE, 0, 7).standard_normal(4)
    assert first.tobytes() == stream(5, Part.RATE_WHITE, 0, 7).standard_normal(4).tobytes()


def test_any_difference_of_seed_part_or_key_gives_another_stream() -> None:
    keys = [
        (5, Part.RATE_WHITE, (0, 7)),
        (6, Part.RATE_WHITE, (0, 7)),
        (5, Part.AMMETER_WHITE, (0, 7)),
        (5, Part.RATE_WHITE, (1, 7)),
        (5, Part.RATE_WHITE, (0, 8)),
        (5, Part.RATE_WHITE, (0,)),
        (5, Part.RATE_WHITE, (0, 7, 0)),
    ]
    assert len({stream(seed, part, *key).random() for seed, part, key in keys}) == len(keys)
    assert len({derived_seed(seed, part, *key) for seed, part, key in keys}) == len(keys)


def test_every_part_has_a_number_of_its_own() -> None:
    # An IntEnum takes a second name for one number silently, as an alias.
    assert len(Part) == len(Part.__members__)


def test_negative_seed_is_refused_in_words() -> None:
    with pytest.raises(ValueError, match="seed is -1"):
        stream(-1, Part.START)
