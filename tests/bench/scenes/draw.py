"""Random scenes whose goal can be reached by some configuration, drawn from a seed and a number.

Lengths in m, angles in rad (degrees where a key says so), times in s, in the arm's base frame.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

import leeway
from scenes.truth import Truth, self_clearance

Array = npt.NDArray[np.float64]
Rng = np.random.Generator

DURATION_S = 20.0
RATE_HZ = 125
MARGIN = 0.03  # from any obstacle, at any time, to start, goal configuration and base
SELF_MARGIN = 0.03  # between links, at start and goal
APART = (0.3, 1.3)  # from the tip's start to its goal
MOVING_OF_TEN = 3  # scenes of ten in which something moves
SPEED = (0.05, 0.3)
LOW, HIGH = np.array([-np.pi, -np.pi, -2.6] + [-np.pi] * 3), np.array([np.pi, 0, 2.6] + [np.pi] * 3)
TRIES = 64


@dataclass(frozen=True)
class RandomScene:
    """A scene and what the generator knows about it."""

    number: int
    moving: bool
    start: Array
    goal_q: Array
    goal: Array
    obstacles: list[dict[str, Any]]

    def text(self) -> str:
        """Write it as a scene file."""
        told = {
            "robot": "ur5",
            "rate_hz": RATE_HZ,
            "duration_s": DURATION_S,
            "q0": self.start.tolist(),
            "request": {"goal": self.goal.tolist()},
            "obstacles": self.obstacles,
        }
        return json.dumps(told) + "\n"


def draw_scene(seed: int, number: int) -> RandomScene:
    """Draw scene `number` of a seed; each is the same whichever others are drawn."""
    rng = np.random.default_rng([seed, number])
    arm = leeway.Arm("ur5")
    moving = number % 10 >= 10 - MOVING_OF_TEN
    while True:
        start, goal_q = _ends(rng, arm)
        ends = np.stack([start, goal_q])
        wanted = int(rng.integers(1, 11))
        movers = int(rng.integers(1, min(3, wanted) + 1)) if moving else 0
        obstacles = [_obstacle(rng, arm, ends, k < movers) for k in range(wanted)]
        if None not in obstacles:
            goal = np.round(arm.fk(goal_q)[:3, 3], 9)
            found = [o for o in obstacles if o is not None]
            return RandomScene(number, moving, start, goal_q, goal, found)


def _ends(rng: Rng, arm: leeway.Arm) -> tuple[Array, Array]:
    """Two configurations clear of themselves and above the base, their tips some way apart."""
    while True:
        q = np.round(rng.uniform(LOW, HIGH, (TRIES, 6)), 9)
        above = arm.frames(q)[:, 1:, 2, 3].min(axis=1) > 0.05
        q = q[above & (self_clearance(arm, q) > SELF_MARGIN)]
        tips = arm.fk(q)[:, :3, 3]
        for k in range(1, len(q)):
            if APART[0] < np.linalg.norm(tips[k] - tips[0]) < APART[1]:
                return q[0], q[k]


def _obstacle(rng: Rng, arm: leeway.Arm, ends: Array, moves: bool) -> dict[str, Any] | None:
    """Draw an obstacle in the way that leaves start, goal and base alone; None if none is found."""
    for _ in range(TRIES):
        drawn = _shape(rng) | {"at": _rounded(_place(rng, arm, ends))}
        if drawn["shape"] != "sphere":
            drawn["rpy_deg"] = _rounded(rng.uniform(-180, 180, 3))
        if moves:
            drawn |= _motion(rng, np.array(drawn["at"]))
        if Truth([drawn], _times()).least(arm, ends) > MARGIN:
            return drawn
    return None


def _times() -> Array:
    return np.linspace(0, DURATION_S, 201)


def _rounded(values: Array) -> list[float]:
    return [round(float(v), 6) for v in values]


def _place(rng: Rng, arm: leeway.Arm, ends: Array) -> Array:
    """Draw a place near the straight way of the tip, or near the arm somewhere between its ends."""
    if rng.random() < 0.5:
        tips = arm.fk(ends)[:, :3, 3]
        on_way = tips[0] + rng.uniform(0.1, 0.9) * (tips[1] - tips[0])
        return np.asarray(on_way + rng.normal(0, 0.06, 3))
    frames = arm.frames(ends[0] + rng.uniform(0, 1) * (ends[1] - ends[0]))
    origins = frames[:, :3, 3]
    link = int(rng.integers(0, 5))
    on_link = origins[link] + rng.uniform(0, 1) * (origins[link + 1] - origins[link])
    return np.asarray(on_link + rng.normal(0, 0.15, 3))


def _shape(rng: Rng) -> dict[str, Any]:
    """Draw a shape of 5 to 30 cm."""
    kind = str(rng.choice(["sphere", "capsule", "box", "hull"]))
    if kind == "sphere":
        return {"shape": kind, "radius": round(rng.uniform(0.03, 0.12), 6)}
    if kind == "capsule":
        sizes = _rounded(rng.uniform([0.02, 0.05], [0.06, 0.2]))
        return {"shape": kind, "radius": sizes[0], "half_length": sizes[1]}
    if kind == "box":
        return {"shape": kind, "half_extents": _rounded(rng.uniform(0.03, 0.12, 3))}
    directions = rng.normal(size=(int(rng.integers(5, 17)), 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    vertices = directions * rng.uniform(0.05, 0.12)
    return {"shape": kind, "vertices": [_rounded(v) for v in vertices], "rounding": 0.005}


def _motion(rng: Rng, at: Array) -> dict[str, Any]:
    """Draw a motion no faster than SPEED: to and fro, in a circle, or straight on."""
    kind = str(rng.choice(["waypoints", "circle", "linear"]))
    speed = round(rng.uniform(*SPEED), 6)
    way = rng.normal(size=3)
    way *= rng.uniform(0.15, 0.6) / np.linalg.norm(way)
    if kind == "linear":
        return {"velocity": _rounded(way * speed * 0.999 / np.linalg.norm(way))}
    if kind == "waypoints":
        to = {"waypoints": [_rounded(at + way)], "speed": speed, "repeat": "back_and_forth"}
        return {"motion": {"kind": kind} | to}
    # The axis stands across the arm of the circle, whose length is then its radius.
    axis = np.cross(way, rng.normal(size=3))
    axis /= np.linalg.norm(axis)
    period = round(float(2 * np.pi * np.linalg.norm(way) / speed), 6)
    circle = {"centre": _rounded(at + way), "axis": _rounded(axis), "period_s": period}
    return {"motion": {"kind": kind} | circle}
