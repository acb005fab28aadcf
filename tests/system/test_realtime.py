"""Real time: fixed-rate processes against the clock, recorded by lcm-logger."""

import json
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from helpers import Listener, children_of, kill, leeway, read, running, start_leeway, wait_until

import leeway as package
from leeway.processes import program

pytestmark = pytest.mark.usefixtures("private_network")


def _velocities(log):
    """Plant's joint velocities by tick, the ticks, and its period."""
    rows = {s.tick: s for s in read(log, "JOINT_STATE")}
    ticks = sorted(rows)
    return np.array([rows[t].qd for t in ticks]), np.array(ticks), rows[ticks[0]].period_ns * 1e-9


@pytest.mark.parametrize("case", ["c1", "c2", "c3", "c4"])
def test_ends_where_lockstep_ends(root, tmp_path, case):
    scene = root / "scenarios" / f"{case}.yaml"
    result = leeway("run", scene, "--log", tmp_path / "run.lcm", "--json")
    assert result.returncode == 0, result.stderr
    deviation = json.loads(result.stdout)["final_deviation"]
    if case in ("c1", "c2"):
        assert deviation < 0.012  # the pure cone chatters
    else:
        expected = package.simulate(package.load_scene(scene)).deviation[-1]
        assert deviation == pytest.approx(expected, abs=0.002)


def test_limits_are_kept_and_used(root, tmp_path):
    log = tmp_path / "reach.lcm"
    limits = ["limits.velocity=0.3", "limits.acceleration=2"]
    plant = ["plant.velocity=0.3", "plant.acceleration=2"]
    sets = [f"--set={one}" for one in [*limits, *plant, "duration_s=4"]]
    result = leeway("run", root / "scenarios" / "reach.yaml", "--log", log, "--json", *sets)
    assert result.returncode == 0, result.stderr
    qd, ticks, period = _velocities(log)
    assert abs(qd).max() <= 0.3 * (1 + 1e-9)
    acceleration = np.diff(qd, axis=0)[np.diff(ticks) == 1] / period
    assert abs(acceleration).max() <= 2 * (1 + 1e-9)
    # Never slower than required: a command that is not the wish has a joint at a bound.
    commands = [c for c in read(log, "JOINT_COMMAND") if c.mode == c.VELOCITY]
    command = np.array([c.qd for c in commands])
    # A stop request wishes rest, and so does a plant that has ended.
    wish = np.array(
        [np.zeros(6) if c.flags & (c.STOPPED | c.STALE) else c.qd_law for c in commands]
    )
    assert len(commands) > 1500
    before, command, wish = command[:-1], command[1:], wish[1:]
    short = np.abs(command - wish).max(axis=1) > 1e-12
    at_velocity = np.abs(command).max(axis=1) >= 0.3 * (1 - 1e-9)
    at_acceleration = np.abs(command - before).max(axis=1) >= 2 * period * (1 - 1e-6)
    assert short.sum() > 100
    assert (at_velocity | at_acceleration)[short].all()


def test_obstacle_and_goal_change_the_motion_at_once(root, tmp_path):
    scene, log = root / "scenarios" / "c1.yaml", tmp_path / "hand.lcm"
    with running("lcm-logger", "-q", log) as logger:
        wait_until(lambda: log.exists(), 5, "log")
        with running("leeway-simulator", scene), running("leeway-controller", scene):
            listener = Listener()
            listener.wait_for("JOINT_STATE", lambda s: s.tick > 100)
            at = ["--at", -0.35, -0.45, 0.3]
            added = leeway("obstacle", "add", *at, "--radius", 0.05, "--id", 77)
            assert added.returncode == 0, added.stderr
            pushed = listener.wait_for("JOINT_COMMAND", lambda c: c.obstacle_count == 2)
            moved = leeway("goal", "-0.3", "-0.6", "0.2")
            assert moved.returncode == 0, moved.stderr
            listener.wait_for("JOINT_COMMAND", lambda c: c.goal[0] == -0.3)
            assert pushed.world_version >= 2
        logger.terminate()
        assert logger.wait(5) == 0
    _assert_events(log, tmp_path)


def _assert_events(log, tmp_path):
    commands = read(log, "JOINT_COMMAND")
    # The wish changes in the very tick that first knows the obstacle, and so with the goal.
    first = next(i for i, c in enumerate(commands) if c.obstacle_count == 2)
    step = np.abs(np.subtract(commands[first].qd_law, commands[first - 1].qd_law)).max()
    usual = np.abs(np.subtract(commands[first - 1].qd_law, commands[first - 2].qd_law)).max()
    assert step > 10 * usual
    result = leeway("report", log, "-o", tmp_path / "report", "--json")
    assert result.returncode == 0, result.stderr
    events = json.loads(result.stdout)["logs"][0]["events"]
    texts = [f"{e['kind']} {e['text']}" for e in events]
    assert any("77" in t and "obstacle" in t.lower() for t in texts), texts
    assert any("goal" in t.lower() and "-0.3" in t for t in texts), texts
    assert (tmp_path / "report" / "report.html").stat().st_size > 100_000


def test_stop_brakes_and_a_goal_moves_again(root):
    scene = root / "scenarios" / "reach.yaml"
    with running("leeway-simulator", scene), running("leeway-controller", scene):
        listener = Listener()
        listener.wait_for("JOINT_STATE", lambda s: s.tick > 200 and max(map(abs, s.qd)) > 0.05)
        assert leeway("stop").returncode == 0
        rest = listener.wait_for("JOINT_STATE", lambda s: not any(s.qd))
        assert rest.plant_mode == rest.MOVING
        assert leeway("goal", "0.2", "-0.6", "0.4").returncode == 0
        listener.wait_for("JOINT_STATE", lambda s: max(map(abs, s.qd)) > 0.05)


def test_commands_that_cease_ramp_the_plant_to_rest(root, tmp_path):
    scene, log = root / "scenarios" / "reach.yaml", tmp_path / "cease.lcm"
    with running("lcm-logger", "-q", log) as logger:
        wait_until(lambda: log.exists(), 5, "log")
        with running("leeway-simulator", scene) as simulator:
            listener = Listener()
            with running("leeway-controller", scene) as controller:
                listener.wait_for(
                    "JOINT_STATE", lambda s: s.tick > 200 and max(map(abs, s.qd)) > 0.05
                )
                kill(controller.pid)
                listener.wait_for(
                    "JOINT_STATE", lambda s: s.plant_mode == s.STOPPING and not any(s.qd)
                )
            # The program says it too.
            simulator.terminate()
            said = simulator.communicate(timeout=5)[1]
            assert "no command for 20 ms" in said
        logger.terminate()
        logger.wait(5)
    qd, ticks, period = _velocities(log)
    acceleration = np.diff(qd, axis=0)[np.diff(ticks) == 1] / period
    assert abs(acceleration).max() <= 8 * (1 + 1e-9)


@pytest.mark.parametrize("victim", ["leeway-simulator", "leeway-controller", "lcm-logger"])
def test_a_killed_process_ends_the_run(root, tmp_path, victim):
    log = tmp_path / "run.lcm"
    process = start_leeway("run", root / "scenarios" / "reach.yaml", "--log", log)
    try:
        Listener().wait_for("JOINT_STATE", lambda s: s.tick > 500, seconds=20)
        kill(children_of(process.pid)[victim])
        killed = time.monotonic()
        said = process.communicate(timeout=10)[1]
    finally:
        if process.poll() is None:
            process.kill()
    assert time.monotonic() - killed < 2
    assert process.returncode == 1
    assert f"{victim} was ended by SIGKILL" in said
    assert len(said.splitlines()) <= 4
    assert not children_of(process.pid)
    # The log is whole up to the last flush before the kill.
    assert len(read(log, "JOINT_STATE")) > 400


def test_ctrl_c_brings_the_arm_to_rest_first(root, tmp_path):
    log = tmp_path / "run.lcm"
    process = start_leeway("run", root / "scenarios" / "reach.yaml", "--log", log)
    try:
        moving = Listener().wait_for(
            "JOINT_STATE", lambda s: s.tick > 500 and max(map(abs, s.qd)) > 0.05, seconds=20
        )
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=10)[1]
    finally:
        if process.poll() is None:
            process.kill()
    assert process.returncode == 130
    assert "brought to rest" in said
    states = read(log, "JOINT_STATE")
    assert states[-1].tick > moving.tick
    assert not any(states[-1].qd)
    qd, ticks, period = _velocities(log)
    assert abs(np.diff(qd, axis=0)[np.diff(ticks) == 1]).max() <= 8 * period * (1 + 1e-9)


def test_programs_by_hand_end_in_order_on_ctrl_c(root):
    scene = root / "scenarios" / "reach.yaml"
    with (
        running("leeway-simulator", scene) as simulator,
        running("leeway-controller", scene) as controller,
    ):
        Listener().wait_for("JOINT_STATE", lambda s: s.tick > 200)
        for process in (controller, simulator):
            process.send_signal(signal.SIGINT)
            assert process.wait(5) == 130


def test_a_second_run_in_a_row_works(root, tmp_path):
    for name in ("first", "second"):
        result = leeway(
            "run",
            root / "scenarios" / "c1.yaml",
            "--log",
            tmp_path / f"{name}.lcm",
            "--set=duration_s=0.5",
        )
        assert result.returncode == 0, result.stderr
    assert program("leeway-controller").exists()


def test_an_old_log_does_not_pass_for_the_new_one(root, tmp_path):
    log = tmp_path / "run.lcm"
    log.write_bytes(b"old")
    scene = root / "scenarios" / "c1.yaml"
    result = leeway("run", scene, "--log", log, "--force", "--lockstep", "--set=duration_s=0.1")
    assert result.returncode == 0, result.stderr
    assert {s.program for s in read(log, "SCENE")} == {"leeway-controller", "leeway-simulator"}


def test_a_second_run_on_the_same_bus_is_refused(root, tmp_path):
    scene = root / "scenarios" / "c1.yaml"
    with running("leeway-simulator", scene):
        Listener().wait_for("JOINT_STATE", lambda s: True)
        result = leeway("run", scene, "--log", tmp_path / "run.lcm")
    assert result.returncode == 1
    assert "another run is on this bus" in result.stderr
    assert not (tmp_path / "run.lcm").exists()


def test_a_plant_that_died_while_ramping_does_not_keep_the_controller(root):
    scene = root / "scenarios" / "reach.yaml"
    slow = ["--set=limits.acceleration=0.2", "--set=plant.acceleration=0.2"]
    with (
        running("leeway-controller", scene, *slow) as controller,
        running("leeway-simulator", scene, *slow) as simulator,
    ):
        listener = Listener()
        listener.wait_for("JOINT_STATE", lambda s: max(map(abs, s.qd)) > 0.1)
        simulator.send_signal(signal.SIGTERM)  # ramps for half a second and more
        listener.wait_for("JOINT_STATE", lambda s: s.plant_mode == s.STOPPING)
        kill(simulator.pid)
        controller.send_signal(signal.SIGINT)
        assert controller.wait(5) == 130


def test_a_small_memory_lock_limit_is_told_and_survived(root, tmp_path):
    scene = root / "scenarios" / "c1.yaml"
    limits = [
        "prlimit",
        "--memlock=8388608:8388608",
        "setpriv",
        "--bounding-set=-all",
        "--inh-caps=-all",
    ]
    options = ["--log", tmp_path / "run.lcm", "--set=duration_s=0.5"]
    command = [*limits, sys.executable, "-m", "leeway", "run", scene, *options]
    result = subprocess.run(
        [str(c) for c in command], capture_output=True, text=True, timeout=30, check=False
    )
    assert result.returncode == 0, result.stderr
