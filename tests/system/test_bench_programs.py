"""The real-time bench's own programs: round trips over every link, the flood, no child left."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import lcm
import pytest
from helpers import TYPES, children_of, kill, wait_until

from leeway.bus import resolve_url
from rt.__main__ import missing_tools
from rt.histogram import from_json
from rt.load import flood_rate
from rt.machine import receivers
from rt.slices import LCM_PORT, LINKS

pytestmark = pytest.mark.usefixtures("private_network")


@pytest.fixture
def programs(root):
    """Folder of the bench's programs."""
    folder = root / "build" / "dev" / "tests"
    assert (folder / "bench_pingpong").exists(), "build preset dev first: ./dev test does"
    return folder


@pytest.mark.parametrize("link", LINKS)
def test_round_trips_come_back(programs, link):
    command = [programs / "bench_pingpong", link, "200", "0.5"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=30)
    assert result.returncode == 0, result.stderr
    said = json.loads(result.stdout)
    assert said["link"] == link
    trips = from_json(said["round_trip_us"])
    # One a period; a period that a busy machine makes it miss is counted.
    assert said["sent"] + said["skipped"] == pytest.approx(100, abs=2)
    assert trips.n == said["sent"] - said["lost"] > 50
    assert 1 < trips.percentile(0.5) < 20_000
    # What LCM sends: JOINT_STATE there, JOINT_COMMAND back, each behind its channel's name.
    for way, channel in (("there", "JOINT_STATE"), ("back", "JOINT_COMMAND")):
        size = len(TYPES[channel]().encode())
        assert said[f"bytes_{way}"] == 8 + len(channel) + 1 + size


def test_pong_does_not_outlive_ping(programs):
    ping = subprocess.Popen([programs / "bench_pingpong", "udp", "100", "60"])
    try:
        wait_until(lambda: bool(children_of(ping.pid)), 5, "pong")
        pong = children_of(ping.pid)["bench_pingpong"]
    finally:
        kill(ping.pid)
        ping.wait(5)
    wait_until(lambda: not _runs(pong), 5, "end of pong")


def _runs(pid):
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False
    return stat.rpartition(")")[2].split()[0] != "Z"


def test_the_flood_is_full_obstacle_messages_at_its_rate(programs):
    heard = []
    bus = lcm.LCM(resolve_url(None))
    bus.subscribe("FLOOD", lambda _, data: heard.append(data)).set_queue_capacity(0)
    assert receivers(LCM_PORT) == 1
    flood = subprocess.Popen([programs / "bench_flood", "2000"], stdout=subprocess.PIPE, text=True)
    start = time.monotonic_ns()
    try:
        while time.monotonic_ns() < start + 10**9:
            bus.handle_timeout(50)
    finally:
        flood.terminate()
        lines, _ = flood.communicate(timeout=5)
    assert flood.returncode == 0
    assert TYPES["OBSTACLES"].decode(heard[0]).n == 32
    # Its own account is what was heard; a busy machine may keep it from what was asked.
    first, last = (int(lines.splitlines()[k].split()[0]) for k in (0, -1))
    assert 500 < flood_rate(lines, [(first, last)]) < 2100
    sent = int(lines.splitlines()[-1].split()[1])
    assert sent - 100 <= len(heard) <= sent + 300


@pytest.mark.skipif(bool(missing_tools()), reason="no cyclictest or stress-ng")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_nothing_outlives_the_bench(root, number):
    bench = subprocess.Popen(
        [sys.executable, "-m", "rt", "--rates=1000", "--alternations=1", "--slice=1", "--seed=2"],
        env=os.environ | {"PYTHONPATH": str(root / "tests" / "bench")},
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        # The load comes with the second half.
        wait_until(lambda: "stress-ng" in children_of(bench.pid), 30, "load")
        wait_until(lambda: len(children_of(bench.pid)) > 2, 30, "contender under load")
        children = [pid for child in children_of(bench.pid).values() for pid in _family(child)]
        bench.send_signal(number)
        _, said = bench.communicate(timeout=30)
    finally:
        if bench.poll() is None:
            bench.kill()
            bench.wait(5)
    if number != signal.SIGKILL:
        assert bench.returncode == 130
        assert "interrupted after 1 of 2 conditions" in said
    assert len(children) > 4
    wait_until(lambda: not any(map(_runs, children)), 10, "end of the bench's children")


def _family(pid):
    """Return a process and its children."""
    return [pid, *children_of(pid).values()]


@pytest.mark.parametrize(
    "command", [["bench_pingpong"], ["bench_pingpong", "tcp", "1", "1"], ["bench_flood", "0"]]
)
def test_wrong_arguments_are_refused(programs, command):
    result = subprocess.run(
        [programs / command[0], *command[1:]], capture_output=True, text=True, timeout=5
    )
    assert result.returncode == 2
    assert result.stderr.startswith("usage: ")
