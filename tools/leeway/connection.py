"""One connection to the bus: sends through LCM, hears by a socket of its own."""

from __future__ import annotations

import contextlib
import select
import socket
from collections import defaultdict
from collections.abc import Callable

import lcm

Handler = Callable[[str, bytes], None]

_MAGIC, _HEAD = b"LC02", 8  # a short message: magic, number, channel, NUL, payload
_NAME_MAX = 63  # bytes of a channel's name
_PACKET_MAX = 1 << 16
_BATCH = 1000  # messages taken at once at most


def parse(packet: bytes) -> tuple[str, bytes] | None:
    """Return channel and payload of a packet; None when it is no short message of LCM."""
    end = packet.find(b"\0", _HEAD)
    if packet[: len(_MAGIC)] != _MAGIC or not _HEAD < end <= _HEAD + _NAME_MAX:
        return None
    name = packet[_HEAD:end]
    return (name.decode(), packet[end + 1 :]) if name.isascii() else None


class Connection:
    """A connection to the bus.

    LCM's Python module (1.5.3) ends the process at a packet whose channel's name does not end, so
    it only sends here. Messages that LCM cuts into fragments, above 65 kB, are not heard; Leeway
    sends none.
    """

    def __init__(self, url: str, group: tuple[str, int], receive_buffer: int) -> None:
        """Open it for sending.

        Raises
        ------
        RuntimeError
            LCM cannot open the URL.
        """
        self._lcm = lcm.LCM(url)
        self._group = group
        self._buffer = receive_buffer
        self._socket: socket.socket | None = None
        self._handlers: defaultdict[str, list[Handler]] = defaultdict(list)

    def publish(self, channel: str, data: bytes) -> None:
        """Send a message."""
        self._lcm.publish(channel, data)

    def subscribe(self, channel: str, handler: Handler) -> None:
        """Have every message of a channel from now on handed to a function by `handle`.

        Raises
        ------
        OSError
            The port cannot be shared, or there is no multicast route.
        """
        if self._socket is None:
            self._socket = self._listen()
        self._handlers[channel].append(handler)

    def _listen(self) -> socket.socket:
        opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, self._buffer)
            opened.bind(self._group)
            # The interface is the one that the kernel routes the group to, as with LCM.
            member = socket.inet_aton(self._group[0]) + socket.inet_aton("0.0.0.0")
            opened.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
            opened.setblocking(False)
        except OSError:
            opened.close()
            raise
        return opened

    def handle(self, seconds: float) -> None:
        """Wait for messages and hand all that came to their functions.

        A signal does not disturb the wait.
        """
        waiting = [self._socket] if self._socket is not None else []
        ready, _, _ = select.select(waiting, [], [], seconds)
        for listening in ready:
            # Nothing left, or an interface that went down, which the kernel reports once.
            with contextlib.suppress(OSError):
                for _ in range(_BATCH):
                    self._deliver(listening.recv(_PACKET_MAX))

    def _deliver(self, packet: bytes) -> None:
        heard = parse(packet)
        if heard is not None:
            for handler in self._handlers.get(heard[0], []):
                handler(*heard)

    def close(self) -> None:
        """Stop hearing."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def __del__(self) -> None:
        """Close the socket with the connection, as LCM does."""
        self.close()
