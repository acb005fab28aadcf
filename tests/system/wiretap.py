"""Hears chosen senders of the bus and nobody else, however many packets others send."""

from __future__ import annotations

import ctypes
import socket
import struct
import time
from collections.abc import Iterator
from typing import Any

from leeway_lcm import leeway as wire

GROUP, PORT = "239.255.76.67", 7667
SO_ATTACH_FILTER = 26
RECEIVE_BUFFER = 4 << 20
# Classic BPF: load the half word at k (UDP's source port is at 0), compare, return.
LOAD, COMPARE, RETURN, ALL = 0x28, 0x15, 0x06, 0x40000
TYPES = {
    "JOINT_STATE": wire.joint_state_t,
    "JOINT_COMMAND": wire.joint_command_t,
    "STATUS": wire.status_t,
    "PLANT_STATUS": wire.status_t,
}


def _filter(ports: list[int]) -> bytes:
    """Return the instructions that pass the packets of some source ports."""
    code = [struct.pack("HBBI", LOAD, 0, 0, 0)]
    for i, port in enumerate(ports):
        code.append(struct.pack("HBBI", COMPARE, len(ports) - i, 0, port))
    code += [struct.pack("HBBI", RETURN, 0, 0, 0), struct.pack("HBBI", RETURN, 0, 0, ALL)]
    return b"".join(code)


def _parse(packet: bytes) -> tuple[str, Any] | None:
    """Return channel and message of a packet, None for one of another channel."""
    name, _, payload = packet[8:].partition(b"\0")
    kind = TYPES.get(name.decode("ascii", "replace")) if packet[:4] == b"LC02" else None
    return (name.decode(), kind.decode(payload)) if kind else None


class Wiretap:
    """A socket that hears those who send the channels of TYPES when it is opened."""

    def __init__(self, patience_s: float = 10) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
        self.socket.bind((GROUP, PORT))
        member = socket.inet_aton(GROUP) + socket.inet_aton("0.0.0.0")
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
        ports = self._find_senders(time.monotonic() + patience_s)
        code = ctypes.create_string_buffer(_filter(ports))
        program = struct.pack("HP", len(ports) + 3, ctypes.addressof(code))
        self.socket.setsockopt(socket.SOL_SOCKET, SO_ATTACH_FILTER, program)

    def _find_senders(self, end: float) -> list[int]:
        """Return the source ports of all channels."""
        found: dict[str, int] = {}
        self.socket.settimeout(1)
        while len(found) < len(TYPES):
            assert time.monotonic() < end, f"heard only {sorted(found)}"
            packet, (_, port) = self.socket.recvfrom(1 << 16)
            heard = _parse(packet)
            if heard:
                found[heard[0]] = port
        self.socket.setblocking(False)
        return sorted(set(found.values()))

    def messages(self) -> Iterator[tuple[str, Any]]:
        """Return channel and message of all that came since the last call."""
        while True:
            try:
                heard = _parse(self.socket.recv(1 << 16))
            except BlockingIOError:
                return
            if heard:
                yield heard

    def close(self) -> None:
        """Stop listening."""
        self.socket.close()
