"""Samples on disk, cut off anywhere by a power failure."""

import numpy as np
import pytest

from app.station.contracts import Block
from app.station.keeping.blocks import BlockFile

SIZES = (5, 1, 7)


def block(first: int, count: int) -> Block:
    rng = np.random.default_rng([first, count])
    return Block(first, *rng.normal(size=(3, count)))


def blocks() -> list[Block]:
    firsts = np.cumsum((0, *SIZES[:-1])).tolist()
    return [block(first, count) for first, count in zip(firsts, SIZES, strict=True)]


def columns(parts: list[Block]) -> np.ndarray:
    names = ("t_s", "jx_ma", "jy_ma")
    return np.array(
        [np.concatenate([np.empty(0), *(getattr(part, name) for part in parts)]) for name in names]
    )


pytestmark = pytest.mark.usefixtures("no_sync")


@pytest.fixture
def path(tmp_path):
    return tmp_path / "000001.blocks"


def test_what_was_appended_is_read_back_to_the_bit(path):
    file = BlockFile(path)
    for part in blocks():
        file.append(part)
    file.close()
    again = BlockFile(path)
    np.testing.assert_array_equal(np.array(again.columns()), columns(blocks()))
    assert again.samples == sum(SIZES)
    again.close()


def test_cut_off_after_any_byte_the_whole_blocks_before_are_there(path):
    file, ends = BlockFile(path), [0]
    for part in blocks():
        file.append(part)
        ends.append(path.stat().st_size)
    file.close()
    content = path.read_bytes()
    for length in range(len(content) + 1):
        path.write_bytes(content[:length])
        whole = sum(length >= end for end in ends) - 1
        torn = BlockFile(path)
        np.testing.assert_array_equal(np.array(torn.columns()), columns(blocks()[:whole]))
        for part in blocks()[whole:]:  # it goes on from there
            torn.append(part)
        torn.close()
        assert path.read_bytes() == content


@pytest.mark.parametrize("place", [0, 4, 12, 16, 20, 60, -1])
def test_a_byte_that_is_wrong_ends_what_counts(path, place):
    file = BlockFile(path)
    file.append(blocks()[0])
    file.close()
    content = bytearray(path.read_bytes())
    content[place] ^= 1
    path.write_bytes(content)
    again = BlockFile(path)
    assert again.samples == 0
    again.close()


def test_a_block_that_leaves_a_gap_is_refused(path):
    file = BlockFile(path)
    with pytest.raises(ValueError, match="begins at 3 instead of 0"):
        file.append(block(3, 2))
    file.close()
    assert path.read_bytes() == b""
