"""Logs of real processes, played on the bus: every byte, in time, by keys."""

from __future__ import annotations

import contextlib
import json
import os
import pty
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import lcm
import pytest
from helpers import Listener, leeway, running, start_leeway, wait_until

from leeway import bus
from leeway.processes import program

pytestmark = pytest.mark.usefixtures("private_network")


class Ears:
    """Everything on the bus, in order, with the time at which it came."""

    def __init__(self) -> None:
        self.bus = lcm.LCM(bus.resolve_url(None))
        self.heard: list[tuple[str, bytes]] = []
        self.times: list[float] = []
        self.bus.subscribe(".*", self._on_message).set_queue_capacity(0)

    def _on_message(self, channel: str, data: bytes) -> None:
        if channel != "LCM_SELF_TEST":
            self.heard.append((channel, data))
            self.times.append(time.monotonic())

    def listen(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self.bus.handle_timeout(max(1, round(left * 1e3)))

    def wait(self, condition: Callable[[], bool], what: str) -> None:
        """Listen until a condition is met."""
        end = time.monotonic() + 10
        while not condition():
            assert time.monotonic() < end, f"no {what}"
            self.listen(0.02)

    def follow(self, process: subprocess.Popen[Any], patience: float = 30) -> None:
        """Listen until a process has ended and nothing comes any more."""
        end = time.monotonic() + patience
        while process.poll() is None:
            assert time.monotonic() < end, "the player does not end"
            self.bus.handle_timeout(20)
        while self.bus.handle_timeout(100):
            pass


def messages(log: Path, *channels: str) -> list[tuple[str, bytes]]:
    """Messages of a log in its order."""
    return [
        (e.channel, e.data)
        for e in lcm.EventLog(str(log))
        if e.channel != "LCM_SELF_TEST" and (not channels or e.channel in channels)
    ]


def seconds_of(log: Path) -> float:
    stamps = [e.timestamp for e in lcm.EventLog(str(log)) if e.channel != "LCM_SELF_TEST"]
    return (max(stamps) - min(stamps)) * 1e-6


def test_play_sends_every_byte_in_order_and_in_time(short_log: Path) -> None:
    ears = Ears()
    player = start_leeway("replay", short_log, "--play", "--json")
    ears.follow(player)
    assert player.returncode == 0
    assert ears.heard == messages(short_log)
    assert ears.times[-1] - ears.times[0] == pytest.approx(seconds_of(short_log), abs=0.5)
    assert player.stdout is not None
    assert sum(json.loads(player.stdout.read())["sent"].values()) == len(ears.heard)


def test_play_faster_from_the_middle_on_some_channels(short_log: Path) -> None:
    ears = Ears()
    options = ["--speed", "5", "--seek", "1.5", "--channels", "JOINT_STATE|GOAL"]
    player = start_leeway("replay", short_log, "--play", *options)
    ears.follow(player)
    assert player.returncode == 0
    expected = messages(short_log, "JOINT_STATE")
    assert 50 < len(ears.heard) < len(expected)
    assert ears.heard == expected[-len(ears.heard) :]
    assert ears.times[-1] - ears.times[0] < 1.0


def test_lcm_logplayer_plays_our_logs(short_log: Path) -> None:
    ears = Ears()
    player = subprocess.Popen(
        [str(program("lcm-logplayer")), f"--lcm-url={bus.resolve_url(None)}", str(short_log)],
        stdout=subprocess.DEVNULL,
    )
    ears.follow(player)
    assert player.returncode == 0
    assert ears.heard == messages(short_log)


def test_play_stays_away_from_a_running_arm(root: Path, short_log: Path) -> None:
    with running("leeway-simulator", root / "scenarios" / "c1.yaml"):
        Listener().wait_for("JOINT_STATE", lambda s: True)
        refused = leeway("replay", short_log, "--play")
        assert refused.returncode == 1
        assert "JOINT_STATE is published on this bus already" in refused.stderr
        for remedy in ("--lcm-url", "--channels", "--force"):
            assert remedy in refused.stderr
        fast = ["--speed", "100"]
        assert (
            leeway("replay", short_log, "--play", "--channels", "OBSTACLES", *fast).returncode == 0
        )
        assert leeway("replay", short_log, "--play", "--force", *fast).returncode == 0


class Terminal:
    """`leeway replay --play` on a terminal of its own."""

    def __init__(self, *args: object) -> None:
        self.ours, theirs = pty.openpty()
        self.before = termios.tcgetattr(theirs)
        self.theirs = theirs
        command = [sys.executable, "-m", "leeway", "replay", *map(str, args)]
        self.process = subprocess.Popen(
            ["setsid", "--ctty", *command],
            stdin=theirs,
            stdout=theirs,
            stderr=theirs,
        )
        self.shown = ""

    def press(self, keys: bytes) -> None:
        os.write(self.ours, keys)

    def read(self) -> str:
        """All that was shown so far."""
        os.set_blocking(self.ours, False)
        with contextlib.suppress(BlockingIOError, OSError):
            while data := os.read(self.ours, 4096):
                self.shown += data.decode(errors="replace")
        return self.shown

    def end(self) -> int:
        """Wait for the end; close the terminal, which must be as before."""
        try:
            status = self.process.wait(10)
            assert termios.tcgetattr(self.theirs) == self.before
            self.read()
            return status
        finally:
            self.process.kill()
            self.process.wait()
            os.close(self.ours)
            os.close(self.theirs)


def test_keys_on_a_terminal(short_log: Path) -> None:
    ears = Ears()
    terminal = Terminal(short_log, "--play", "--speed", "0.2")
    ears.wait(lambda: bool(ears.heard), "first message")
    assert termios.tcgetattr(terminal.theirs) != terminal.before
    terminal.press(b" ")
    wait_until(lambda: "paused" in terminal.read(), 5, "pause on the screen")
    ears.listen(0.2)
    count = len(ears.heard)
    ears.listen(1.0)
    assert len(ears.heard) == count
    terminal.press(b" ")
    ears.listen(1.0)
    went_on = len(ears.heard) - count
    rate = len(messages(short_log)) / seconds_of(short_log) * 0.2
    assert 0 < went_on < 3 * rate
    terminal.press(b"\x1b[D")  # back to the beginning
    count = len(ears.heard)
    first = messages(short_log)[0]
    ears.wait(lambda: first in ears.heard[count:], "first message once more")
    terminal.press(b"+")
    wait_until(lambda: "x 0.5" in terminal.read(), 5, "speed on the screen")
    terminal.press(b"q")
    assert terminal.end() == 0
    assert "sent in" in terminal.shown


@pytest.mark.parametrize(
    ("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_a_signal_ends_playing_and_the_terminal_is_as_before(
    short_log: Path, number: signal.Signals, status: int
) -> None:
    ears = Ears()
    terminal = Terminal(short_log, "--play", "--speed", "0.1")
    ears.wait(lambda: bool(ears.heard), "first message")
    if number == signal.SIGINT:
        terminal.press(b"\x03")
    else:
        os.kill(terminal.process.pid, number)  # setsid has become the player
    assert terminal.end() == status
