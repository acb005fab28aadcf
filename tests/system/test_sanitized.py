"""The programs as built with a sanitizer, running, with goals, obstacles and malformed packets.

LEEWAY_SANITIZED names the build folder (build/asan, build/tsan-clang); .ci/run sets it.
"""

from __future__ import annotations

import concurrent.futures
import contextlib
import itertools
import os
import re
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from helpers import wait_until
from wiretap import Wiretap

from leeway.bus import UPSERT, open_bus, resolve_url, send_goal, send_obstacles

FOLDER = os.environ.get("LEEWAY_SANITIZED", "")
RUN_S = 3.0
GOALS = ((0.25, -0.6, 0.25), (-0.3, -0.6, 0.2), (0.2, -0.5, 0.5))
# Transport -> packets of each kind. LCM's own threads would put the mix's huge fragments together,
# which takes minutes with a sanitizer's malloc.
ATTACKS = {
    "own": {"mix": 60_000},
    "lcm": dict.fromkeys(("damaged", "truncated", "not-finite", "no-nul", "new-name"), 3000),
}

pytestmark = [
    pytest.mark.usefixtures("private_network"),
    pytest.mark.skipif(not FOLDER, reason="LEEWAY_SANITIZED names no build folder"),
]


# Every report ends the program with a status of its own.
REPORTS = {
    "ASAN_OPTIONS": "exitcode=66",
    "UBSAN_OPTIONS": "print_stacktrace=1",
    "TSAN_OPTIONS": "halt_on_error=1:exitcode=66",
}


@contextlib.contextmanager
def _running(folder: Path, *command: str) -> Iterator[subprocess.Popen[str]]:
    """Run a sanitized program; assert that it ends well and reports nothing."""
    # The thread sanitizer cannot place its memory where addresses are too random.
    fixed = ["setarch", "--addr-no-randomize"] if shutil.which("setarch") else []
    process = subprocess.Popen(
        [*fixed, *command], stderr=subprocess.PIPE, text=True, env=os.environ | REPORTS, cwd=folder
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.terminate()
        try:
            said = process.communicate(timeout=20)[1]
        except subprocess.TimeoutExpired:
            process.kill()
            raise
        print(said)
    assert process.returncode == 0, said
    assert not re.search("Sanitizer|runtime error", said), said


def _attack(root: Path, sessions: tuple[int, int], packets: dict[str, int]) -> None:
    """Send malformed packets with the sessions of this pair, one kind after the other."""
    program = root / "build" / "dev" / "tests" / "bench_malformed"
    for kind, count in packets.items():
        command = [program, kind, count, 1, *sessions]
        subprocess.run(list(map(str, command)), stdout=subprocess.DEVNULL, check=True, timeout=60)


class Watch:
    """Newest message of each channel of the programs themselves."""

    def __init__(self) -> None:
        self._tap = Wiretap(patience_s=30)
        self._newest: dict[str, Any] = {}
        wait_until(lambda: self.look("JOINT_STATE").tick > 100, 30, "motion")

    def look(self, channel: str) -> Any:
        """Return the newest message of a channel."""
        wait_until(lambda: self._hears(channel), 5, channel)
        return self._newest[channel]

    def _hears(self, channel: str) -> bool:
        self._newest.update(self._tap.messages())
        return channel in self._newest


def _use(watch: Watch, seconds: float) -> None:
    """Send goals and obstacles one after the other for some time; each must be echoed."""
    end = time.monotonic() + seconds
    for number in itertools.count():
        bus = open_bus(resolve_url(None))
        assert send_goal(bus, None, GOALS[number % len(GOALS)]), "no echo of a goal"
        entry = (50 + number % 100, (1.5, 1.5, 0.5), 0.1)
        assert send_obstacles(bus, None, UPSERT, [entry]), "no echo of an obstacle"
        watch.look("JOINT_STATE")
        if time.monotonic() > end:
            return


@pytest.mark.parametrize("transport", ATTACKS)
def test_live_programs_have_nothing_to_report(root, tmp_path, transport):
    programs = root / FOLDER
    arguments = [str(root / "scenarios" / "reach.yaml"), f"--transport={transport}"]
    with (
        _running(tmp_path, str(programs / "leeway-simulator"), *arguments) as simulator,
        _running(tmp_path, str(programs / "leeway-controller"), *arguments) as controller,
        concurrent.futures.ThreadPoolExecutor() as pool,
    ):
        watch = Watch()
        sessions = watch.look("JOINT_STATE").h.session, watch.look("JOINT_COMMAND").h.session
        attack = pool.submit(_attack, root, sessions, ATTACKS[transport])
        _use(watch, RUN_S)
        wait_until(lambda: watch.look("JOINT_STATE") and attack.done(), 60, "end of the attack")
        attack.result()
        assert send_goal(open_bus(resolve_url(None)), None, None), "no echo of a stop"
        wait_until(lambda: not any(watch.look("JOINT_STATE").qd), 20, "rest")
        assert (simulator.poll(), controller.poll()) == (None, None)
