"""The two programs' own options: transport, real-time wishes, statistics."""

import json
import shutil
import subprocess

import pytest
from helpers import Listener, running, wait_until

from leeway.processes import program

pytestmark = pytest.mark.usefixtures("private_network")

PROGRAMS = ("leeway-simulator", "leeway-controller")
FIFO, LOCKED, AWAKE, PINNED = 1, 2, 4, 8


def _statistics(root, tmp_path, *options):
    """Run both until the arm has moved for a second; return what --histogram wrote, by program."""
    scene = root / "scenarios" / "reach.yaml"
    files = {name: tmp_path / f"{name}.json" for name in PROGRAMS}
    listener = Listener()
    # The plant ends first, so that the controller waits for nothing.
    with running(PROGRAMS[1], scene, f"--histogram={files[PROGRAMS[1]]}", *options) as controller:
        with running(PROGRAMS[0], scene, f"--histogram={files[PROGRAMS[0]]}", *options) as plant:
            listener.wait_for("JOINT_STATE", lambda s: s.tick * s.period_ns > 1e9)
        wait_until(lambda: plant.poll() is not None, 5, "end of the simulator")
        controller.terminate()
        assert controller.wait(5) == 0
    return {name: json.loads(file.read_text()) for name, file in files.items()}


@pytest.mark.parametrize("transport", ["own", "lcm"])
def test_either_transport_carries_the_run(root, tmp_path, transport):
    for said in _statistics(root, tmp_path, f"--transport={transport}").values():
        assert said["ticks"] > 400
        assert said["unsent"] == said["minor_faults"] == said["major_faults"] == 0
        assert said["allocations"] == 0
        assert said["stale_ticks"] < 0.2 * said["ticks"]
        wake = said["wake_late_us"]
        assert sum(wake["bins"]) + wake["over"] == said["ticks"]


def test_nothing_is_asked_of_the_system_when_told_so(root, tmp_path):
    for said in _statistics(root, tmp_path, "--rt=off").values():
        assert said["realtime"] == 0
        assert said["ticks"] > 200


def _poor(*command):
    """Return a command without the right to priorities and locked memory."""
    if shutil.which("setpriv") is None:
        pytest.skip("no setpriv here")
    limits = ["prlimit", "--memlock=65536:65536", "--rtprio=0:0"]
    return [*limits, "setpriv", "--bounding-set=-sys_nice,-ipc_lock", *map(str, command)]


def test_requiring_what_is_refused_ends_the_program(root):
    for name in PROGRAMS:
        command = [program(name), root / "scenarios" / "c1.yaml", "--rt=require"]
        result = subprocess.run(
            _poor(*command), capture_output=True, text=True, timeout=20, check=False
        )
        assert result.returncode == 1, result.stderr
        assert "--rt=require: no real-time priority" in result.stderr
        assert "memory not locked" in result.stderr
        assert "leeway doctor" in result.stderr


def test_what_is_refused_is_said_and_shown(root):
    command = [program("leeway-simulator"), root / "scenarios" / "c1.yaml"]
    process = subprocess.Popen(_poor(*command), stderr=subprocess.PIPE, text=True)
    try:
        status = Listener().wait_for("PLANT_STATUS", lambda s: s.ticks > 0)
        assert not status.realtime & (FIFO | LOCKED)
    finally:
        process.terminate()
        _, said = process.communicate(timeout=10)
    assert "no real-time priority" in said
    assert process.returncode == 0


def test_the_cpu_asked_for_is_taken(root, tmp_path):
    for said in _statistics(root, tmp_path, "--cpu=0", "--priority=40").values():
        assert said["realtime"] & PINNED


@pytest.mark.parametrize(
    ("option", "expected"),
    [
        ("--rt=maybe", "--rt: expected one of auto, require, off"),
        ("--transport=tcp", "--transport: expected one of own, lcm"),
        ("--cpu=-1", "--cpu: expected a whole number from 0"),
        ("--priority=99", "--priority: expected a whole number from 2 to 98"),
    ],
)
def test_wrong_options_are_refused(root, option, expected):
    command = [program("leeway-controller"), root / "scenarios" / "c1.yaml", option]
    result = subprocess.run(command, capture_output=True, text=True, timeout=20, check=False)
    assert result.returncode == 2
    assert expected in result.stderr


def test_statistics_that_cannot_be_written_are_said(root, tmp_path):
    scene = root / "scenarios" / "c1.yaml"
    with running("leeway-simulator", scene, f"--histogram={tmp_path}/no/file") as process:
        Listener().wait_for("JOINT_STATE", lambda s: True)
        process.terminate()
        _, said = process.communicate(timeout=10)
    assert "no/file: cannot write the statistics" in said
