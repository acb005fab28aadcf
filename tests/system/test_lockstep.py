"""Two processes in lockstep over LCM give the numbers of the in-process run, bit for bit."""

import json
import signal

import numpy as np
import pytest
from helpers import Listener, leeway, motion, read, start_leeway

import leeway as package

GAINS = {1: 3, 2: 20}


def _run(root, tmp_path, name, *sets):
    log = tmp_path / f"{name}.lcm"
    options = [f"--set={one}" for one in sets]
    result = leeway(
        "run", root / "scenarios" / f"{name}.yaml", "--lockstep", "--log", log, *options
    )
    assert result.returncode == 0, result.stderr
    scene = package.load_scene(root / "scenarios" / f"{name}.yaml")
    changes = dict(one.split("=", 1) for one in sets)
    return log, package.simulate(scene.with_(changes))


@pytest.mark.usefixtures("private_network")
@pytest.mark.parametrize("case", ["c1", "c2", "c3", "c4"])
@pytest.mark.parametrize("gamma", [1, 2])
@pytest.mark.parametrize("attraction", ["cone", "cone_par"])
def test_equals_simulate(root, tmp_path, case, gamma, attraction):
    sets = (f"law.gamma={gamma}", f"law.eta={GAINS[gamma]}", f"law.attraction={attraction}")
    log, expected = _run(root, tmp_path, case, *sets)
    q, qd = motion(log)
    np.testing.assert_array_equal(q, expected.q)
    np.testing.assert_array_equal(qd, expected.qd)


@pytest.mark.usefixtures("private_network")
def test_equals_simulate_with_limits_and_a_faster_plant(root, tmp_path):
    log, expected = _run(root, tmp_path, "reach", "plant.rate_hz=2000", "duration_s=2")
    q, qd = motion(log)
    np.testing.assert_array_equal(q, expected.q)
    np.testing.assert_array_equal(qd, expected.qd)
    assert len(read(log, "JOINT_STATE")) >= 4 * 1000


@pytest.mark.usefixtures("private_network")
def test_lockstep_is_not_bound_to_real_time(root, tmp_path):
    log, _ = _run(root, tmp_path, "c4")
    commands = read(log, "JOINT_COMMAND")
    assert len(commands) >= 1001
    # 0.7 s at the usual pace, up to 2.7 s where it had to be recorded again; the motion lasts 8 s.
    assert (commands[-1].h.mono_ns - commands[0].h.mono_ns) * 1e-9 < 4.0


@pytest.mark.usefixtures("private_network")
def test_the_log_holds_the_scene_in_force(root, tmp_path):
    log, _ = _run(root, tmp_path, "c2", "law.rho_rep=1.25", "duration_s=0.5")
    scenes = read(log, "SCENE")
    assert {s.program for s in scenes} == {"leeway-controller", "leeway-simulator"}
    for scene in scenes:
        assert scene.mode == "lockstep"
        assert package.load_scene(scene.yaml).to_dict()["law"]["rho_rep"] == 1.25


@pytest.mark.usefixtures("private_network")
def test_several_robots_share_a_bus(root, tmp_path):
    log = tmp_path / "arm1.lcm"
    scene = root / "scenarios" / "c3.yaml"
    result = leeway("run", scene, "--lockstep", "--log", log, "--name", "ARM1", "--json")
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout)["final_deviation"] == pytest.approx(0.242363, abs=1e-6)


@pytest.mark.usefixtures("private_network")
def test_ctrl_c_brings_the_arm_to_rest_first(root, tmp_path):
    log = tmp_path / "run.lcm"
    options = ["--lockstep", "--set=duration_s=600", "--log", log]
    process = start_leeway("run", root / "scenarios" / "reach.yaml", *options)
    try:
        Listener().wait_for("JOINT_STATE", lambda s: max(map(abs, s.qd)) > 0.05, seconds=20)
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=10)[1]
    finally:
        if process.poll() is None:
            process.kill()
    assert process.returncode == 130, said
    assert "brought to rest" in said
    assert not any(read(log, "JOINT_STATE")[-1].qd)


@pytest.mark.usefixtures("private_network")
def test_fast_commands_are_the_same_on_the_bus(root, tmp_path):
    log, expected = _run(root, tmp_path, "c4", "law.k_a=1000", "duration_s=0.4")
    q, _ = motion(log)
    assert abs(expected.qd).max() > 100
    np.testing.assert_array_equal(q, expected.q)
