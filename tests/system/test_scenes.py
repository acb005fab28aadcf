"""Scenes whose obstacles move: the same samples in lockstep, live and in process."""

import contextlib
import select
import threading

import numpy as np
import pytest
from helpers import TYPES, leeway, motion, read, running
from relay import Bus, split
from rig import CONTROLLER_PORT, GROUP, PLANT_PORT, url_of

import leeway as package

pytestmark = pytest.mark.usefixtures("private_network")

# Every shape, every motion, noise and latency.
MIXED = """\
robot: ur5
rate_hz: 125
duration_s: 4
seed: 5
q0: [0, -1.2, 1.6, -0.4, 0, 0]
plant: {timeout_s: 0.04}
request: {goal: [0.25, -0.6, 0.25]}
sensor: {rate_hz: 40, noise_m: 0.004, latency_s: 0.03}
obstacles:
  - at: [-0.35, -0.5, 0.36]
    radius: 0.08
    motion: {kind: random, reach: [0.1, 0.1, 0.1], speed: 0.2}
  - shape: capsule
    at: [0.6, -0.6, 0.5]
    radius: 0.05
    half_length: 0.2
    motion: {kind: circle, centre: [0.6, -0.4, 0.5], period_s: 5}
  - shape: box
    at: [0.5, 0.5, 0.2]
    half_extents: [0.1, 0.1, 0.1]
    spin: [0, 0, 1]
    velocity: [0, -0.02, 0]
  - shape: hull
    at: [0.2, -0.9, 0.3]
    vertices: [[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]
    motion: {kind: waypoints, waypoints: [[0.6, -0.9, 0.3]], speed: 0.1, repeat: back_and_forth}
  - {shape: plane, at: [0, 0, -0.3]}
  - {at: [0.3, -0.3, 0.6], radius: 0.03, visible_s: [1, 2.5]}
"""
LOSE_EVERY = 4  # messages about obstacles


@pytest.fixture
def mixed(tmp_path):
    """Return the path of the mixed scene."""
    path = tmp_path / "mixed.yaml"
    path.write_text(MIXED)
    return path


def run(scene, log, *options):
    result = leeway("run", scene, "--log", log, *options)
    assert result.returncode == 0, result.stderr
    return log


# --- lockstep ---


def check_lockstep(scene, log, *options):
    sets = [option.removeprefix("--set=") for option in options]
    expected = package.simulate(package.load_scene(scene, sets))
    q, qd = motion(run(scene, log, "--lockstep", *options))
    np.testing.assert_array_equal(q, expected.q)
    np.testing.assert_array_equal(qd, expected.qd)
    return expected


def test_moving_obstacles_are_the_same_in_process(mixed, tmp_path):
    expected = check_lockstep(mixed, tmp_path / "run.lcm")
    # The obstacles matter: with another seed the arm goes another way.
    other = package.simulate(package.load_scene(mixed, ["seed=6"]))
    assert not np.array_equal(other.q, expected.q)


@pytest.mark.parametrize("name", ["scene_a", "scene_b", "crowd", "person", "moving_box", "table"])
def test_scenarios_are_the_same_in_process(root, tmp_path, name):
    check_lockstep(root / "scenarios" / f"{name}.yaml", tmp_path / "run.lcm", "--set=duration_s=3")


class LossyBridge:
    """Joins the plant's bus and the controller's, but loses some of what is told of obstacles."""

    def __init__(self):
        self.plant, self.controller = Bus(GROUP, PLANT_PORT), Bus(GROUP, CONTROLLER_PORT)
        self.told = self.lost = 0
        self.commands = {}  # newest by tick of the state it answers
        self._ended = False
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def end(self):
        self._ended = True
        self._thread.join()
        self.plant.socket.close()
        self.controller.socket.close()

    def _run(self):
        sockets = [self.plant.socket, self.controller.socket]
        while not self._ended:
            select.select(sockets, [], [], 0.05)
            self._forward(self.plant, self.controller, {"JOINT_STATE", "OBSTACLES", "HULL"})
            self._forward(self.controller, self.plant, {"JOINT_COMMAND"})

    def _forward(self, source, to, channels):
        while (datagram := source.receive()) is not None:
            found = split(datagram)
            if found is None or found[0] not in channels:
                continue
            if found[0] == "JOINT_COMMAND":
                command = TYPES[found[0]].decode(found[1])
                self.commands[command.state_tick] = command
            if found[0] in {"OBSTACLES", "HULL"}:
                self.told += 1
                if self.told % LOSE_EVERY == 0:
                    self.lost += 1
                    continue
            to.send(datagram)


@contextlib.contextmanager
def bridge():
    joined = LossyBridge()
    try:
        yield joined
    finally:
        joined.end()


def test_lost_obstacles_are_told_again(mixed):
    expected = package.simulate(mixed)
    with bridge() as joined:
        controller = ("--lockstep", "--lcm-url", url_of(CONTROLLER_PORT), mixed)
        simulator = ("--lockstep", "--lcm-url", url_of(PLANT_PORT), mixed)
        with (
            running("leeway-controller", *controller),
            running("leeway-simulator", *simulator) as s,
        ):
            assert s.wait(60) == 0, s.stderr.read()
    assert joined.lost > 40
    q = [joined.commands[tick].q for tick in range(len(expected.q))]
    np.testing.assert_array_equal(q, expected.q)


# --- live ---


def sightings(log):
    """Return what is told of obstacle 1: time of the message, position, velocity."""
    messages = [m for m in read(log, "OBSTACLES") if m.op == m.UPSERT]
    return [(m, o) for m in messages for o in m.o[: m.n] if o.id == 1]


def test_live_samples_are_those_of_lockstep(mixed, tmp_path):
    in_lockstep = run(mixed, tmp_path / "lockstep.lcm", "--lockstep")
    known = {tuple(o.p): (m.time_ns, o.v) for m, o in sightings(in_lockstep)}
    live = run(mixed, tmp_path / "live.lcm", "--set=sensor.latency_s=0.2")
    states = [s for s in read(live, "JOINT_STATE") if s.tick > 0]
    start_ns = states[0].h.mono_ns - states[0].tick * states[0].period_ns
    samples = set()
    for message, obstacle in sightings(live):
        motion_ns, v = known[tuple(obstacle.p)]
        assert obstacle.v == v
        assert message.valid_for_ms == 2000
        samples.add(motion_ns)
        if motion_ns > 1:  # sample 0 is told as long as the arm waits
            assert message.time_ns - start_ns == pytest.approx(motion_ns, abs=50_000_000)
    # 40 samples a second until 0.2 s before the end; a busy machine may leave out some.
    assert len(samples) > 100
