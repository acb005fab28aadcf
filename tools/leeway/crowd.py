"""A scene with a crowd of obstacles: scenarios/crowd.yaml.

    python -m leeway.crowd > scenarios/crowd.yaml

Units are SI, positions in the base frame of the arm.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from leeway.arm import Arm

Array = npt.NDArray[np.float64]

SEED = 2020
COUNT = 200
SHAPES = ("sphere", "capsule", "box", "hull")
START, END = (0.0, -1.2, 1.6, -0.4, 0.0, 0.0), (1.4, -1.0, 1.4, -0.4, 0.0, 0.0)
NEAREST, FARTHEST = 0.35, 1.3  # from the shoulder, m
ROOM = (
    0.16  # between the surfaces and the lines between joints, on a straight way in joint space, m
)
WANDERERS = 10  # every so many-th moves

HEAD = """\
# A crowd: a UR5 among 200 obstacles of four shapes above a table; every tenth wanders about.
# Written by python -m leeway.crowd, which draws them so that a way is left: whoever goes straight
# from q0 to q = {end} keeps the lines between the joints {room:g} m
# away from all of them.
robot: ur5
duration_s: 12
seed: {seed}
q0: {start}

# A longer reach of the repulsion adds up over the crowd, and the arm stands still half way.
law:
  rho_rep: 0.1
  eta: 0.01
  k_a: 1
  r0: 0.05
  remedy: none

request:
  goal: {goal}

sensor: {{noise_m: 0.002}}

obstacles:
  - {{id: 1, shape: plane, at: [0, 0, -0.4]}}
"""


def write_crowd() -> str:
    """Return the text of the scene."""
    arm = Arm("ur5")
    goal = arm.fk(np.array(END))[:3, 3]
    head = HEAD.format(
        end=_numbers(END), room=ROOM, seed=SEED, start=_numbers(START), goal=_numbers(goal)
    )
    return head + "".join(f"  - {{{line}}}\n" for line in _obstacles(_line_points(arm)))


def _line_points(arm: Arm) -> Array:
    """Return points, (n, 3), on the lines between the joints along the way that is left free."""
    way = np.linspace(START, END, 40)
    joints = np.concatenate([np.zeros((40, 1, 3)), arm.frames(way)[:, :, :3, 3]], axis=1)
    share = np.linspace(0, 1, 12)[:, None, None, None]
    points: Array = (joints[:, :-1] * (1 - share) + joints[:, 1:] * share).reshape(-1, 3)
    return points


def _obstacles(arm_points: Array) -> Iterator[str]:
    """Yield the keys of each obstacle."""
    random = np.random.default_rng(SEED)
    number = 1
    while number < COUNT:
        direction = random.normal(size=3)
        distance = random.uniform(NEAREST, FARTHEST)
        at = np.array([0, 0, 0.09]) + distance * direction / np.linalg.norm(direction)
        shape = SHAPES[number % len(SHAPES)]
        keys, bound = _shape(shape, random)
        moves = number % WANDERERS == 0
        room = ROOM + bound + (0.06 if moves else 0)
        if at[2] - bound < -0.38 or np.linalg.norm(arm_points - at, axis=1).min() < room:
            continue
        number += 1
        motion = ", motion: {kind: random, reach: [0.03, 0.03, 0.03], speed: 0.1}" if moves else ""
        yield f"id: {number}, shape: {shape}, at: {_numbers(at)}, {keys}{motion}"


def _shape(shape: str, random: np.random.Generator) -> tuple[str, float]:
    """Return the keys of a shape's size and orientation, and a radius that holds it."""
    turned = f"rpy_deg: {_numbers(random.integers(-180, 180, size=3))}"
    size = random.uniform(0.02, 0.06)
    if shape == "sphere":
        return f"radius: {size:.3f}", size
    if shape == "capsule":
        half = random.uniform(0.03, 0.1)
        return f"{turned}, radius: {size:.3f}, half_length: {half:.3f}", half + size
    if shape == "box":
        half_extents = random.uniform(0.02, 0.07, size=3)
        keys = f"{turned}, half_extents: {_numbers(half_extents)}"
        return keys, float(np.linalg.norm(half_extents))
    corners = random.normal(size=(random.integers(4, 13), 3))
    corners *= 0.07 / np.linalg.norm(corners, axis=1, keepdims=True)
    vertices = ", ".join(_numbers(corner) for corner in corners)
    return f"vertices: [{vertices}], rounding: 0.005", 0.075


def _numbers(values: npt.ArrayLike) -> str:
    return "[" + ", ".join(f"{value:.6g}" for value in np.round(np.asarray(values), 3)) + "]"


if __name__ == "__main__":
    sys.stdout.write(write_crowd())
