"""The bus from Python: only whole messages of the right type are decoded."""

from __future__ import annotations

from typing import Any

import pytest
from leeway_lcm import leeway as wire

from leeway import bus
from leeway.connection import parse


@pytest.mark.parametrize(
    "kind", [wire.joint_state_t, wire.joint_command_t, wire.obstacles_t, wire.status_t]
)
def test_only_whole_messages_are_decoded(kind: type) -> None:
    data = kind().encode()
    assert bus.decode(kind, data).encode() == data
    for short in range(len(data)):
        assert bus.decode(kind, data[:short]) is None
    assert bus.decode(kind, data + b"\0") is None
    assert bus.decode(kind, bytes(8) + data[8:]) is None


def test_the_address_of_a_bus() -> None:
    assert bus.address("udpm://239.1.2.3:7000?ttl=0") == ("239.1.2.3", 7000)
    for url in ("", "udpm://10.0.0.1:7000", "udpm://239.1.2.3:0", "udpm://239.1.2.3:65536", "x"):
        with pytest.raises(bus.BusError, match="expected udpm"):
            bus.address(url)


class Echoing:
    """A bus on which a controller answers each message with one command."""

    def __init__(self, sessions: list[int]) -> None:
        self.sessions = sessions  # that the commands echo, one after the other

    def subscribe(self, channel: str, handler: Any) -> None:
        if channel == "JOINT_COMMAND":
            self.handler = handler

    def publish(self, channel: str, data: bytes) -> None:
        command = wire.joint_command_t()
        if self.sessions:
            command.request_session = self.sessions.pop(0)
            self.handler("JOINT_COMMAND", command.encode())

    def handle(self, seconds: float) -> None:
        pass


def test_an_echo_silence_and_a_refusal_are_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bus, "new_session", lambda: 9)
    monkeypatch.setattr(bus, "REPEAT_S", 0.001)
    monkeypatch.setattr(bus, "PATIENCE_S", 0.1)
    own: Any = Echoing([1, 9])
    assert bus.send_goal(own, None, (1, 1, 1)).request_session == 9
    own = Echoing([])
    assert bus.send_goal(own, None, (1, 1, 1)) is None
    own = Echoing([1, 2])
    with pytest.raises(bus.NotTaken, match="leeway status"):
        bus.send_goal(own, None, (1, 1, 1))


@pytest.mark.parametrize(
    "packet",
    [
        b"",
        b"LC02",
        b"LC02\0\0\0\1",
        b"LC02\0\0\0\1\0payload",
        b"LC02\0\0\0\1GOAL",
        b"LC03\0\0\0\1GOAL\0payload",
        b"lc02\0\0\0\1GOAL\0payload",
        b"LC02\0\0\0\1" + b"X" * 64 + b"\0payload",
        b"LC02\0\0\0\1G\xc3\x96\0payload",
    ],
)
def test_packets_that_are_no_message(packet: bytes) -> None:
    assert parse(packet) is None


def test_packets_that_are_a_message() -> None:
    assert parse(b"LC02\0\0\0\1GOAL\0pay\0load") == ("GOAL", b"pay\0load")
    assert parse(b"LC02\0\0\0\0" + b"X" * 63 + b"\0") == ("X" * 63, b"")
