"""Scenes through Python: the same reader, the same messages."""

import math
import re
import threading
import time

import numpy as np
import pytest

import leeway
from leeway import crowd


def test_loads_from_path_and_from_text(root):
    path = root / "scenarios" / "c3.yaml"
    assert leeway.load_scene(path).to_dict() == leeway.load_scene(path.read_text()).to_dict()
    assert leeway.load_scene(str(path)).to_dict()["law"]["rho_rep"] == 1.9


def test_a_required_key_may_come_from_the_command_line():
    text = "robot: ur5\nq0: [0, 0, 0, 0, 0, 0]\n"
    scene = leeway.load_scene(text, ["request.goal=[0.1, 0.2, 0.3]"])
    assert scene.to_dict()["request"]["goal"] == [0.1, 0.2, 0.3]


def test_changed_copy_leaves_the_original(root):
    scene = leeway.load_scene(root / "scenarios" / "c1.yaml")
    changed = scene.with_({"law.rho_rep": 0.1 + 0.2, "q0": [0, -1.5, 0, 0, 0, 0]})
    assert changed.to_dict()["law"]["rho_rep"] == 0.1 + 0.2
    assert changed.to_dict()["q0"][1] == -1.5
    assert scene.to_dict()["law"]["rho_rep"] == 0.5


def test_obstacles_can_be_replaced(root):
    scene = leeway.load_scene(root / "scenarios" / "c1.yaml")
    balls = [{"at": [0.5, 0.5, 0.5], "radius": 0.1}, {"id": 9, "at": [1, 0, 0]}]
    rest = {
        "shape": "sphere",
        "velocity": [0, 0, 0],
        "start_s": 0,
        "visible_s": [0, math.inf],
        "motion": {"kind": "none"},
    }
    assert scene.with_({"obstacles": balls}).to_dict()["obstacles"] == [
        {"id": 1, "at": [0.5, 0.5, 0.5], "radius": 0.1} | rest,
        {"id": 9, "at": [1.0, 0.0, 0.0], "radius": 0.0} | rest,
    ]


def test_obstacles_of_every_shape_come_back_with_their_own_keys(root):
    scene = leeway.load_scene(root / "scenarios" / "c1.yaml")
    corners = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
    there = {"kind": "waypoints", "waypoints": [[1, 0, 0]], "times_s": [2.5]}
    obstacles = [
        {"shape": "capsule", "at": [1, 0, 0], "radius": 0.1, "half_length": 0.5, "motion": there},
        {"shape": "box", "at": [0, 1, 0], "half_extents": [0.1, 0.2, 0.3], "rpy_deg": [0, 0, 45]},
        {"shape": "hull", "at": [0, 0, 1], "vertices": corners},
        {"shape": "plane", "at": [0, 0, -1], "normal": [0, 1, 1]},
    ]
    capsule, box, hull, plane = scene.with_({"obstacles": obstacles}).to_dict()["obstacles"]
    assert (capsule["half_length"], capsule["motion"]["times_s"]) == (0.5, [2.5])
    assert capsule["motion"]["waypoints"] == [[1.0, 0.0, 0.0]]
    assert (box["half_extents"], box["rpy_deg"]) == ([0.1, 0.2, 0.3], [0.0, 0.0, 45.0])
    assert hull["vertices"] == corners.tolist()
    assert plane["normal"] == [0.0, 1.0, 1.0]
    assert "half_length" not in box
    assert "radius" not in plane


def test_a_tool_and_a_sensor_are_read(root):
    tool = {"kind": "capsule", "a": [0, 0, 0], "b": [0, 0, 0.2], "radius": 0.03}
    scene = leeway.load_scene(root / "scenarios" / "c1.yaml")
    changed = scene.with_({"tool": tool, "sensor.noise_m": 0.002, "seed": 9}).to_dict()
    assert (changed["tool"], changed["seed"]) == (tool, 9)
    assert changed["sensor"] == {
        "rate_hz": 10.0,
        "noise_m": 0.002,
        "latency_s": 0.0,
        "valid_for_s": 2.0,
    }


def test_the_crowd_is_what_its_writer_writes(root):
    assert (root / "scenarios" / "crowd.yaml").read_text() == crowd.write_crowd()
    obstacles = leeway.load_scene(root / "scenarios" / "crowd.yaml").to_dict()["obstacles"]
    assert len(obstacles) == crowd.COUNT
    assert {o["shape"] for o in obstacles} == {*crowd.SHAPES, "plane"}
    assert sum(o["motion"]["kind"] == "random" for o in obstacles) >= 19


def test_written_scene_reads_back_to_the_same_bits(root):
    for path in sorted((root / "scenarios").glob("*.yaml")):
        scene = leeway.load_scene(path)
        assert leeway.load_scene(scene.to_yaml()).to_dict() == scene.to_dict()


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("law.gama", 2, "unknown key"),
        ("law.rho_rep", "abc", 'expected a number > 0 (m), found "abc"'),
        ("law.rho_rep", float("nan"), 'found "nan"'),
        ("law.rho_rep", -1, "expected a number > 0"),
        ("law.rho_rep", 0, "expected a number > 0"),
        ("law.eta", 0, "expected a number > 0"),
        ("law.k_a", 0, "expected a number > 0"),
        ("q0", [0] * 5, "expected a list of 6 numbers"),
        ("q0", [0, 0, 0, 0, 0, 6.3], 'found "6.3"'),
        ("obstacles.0.half_length", 1, "with shape capsule only, found sphere"),
        ("obstacles", [{"at": [0, 0, 0], "shape": "hull", "vertices": [[0, 0]]}], "a list of 2"),
        ("seed", 0.5, "expected an integer"),
    ],
)
def test_refusals_name_the_key(root, key, value, message):
    scene = leeway.load_scene(root / "scenarios" / "c1.yaml")
    with pytest.raises(ValueError, match=re.escape(message)) as refused:
        scene.with_({key: value})
    assert key in str(refused.value)


def test_a_file_that_is_no_text_is_refused(tmp_path):
    path = tmp_path / "scene.yaml"
    path.write_bytes(b"\xff\xfe\x00robot")
    with pytest.raises(ValueError, match="not a text file"):
        leeway.load_scene(path)


def test_simulation_is_repeatable(root):
    scene = leeway.load_scene(root / "scenarios" / "reach.yaml")
    first, second = leeway.simulate(scene), leeway.simulate(scene)
    assert (first.q == second.q).all()
    assert len(first.t) == 12 * 500 + 1
    assert first.t[-1] == 12.0


def test_a_run_releases_the_interpreter(root):
    scene = leeway.load_scene(root / "scenarios" / "c4.yaml").with_({"duration_s": 2000})
    done = threading.Event()
    number = 0

    def count():
        nonlocal number
        while not done.is_set():
            number += 1

    thread = threading.Thread(target=count)
    thread.start()
    start, before = time.perf_counter(), number
    leeway.simulate(scene)
    counted, took = number - before, time.perf_counter() - start
    done.set()
    thread.join()
    # Were the lock held, the other thread would count for a switch interval of 5 ms at most.
    assert took > 0.05
    assert counted > 200_000
