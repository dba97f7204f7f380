"""Take a file out of gzip or zstd, told by its first bytes, with a limit against bombs."""

from typing import Final, Literal

import pyarrow as pa

from app.errors import Invalid
from app.exchange.problems import refuse

LARGEST_BYTES: Final = 512 * 2**20
"""So many bytes a file may have when unpacked: more than ten hours of record."""

_MAGIC: Final[dict[bytes, Literal["gzip", "zstd"]]] = {b"\x1f\x8b": "gzip", b"\x28\xb5\x2f\xfd": "zstd"}
_PIECE = 2**20


def unpack(data: bytes, filename: str, limit: int = LARGEST_BYTES) -> bytes:
    """Return `data` decompressed if it is gzip or zstd, else as it is.

    Raises
    ------
    Invalid
        ``empty-file``, ``too-big``, or ``damaged`` when the compressed stream is cut short or wrong.
    """
    if not data:
        raise refuse(
            "empty-file", "The file is empty. Export it again, or choose another file.", file=filename
        )
    codec = next((name for magic, name in _MAGIC.items() if data.startswith(magic)), None)
    plain = _decompress(data, codec, filename, limit) if codec else data
    if len(plain) > limit:
        raise too_big(filename, limit)
    if not plain:
        raise refuse(
            "empty-file", "The file is empty. Export it again, or choose another file.", file=filename
        )
    return plain


def too_big(filename: str, limit: int) -> Invalid:
    """The refusal of a file that unpacks to more than `limit` bytes."""
    return refuse(
        "too-big",
        "The file holds more than %(limit)d MiB. Split it, for example one file per position.",
        file=filename,
        limit=limit // 2**20,
    )


def _decompress(data: bytes, codec: Literal["gzip", "zstd"], filename: str, limit: int) -> bytes:
    pieces: list[bytes] = []
    size = 0
    try:
        with pa.CompressedInputStream(pa.BufferReader(data), codec) as stream:
            while piece := stream.read(_PIECE):
                pieces.append(piece)
                size += len(piece)
                if size > limit:
                    raise too_big(filename, limit)
    except (OSError, pa.ArrowException) as error:
        raise refuse(
            "damaged",
            "The compressed file is damaged or was cut short (%(codec)s). Copy or export it again.",
            file=filename,
            codec=codec,
        ) from error
    return b"".join(pieces)
