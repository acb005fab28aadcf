"""Events of an LCM log: where each begins and ends, when it was received, on which channel.

The framing is read here and not by `lcm.EventLog`, which cannot tell a whole log from one that
was cut.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from stat import S_ISREG
from typing import BinaryIO, NamedTuple

SYNC = 0xEDA1DA01
_HEADER = struct.Struct(">IqqII")  # sync, event number, time us, lengths of channel and data
_CHANNEL_MAX = 1000  # bytes; LCM itself stays below 64


class LogError(Exception):
    """A log that cannot be used; the text says what was expected and what to do."""


class RawEvent(NamedTuple):
    """One message as lcm-logger wrote it."""

    start: int  # byte of the file where its data begin
    utime: int  # us since 1970 when the logger received it
    channel: str
    data: bytes


class Events:
    """The whole events of a log, in its order; they end at the first that is cut or damaged."""

    def __init__(self, path: Path, file: BinaryIO) -> None:
        self._path = path
        self._file = file
        self.size = os.fstat(file.fileno()).st_size  # bytes
        self.whole = 0  # bytes of the events read so far
        if self.size == 0:
            raise LogError(f"{path}: empty: was lcm-logger stopped before anything was sent?")

    @property
    def left(self) -> int:
        """Bytes behind the last event read."""
        return self.size - self.whole

    def __iter__(self) -> Iterator[RawEvent]:
        read = self._file.read
        while len(head := read(_HEADER.size)) == _HEADER.size:
            sync, _, utime, channel_length, data_length = _HEADER.unpack(head)
            start = self.whole + _HEADER.size + channel_length
            if sync != SYNC or channel_length > _CHANNEL_MAX or start + data_length > self.size:
                break
            body = read(channel_length + data_length)
            self.whole = start + data_length
            channel = body[:channel_length].decode("ascii", "replace")
            yield RawEvent(start, utime, channel, body[channel_length:])
        if self.whole == 0:
            self._refuse()

    def _refuse(self) -> None:
        """Say why a file has no whole event."""
        self._file.seek(0)
        start = self._file.read(4)
        if start == struct.pack(">I", SYNC):
            raise LogError(
                f"{self._path}: cut within its first event: nothing to read, record it again"
            )
        raise LogError(
            f"{self._path}: not an LCM log: expected events that start with 0x{SYNC:X}, "
            f"found 0x{start.hex().upper()} at byte 0"
        )


@contextmanager
def open_events(path: Path) -> Iterator[Events]:
    """Open a log.

    Raises
    ------
    LogError
        The file cannot be read, is empty or is no LCM log.
    """
    try:
        if not S_ISREG(path.stat().st_mode):
            raise LogError(f"{path}: expected a log file, found something else")
        with path.open("rb") as file:
            yield Events(path, file)
    except OSError as error:
        raise LogError(f"{path}: cannot be read: {error.strerror}") from error
