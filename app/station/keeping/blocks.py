"""The samples of one attempt on disk: frames of samples, only ever appended, each with its length and CRC-32.

A frame is a header (mark, number of its first sample, number of samples, CRC-32 of all the rest, little-endian)
and the samples as float64 triples t (s), jx, jy (mA). A frame counts when it is synced; one that a power cut
tore off is dropped, and its samples are fetched again.
"""

import struct
import zlib
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.station.contracts import Array, Block
from app.station.keeping import durable

_HEADER: Final = struct.Struct("<4sQII")
_MARK: Final = b"DBK1"
_SAMPLE: Final = np.dtype("<f8")
_COLUMNS: Final = 3


class BlockFile:
    """The samples that are safe on disk so far."""

    def __init__(self, path: Path) -> None:
        self._frames, good = _read(path)
        self._stream = durable.open_to_append(path, good)
        self._samples = sum(len(frame) for frame in self._frames)

    @property
    def samples(self) -> int:
        """How many there are, from the first on without a gap."""
        return self._samples

    def append(self, block: Block) -> None:
        """Keep a block, which begins where the last one ended."""
        if block.first != self._samples:
            raise ValueError(f"block begins at {block.first} instead of {self._samples}")
        frame = np.column_stack((block.t_s, block.jx_ma, block.jy_ma)).astype(_SAMPLE)
        durable.append(self._stream, _encoded(block.first, frame))
        self._frames.append(frame)
        self._samples += len(frame)

    def columns(self) -> tuple[Array, Array, Array]:
        """All of t (s), jx and jy (mA), (n,) each."""
        rows = np.concatenate(self._frames) if self._frames else np.empty((0, _COLUMNS))
        t_s, jx_ma, jy_ma = (np.ascontiguousarray(column, dtype=np.float64) for column in rows.T)
        return t_s, jx_ma, jy_ma

    def close(self) -> None:
        """Close the file."""
        self._stream.close()


def _encoded(first: int, frame: NDArray[np.float64]) -> bytes:
    body = frame.tobytes()
    return _HEADER.pack(_MARK, first, len(frame), _crc(first, len(frame), body)) + body


def _crc(first: int, count: int, body: bytes) -> int:
    return zlib.crc32(body, zlib.crc32(struct.pack("<QI", first, count)))


def _read(path: Path) -> tuple[list[NDArray[np.float64]], int]:
    """Read the frames up to the first that is not whole, and the length of that part."""
    data = path.read_bytes() if path.exists() else b""
    frames: list[NDArray[np.float64]] = []
    at = samples = 0
    while at + _HEADER.size <= len(data):
        mark, first, count, crc = _HEADER.unpack_from(data, at)
        body = data[at + _HEADER.size : at + _HEADER.size + count * _COLUMNS * _SAMPLE.itemsize]
        if mark != _MARK or first != samples or crc != _crc(first, count, body):
            break
        if len(body) < count * _COLUMNS * _SAMPLE.itemsize:
            break
        frames.append(np.frombuffer(body, dtype=_SAMPLE).reshape(count, _COLUMNS))
        at += _HEADER.size + len(body)
        samples += count
    return frames, at
