"""Helpers of the system tests: the command line, programs by hand, logs by LCM's reader."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import lcm
import numpy as np
from leeway_lcm import leeway as wire

from leeway.bus import resolve_url
from leeway.processes import program

TYPES = {
    "JOINT_STATE": wire.joint_state_t,
    "JOINT_COMMAND": wire.joint_command_t,
    "OBSTACLES": wire.obstacles_t,
    "HULL": wire.hull_t,
    "GOAL": wire.goal_t,
    "SCENE": wire.scene_t,
    "STATUS": wire.status_t,
    "PLANT_STATUS": wire.status_t,
}


def leeway(*args: object, timeout: float = 60) -> subprocess.CompletedProcess[str]:
    """Run the command line to its end."""
    command = [sys.executable, "-m", "leeway", *map(str, args)]
    return subprocess.run(
        command,
        capture_output=True,
        text=True,
        timeout=timeout,
        stdin=subprocess.DEVNULL,
        check=False,
    )


def start_leeway(*args: object) -> subprocess.Popen[str]:
    """Start the command line."""
    command = [sys.executable, "-m", "leeway", *map(str, args)]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, stdin=subprocess.DEVNULL
    )


@contextlib.contextmanager
def running(name: str, *args: object) -> Iterator[subprocess.Popen[str]]:
    """Start one of the programs by hand; end it by its pid when the block ends."""
    process = subprocess.Popen(
        [str(program(name)), *map(str, args)],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.terminate()
        try:
            process.wait(5)
        except subprocess.TimeoutExpired:
            process.kill()
            raise


def wait_until(condition: Callable[[], bool], seconds: float, what: str) -> None:
    """Wait for a condition; fail when it does not come true in time."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, f"no {what} within {seconds:g} s"
        time.sleep(0.005)


class Listener:
    """Newest message of each channel, read when asked."""

    def __init__(self, url: str | None = None, channels: Iterable[str] = TYPES) -> None:
        self.bus = lcm.LCM(resolve_url(url))
        self.newest: dict[str, Any] = {}
        for channel in channels:
            self.bus.subscribe(channel, self._on_message)

    def _on_message(self, channel: str, data: bytes) -> None:
        self.newest[channel] = TYPES[channel].decode(data)

    def wait_for(self, channel: str, condition: Callable[[Any], bool], seconds: float = 10) -> Any:
        """Handle messages until one of a channel meets a condition; return it."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.newest.pop(channel, None)
            self.bus.handle_timeout(50)
            if channel in self.newest and condition(self.newest[channel]):
                return self.newest[channel]
        raise AssertionError(f"no such {channel} within {seconds:g} s")


def read(log: Path, channel: str) -> list[Any]:
    """All messages of a channel, by LCM's own log reader."""
    return [TYPES[channel].decode(e.data) for e in lcm.EventLog(str(log)) if e.channel == channel]


def motion(log: Path) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """q and commanded qd by tick of a lockstep log, each tick once."""
    rows = {c.state_tick: c for c in read(log, "JOINT_COMMAND") if c.mode == c.VELOCITY}
    ordered = [rows[tick] for tick in sorted(rows)]
    return np.array([c.q for c in ordered]), np.array([c.qd for c in ordered])


def children_of(pid: int) -> dict[str, int]:
    """Program name -> pid of the running children of a process."""
    found = {}
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        with contextlib.suppress(OSError):
            fields = (entry / "stat").read_text().rpartition(")")[2].split()
            if int(fields[1]) == pid and fields[0] != "Z":
                name = Path((entry / "cmdline").read_bytes().split(b"\0")[0].decode()).name
                found[name] = int(entry.name)
    return found


def kill(pid: int, number: signal.Signals = signal.SIGKILL) -> None:
    """Send a signal to a process of this test."""
    os.kill(pid, number)
