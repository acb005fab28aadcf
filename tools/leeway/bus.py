"""The LCM bus from Python: opening it, and messages repeated until they are echoed."""

from __future__ import annotations

import functools
import ipaddress
import os
import re
import secrets
import socket
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from leeway_lcm import leeway as wire

from leeway.connection import Connection

DEFAULT_URL = "udpm://239.255.76.67:7667?ttl=0"
UPSERT, REMOVE, CLEAR = wire.obstacles_t.UPSERT, wire.obstacles_t.REMOVE, wire.obstacles_t.CLEAR
SHARED = ("OBSTACLES", "HULL")  # by all robots of a bus
RECEIVE_BUFFER = 2 << 20
OWNER = slice(40, 48)  # of obstacles_t and hull_t, behind fingerprint and header
REPEAT_S = 0.1
PATIENCE_S = 2.0


class BusError(Exception):
    """The bus cannot be used; the text says what to do."""


class NotTaken(BusError):
    """A controller is there and did not echo a message; the text says what to do."""


def resolve_url(url: str | None) -> str:
    """Return the URL to use: the argument, else LCM_DEFAULT_URL, else this host alone.

    The default asks for the largest receive buffer (up to 2 MiB) that the kernel grants.
    """
    chosen = url or os.environ.get("LCM_DEFAULT_URL")
    if chosen:
        return chosen
    try:
        granted = int(Path("/proc/sys/net/core/rmem_max").read_text())
    except (OSError, ValueError):
        return DEFAULT_URL
    return f"{DEFAULT_URL}&recv_buf_size={min(RECEIVE_BUFFER, granted)}"


def _is_group(address: str) -> bool:
    try:
        return ipaddress.IPv4Address(address).is_multicast
    except ValueError:
        return False


def address(url: str) -> tuple[str, int]:
    """Return multicast group and port of a URL.

    Raises
    ------
    BusError
        The URL is not of the form udpm://GROUP:PORT.
    """
    match = re.fullmatch(r"udpm://([0-9.]+):(\d{1,5})(\?.*)?", url)
    if match is None or not _is_group(match[1]) or not 0 < int(match[2]) < 1 << 16:
        raise BusError(
            "LCM URL: expected udpm://GROUP:PORT?ttl=N with a multicast group, "
            f'as in {DEFAULT_URL}, found "{url}"'
        )
    return match[1], int(match[2])


def open_bus(url: str) -> Connection:
    """Open a bus.

    Raises
    ------
    BusError
        The URL is not of the form udpm://GROUP:PORT, or there is no multicast route.
    """
    target = address(url)
    try:
        # Ask the kernel for a route before LCM does, which would print a page of its own.
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect(target)
    except (OSError, OverflowError) as error:
        raise BusError(
            f"no multicast route for {url} ({error}); for this host alone: sudo ip link set lo "
            "multicast on && sudo ip route add 224.0.0.0/4 dev lo"
        ) from error
    try:
        return Connection(url, target, RECEIVE_BUFFER)
    except RuntimeError as error:
        raise BusError(f"LCM cannot open {url}") from error


@functools.cache
def _size(kind: Any) -> int:
    return len(kind().encode())


def decode(kind: Any, data: bytes) -> Any | None:
    """Return a message of one of the types of fixed size; None when it is no such message."""
    if len(data) != _size(kind):
        return None
    try:
        return kind.decode(data)
    except ValueError:
        return None


def header(session: int, seq: int) -> Any:
    """Return a stamp of this process."""
    h = wire.header_t()
    h.utime = time.time_ns() // 1000
    h.mono_ns = time.monotonic_ns()
    h.session, h.seq = session, seq
    return h


def new_session() -> int:
    """Return a random number > 0 that tells this process from every other."""
    return secrets.randbelow((1 << 63) - 1) + 1


def channel(name: str, robot: str | None) -> str:
    """Return the channel of a robot; OBSTACLES and HULL are shared by all."""
    return f"{robot}_{name}" if robot and name not in SHARED else name


def send_until_echoed(
    bus: Connection,
    to_channel: str,
    message: Any,
    command_channel: str,
    is_echo: Callable[[Any], bool],
) -> Any:
    """Publish a message every 0.1 s until a joint command echoes it.

    Returns
    -------
    The command that echoed it, or None after 2 s without any.

    Raises
    ------
    NotTaken
        Commands came, and none echoed it.
    """
    found: list[Any] = []
    others = 0

    def on_command(_: str, data: bytes) -> None:
        nonlocal others
        command = decode(wire.joint_command_t, data)
        if command is not None and not found and is_echo(command):
            found.append(command)
        others += command is not None

    bus.subscribe(command_channel, on_command)
    end = time.monotonic() + PATIENCE_S
    while not found and time.monotonic() < end:
        bus.publish(to_channel, message.encode())
        again = time.monotonic() + REPEAT_S
        while not found and (left := again - time.monotonic()) > 0:
            bus.handle(left)
    if others and not found:
        raise NotTaken(
            f"a controller is there, but did not echo it within {PATIENCE_S:g} s: `leeway status` "
            "counts by reason what it refused (full: leeway obstacle clear makes room)"
        )
    return found[0] if found else None


def send_goal(bus: Connection, robot: str | None, goal: tuple[float, float, float] | None) -> Any:
    """Send GOAL (m, base frame), or STOP for None, as `send_until_echoed` does."""
    session = new_session()
    message = wire.stop_t() if goal is None else wire.goal_t()
    message.h = header(session, 1)
    if goal is not None:
        message.p = list(goal)
    return send_until_echoed(
        bus,
        channel("STOP" if goal is None else "GOAL", robot),
        message,
        channel("JOINT_COMMAND", robot),
        lambda command: command.request_session == session,
    )


def send_change(bus: Connection, robot: str | None, message: Any) -> Any:
    """Send an obstacles_t or hull_t, stamped here, as `send_until_echoed` does.

    Where many send, a command names another one's message each time: then it counts that the
    controller tells the obstacles as this sender's.
    """
    session = new_session()
    message.h = header(session, 1)
    known: list[int] = []

    def on_world(_: str, data: bytes) -> None:
        if data[OWNER] == session.to_bytes(8, "big"):
            known.append(session)

    for name in ("WORLD", "WORLD_HULL"):
        bus.subscribe(channel(name, robot), on_world)
    return send_until_echoed(
        bus,
        "HULL" if isinstance(message, wire.hull_t) else "OBSTACLES",
        message,
        channel("JOINT_COMMAND", robot),
        lambda command: command.world_session == session or bool(known),
    )


def send_obstacles(
    bus: Connection,
    robot: str | None,
    op: int,
    entries: list[tuple[int, tuple[float, float, float], float]],
) -> Any:
    """Send a change of obstacles (id, centre m, radius m), as `send_until_echoed` does."""
    message = wire.obstacles_t()
    message.op, message.n = op, len(entries)
    for slot, (number, centre, radius) in zip(message.o, entries, strict=False):
        slot.id, slot.p, slot.quat, slot.radius = number, list(centre), [1.0, 0.0, 0.0, 0.0], radius
    return send_change(bus, robot, message)
