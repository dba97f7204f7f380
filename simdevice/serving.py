"""Instruments on TCP ports: one line in, one answer out, any number of clients at a time.

Every port is one instrument. A client's lines are answered in their order; clients do not wait for
each other. A client that goes away takes nothing with it: what it began goes on.
"""

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from typing import Final

from simdevice.scpi.errors import ScpiError
from simdevice.scpi.instrument import HangUp, Instrument

LONGEST_MESSAGE: Final = 16_384
"""Bytes of a line; what is longer is thrown away to its end, and reported as −363."""


@asynccontextmanager
async def listening(
    instruments: Sequence[Instrument], host: str, ports: Sequence[int]
) -> AsyncIterator[list[int]]:
    """Serve each instrument on its port until the block ends; yields the ports, also where 0 was asked for.

    Raises
    ------
    OSError
        When a port cannot be had.
    """
    async with contextlib.AsyncExitStack() as stack:
        bound = []
        for instrument, port in zip(instruments, ports, strict=True):
            service = _Service(instrument)
            server = await asyncio.start_server(service.talk, host, port, limit=LONGEST_MESSAGE)
            stack.push_async_callback(service.close, server)
            bound.append(server.sockets[0].getsockname()[1])
        yield bound


class _Service:
    """The clients of one instrument."""

    def __init__(self, instrument: Instrument) -> None:
        self._instrument = instrument
        self._talks: set[asyncio.Task[None]] = set()

    async def close(self, server: asyncio.Server) -> None:
        """No new clients, and an end with those there are."""
        server.close()
        for talk in self._talks:
            talk.cancel()
        await asyncio.gather(*self._talks, return_exceptions=True)
        await asyncio.sleep(0)  # the loop closes the sockets in its next round

    async def talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """With one client, until it goes."""
        talk = asyncio.current_task()
        assert talk is not None
        self._talks.add(talk)
        try:
            # The client is gone, and the instrument stays as it is; or `close` ends the talk, which asyncio's own
            # callback would print as an error (Python 3.11).
            with contextlib.suppress(ConnectionError, asyncio.CancelledError):
                await self._answer_all(reader, writer)
                writer.close()
                await writer.wait_closed()
        finally:
            self._talks.discard(talk)
            writer.transport.abort()

    async def _answer_all(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while (message := await self._message(reader)) is not None:
            try:
                answer = await self._answer(message, reader)
            except HangUp as broken:
                writer.write(broken.sent)
                await writer.drain()
                return
            if answer:
                writer.write(answer)
                await writer.drain()
            else:
                _acknowledge(writer)

    async def _message(self, reader: asyncio.StreamReader) -> bytes | None:
        """The next line without its end; nothing at the end, where half a line is no message."""
        too_long = False
        while True:
            try:
                line = await reader.readuntil(b"\n")
            except asyncio.IncompleteReadError:
                return None
            except asyncio.LimitOverrunError as error:
                await reader.readexactly(error.consumed or 1)
                too_long = True
                continue
            if not too_long:
                return line[:-1]
            too_long = False
            self._instrument.refuse(ScpiError(-363, f"a line has at most {LONGEST_MESSAGE} bytes"))

    async def _answer(self, message: bytes, reader: asyncio.StreamReader) -> bytes:
        steps = self._instrument.respond(message)
        while True:
            try:
                pause = next(steps)
            except StopIteration as end:
                answer: bytes = end.value
                return answer
            if reader.at_eof() and self._instrument.waits_for_ever():
                raise ConnectionAbortedError("the client is gone, and what it waits for does not end")
            await asyncio.sleep(pause)


def _acknowledge(writer: asyncio.StreamWriter) -> None:
    """Tell the client's system at once that a command has arrived.

    Nothing is answered to a command, and a system that sends small parcels only when the last one has
    arrived (VISA on most systems) would wait for the delayed acknowledgement, 40 ms on Linux.
    """
    if hasattr(socket, "TCP_QUICKACK"):
        writer.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)
