import pytest

from simdevice.scpi.errors import ScpiError


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (ScpiError(0), '0,"No error"'),
        (ScpiError(-113), '-113,"Undefined header"'),
        (ScpiError(-222, "5 is too much"), '-222,"Data out of range;5 is too much"'),
        (ScpiError(101, "reset it", text="Emergency stop"), '101,"Emergency stop;reset it"'),
        (ScpiError(-151, "\"a"), '-151,"Invalid string data;""a"'),
        (ScpiError(-101, "°"), '-101,"Invalid character;?"'),
    ],
)  # fmt: skip
def test_an_error_reads_as_the_queue_prints_it(error, said):
    assert str(error) == said


def test_a_description_has_at_most_255_characters():
    assert len(str(ScpiError(-200, "x" * 400)).split(",", 1)[1]) == 255 + 2


# IEEE 488.2-1992, 11.5.1: CME is bit 5, EXE 4, DDE 3, QYE 2.
@pytest.mark.parametrize(
    ("number", "bit"),
    [(-101, 32), (-178, 32), (-200, 16), (-222, 16), (-310, 8), (-350, 8), (101, 8), (-440, 4)],
)
def test_an_errors_class_has_its_bit(number, bit):
    assert ScpiError(number, text="x").event_bit == bit
