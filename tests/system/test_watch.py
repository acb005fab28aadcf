"""`leeway status` with the real programs."""

from __future__ import annotations

import json
import os
import pty
import select
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import lcm
import pytest
from helpers import Listener, kill, leeway, running

from leeway.bus import resolve_url
from leeway.doctor.machine import try_fifo

pytestmark = pytest.mark.usefixtures("private_network")
PATIENCE_S = 15.0


def programs(*options: str) -> dict[str, Any]:
    """Ask for the status; return it by program."""
    result = leeway("status", "--json", *options)
    assert result.returncode == 0, result.stderr
    return {p["program"]: p for p in json.loads(result.stdout)["programs"]}


@contextmanager
def moving(root: Path, *options: str) -> Iterator[tuple[Any, Any]]:
    """Run both programs by hand until the block ends; the arm moves when it begins."""
    scene = root / "scenarios" / "reach.yaml"
    with (
        running("leeway-simulator", scene, *options) as simulator,
        running("leeway-controller", scene, *options) as controller,
    ):
        if not options:
            Listener().wait_for("JOINT_STATE", lambda s: max(map(abs, s.qd)) > 0.05)
        yield controller, simulator


def wait_for(condition: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """Ask for the simulator's status until it meets a condition; return it."""
    end = time.monotonic() + PATIENCE_S
    while not condition(simulator := programs()["leeway-simulator"]):
        assert time.monotonic() < end, simulator
    return simulator


def test_both_programs_are_told(root: Path) -> None:
    with moving(root):
        lcm.LCM(resolve_url(None)).publish("JOINT_COMMAND", b"no command")
        wait_for(lambda simulator: simulator["refused"].get("size") == 1)
        found = programs()
        table = leeway("status")
    controller, simulator = found["leeway-controller"], found["leeway-simulator"]
    for one, other in ((controller, simulator), (simulator, controller)):
        assert one["state"] == "running"
        assert one["peer_session"] == other["session"]
        assert one["rate_hz"] == 500
        assert one["measured_hz"] == pytest.approx(500, rel=0.1)
        assert one["ticks"] > 0
        assert one["exec_us"]["p50"] > 0
        assert ("fifo" in one["realtime"]) == try_fifo(80)
    assert controller["clearance"] > 0
    assert simulator["clearance"] is None
    assert table.stdout.splitlines()[0].split() == ["controller", "simulator"]
    assert "\x1b" not in table.stdout


def test_a_second_controller_is_shown_and_takes_over(root: Path) -> None:
    scene = root / "scenarios" / "reach.yaml"
    with moving(root) as (controller, _), running("leeway-controller", scene):
        simulator = wait_for(lambda s: "lease" in s["faults"])
        heard = json.loads(leeway("status", "--json").stdout)["programs"]
        assert [p["program"] for p in heard].count("leeway-controller") == 2
        assert simulator["refused"]["foreign"] > 0
        assert simulator["takeovers"] == 0
        controller.terminate()
        assert controller.wait(5) == 0
        after = wait_for(lambda s: s["takeovers"] == 1)
        assert after["peer_session"] != simulator["peer_session"]


def test_a_robot_has_a_status_of_its_own(root: Path) -> None:
    with moving(root, "--name=ARM1"):
        end = time.monotonic() + PATIENCE_S
        while leeway("status", "--quiet", "--name", "ARM1").returncode != 0:
            assert time.monotonic() < end
        assert leeway("status", "--quiet").returncode == 1


class Terminal:
    """A command on a terminal of its own."""

    def __init__(self, *args: str) -> None:
        self.said = ""
        self.pid, self._file = pty.fork()
        if self.pid == 0:
            os.environ["TERM"] = "xterm"
            os.execv(sys.executable, [sys.executable, "-m", "leeway", *args])

    def wait_for(self, condition: Callable[[str], bool]) -> None:
        """Read until what was said meets a condition."""
        end = time.monotonic() + PATIENCE_S
        while not condition(self.said):
            assert time.monotonic() < end, self.said[-2000:]
            if select.select([self._file], [], [], 0.1)[0]:
                self.said += os.read(self._file, 65536).decode(errors="replace")

    def press_ctrl_c(self) -> int:
        """Press Ctrl-C; return the exit status."""
        os.write(self._file, b"\x03")
        # A terminal that nobody reads would hold the program up.
        end = time.monotonic() + PATIENCE_S
        while (ended := os.waitpid(self.pid, os.WNOHANG))[0] == 0:
            assert time.monotonic() < end, "Ctrl-C did not end it"
            if select.select([self._file], [], [], 0.05)[0]:
                try:
                    self.said += os.read(self._file, 65536).decode(errors="replace")
                except OSError:
                    continue
        os.close(self._file)
        return os.waitstatus_to_exitcode(ended[1])


def test_watching_follows_and_ends_at_ctrl_c(root: Path) -> None:
    terminal = Terminal("status", "--watch")
    try:
        terminal.wait_for(lambda said: "no controller and no simulator" in said)
        with moving(root) as (_, simulator):
            terminal.wait_for(lambda said: said.count("running") > 10)
            kill(simulator.pid)
            terminal.wait_for(lambda said: "silent for" in said and "peer timeout" in said)
        assert terminal.press_ctrl_c() == 130
    except BaseException:
        kill(terminal.pid, signal.SIGKILL)
        raise
    assert "Traceback" not in terminal.said
