"""An obstacle put in the arm's way by lcm-spy and by command while it runs: it goes around."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from helpers import Listener, running
from helpers import leeway as command_line
from spy_driver import driving

import leeway
from leeway.logs.log import read_log

pytestmark = pytest.mark.usefixtures("private_network")

# The arm waits where it is until it is sent to the goal; the ball lies on the way of its tip.
GOAL, BALL, RADIUS, NUMBER = (0.25, -0.6, 0.25), (-0.13, -0.41, 0.23), 0.08, 7
SCENE = """robot: ur5
duration_s: 120
q0: [0, -1.2, 1.6, -0.4, 0, 0]
request:
  goal: [{}, {}, {}]
"""


def ball() -> tuple[leeway.Shape, np.ndarray]:
    pose = np.eye(4)
    pose[:3, 3] = BALL
    return leeway.Sphere(RADIUS), pose


def scene_file(folder: Path) -> Path:
    arm = leeway.Arm("ur5")
    tip = arm.fk(np.array([0, -1.2, 1.6, -0.4, 0, 0]))[:3, 3]
    path = folder / "wait.yaml"
    path.write_text(SCENE.format(*tip.tolist()))
    return path


def by_spy(folder: Path) -> None:
    with driving(folder) as spy:
        spy.open_dialog("WORLD")
        spy.fill(shape="sphere", id=NUMBER, position=BALL, size=RADIUS)
        spy.press("add")
        spy.wait_said("the controller has it")


def by_command(_: Path) -> None:
    words = ["--id", NUMBER, "--at", *BALL, "--radius", RADIUS]
    done = command_line("obstacle", "add", "sphere", *words)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("inject", [pytest.param(by_spy, marks=pytest.mark.gui), by_command])
def test_the_arm_goes_around(tmp_path: Path, inject: Callable[[Path], None]) -> None:
    scene, log_file = scene_file(tmp_path), tmp_path / "run.lcm"
    listener = Listener()
    with (
        running("lcm-logger", "-q", log_file),
        running("leeway-simulator", scene),
        running("leeway-controller", scene),
    ):
        listener.wait_for("JOINT_COMMAND", lambda c: c.mode == c.VELOCITY)
        inject(tmp_path)
        assert command_line("goal", *GOAL).returncode == 0
        listener.wait_for("JOINT_COMMAND", lambda c: c.deviation < 0.01 and c.goal == GOAL, 30)
    log = read_log(log_file)
    c = log.commands
    moving = np.flatnonzero((c.goal == GOAL).all(axis=1))
    assert (c.obstacle_count[moving] == 1).all()
    told = log.worlds.id[log.worlds.n > 0, 0]
    assert len(told) > 0
    assert (told == NUMBER).all()
    around = leeway.clearance(leeway.Arm("ur5"), c.q[moving], [ball()])
    assert around.min() > 0
    np.testing.assert_allclose(around, c.clearance[moving], atol=1e-9)
    # Without the ball the same arm goes through where it is.
    free = leeway.load_scene(scene).with_({"request.goal": list(GOAL), "duration_s": 20})
    straight = leeway.simulate(free)
    assert leeway.clearance(leeway.Arm("ur5"), straight.q, [ball()]).min() < -0.1
