"""Where a random scene's obstacles truly are, and how near the arm came to them.

Lengths in m, angles in rad, times in s, in the arm's base frame.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

import leeway
from leeway import _native

Array = npt.NDArray[np.float64]

# Links watched against each other, as docs/apf.md tells.
SELF_PAIRS = [(1, 3), (1, 4), (1, 5), (1, 6), (2, 4), (2, 5), (2, 6), (3, 6)]
# What the arm stands on: radius and height of the base's housing.
BASE_RADIUS, BASE_HEIGHT = 0.075, 0.09


def shape_of(told: dict[str, Any]) -> leeway.shapes.Shape:
    """Make the shape of an obstacle of a scene."""
    kind = told["shape"]
    if kind == "sphere":
        return leeway.Sphere(told["radius"])
    if kind == "capsule":
        return leeway.Capsule(told["radius"], told["half_length"])
    if kind == "box":
        return leeway.Box(told["half_extents"], rounding=told.get("rounding", 0.0))
    return leeway.Hull(told["vertices"], rounding=told.get("rounding", 0.0))


def rotation(rpy_deg: npt.ArrayLike) -> Array:
    """Turn about x, then y, then z of the base."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(np.radians(rpy_deg)), np.sin(np.radians(rpy_deg))
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return np.asarray(about_z @ about_y @ about_x)


def places(told: dict[str, Any], t: Array) -> Array:
    """Origin of an obstacle at times (n,) -> (n, 3)."""
    at = np.array(told["at"])
    out = at + t[:, None] * np.array(told.get("velocity", [0, 0, 0]))
    motion = told.get("motion", {"kind": "none"})
    if motion["kind"] == "waypoints":
        way = np.array(motion["waypoints"][0]) - at
        there = np.linalg.norm(way) / motion["speed"]
        part = t % (2 * there) / there
        out = out + np.minimum(part, 2 - part)[:, None] * way
    elif motion["kind"] == "circle":
        axis = np.array(motion["axis"]) / np.linalg.norm(motion["axis"])
        arm = at - np.array(motion["centre"])
        arm = arm - (arm @ axis) * axis
        angle = 2 * np.pi * t / motion["period_s"]
        turned = np.outer(np.cos(angle) - 1, arm) + np.outer(np.sin(angle), np.cross(axis, arm))
        out = out + turned
    return np.asarray(out)


def moves(told: dict[str, Any]) -> bool:
    """Whether it moves at all."""
    return "motion" in told or "velocity" in told


class Truth:
    """Obstacles at given times."""

    def __init__(self, obstacles: list[dict[str, Any]], t: Array) -> None:
        self._still: list[tuple[leeway.shapes.Shape, Array]] = []
        self._moving: list[tuple[leeway.shapes.Shape, Array]] = []
        for told in obstacles:
            turn = rotation(told.get("rpy_deg", [0, 0, 0]))
            pose = np.tile(np.eye(4), (len(t), 1, 1))
            pose[:, :3, :3] = turn
            pose[:, :3, 3] = places(told, t)
            if moves(told):
                self._moving.append((shape_of(told), pose))
            else:
                self._still.append((shape_of(told), pose[0]))

    def along(self, arm: leeway.Arm, q: Array) -> Array:
        """Clearance of the whole arm at each time: q (n, 6) -> (n,)."""
        least = leeway.clearance(arm, q, self._still)
        frames = arm.frames(q)
        for link, part in _parts(arm):
            for shape, pose in self._moving:
                apart = leeway.distance(part, frames[:, link - 1], shape, pose).distance
                least = np.minimum(least, apart)
        return np.asarray(least)

    def least(self, arm: leeway.Arm, q: Array) -> float:
        """Smallest distance at any of the times to the arm at q (m, 6), and to its base."""
        least = float(leeway.clearance(arm, q, self._still).min())
        base = leeway.Capsule(BASE_RADIUS, BASE_HEIGHT / 2)
        at_base = np.eye(4)
        at_base[2, 3] = BASE_HEIGHT / 2
        standing: list[tuple[leeway.shapes.Shape, Array]] = [(base, at_base)]
        for frames in arm.frames(q):
            standing += [(part, frames[link - 1]) for link, part in _parts(arm)]
        for shape, pose in self._moving:
            for part, where in standing:
                least = min(least, float(leeway.distance(part, where, shape, pose).distance.min()))
        for shape, still in self._still:
            least = min(least, float(leeway.distance(base, at_base, shape, still).distance))
        return least


def _parts(arm: leeway.Arm) -> list[tuple[int, leeway.shapes.Shape]]:
    """Links and the capsules that hold them, in the frame of the link."""
    links, ends, radii = _native.body(arm.name, "capsules")
    rows = zip(links, ends, radii, strict=True)
    return [(int(link), leeway.Hull(two, rounding=r)) for link, two, r in rows]


def self_clearance(arm: leeway.Arm, q: Array) -> Array:
    """Smallest distance of links watched against each other: q (n, 6) -> (n,)."""
    frames, parts = arm.frames(q), dict(_parts(arm))
    apart = [
        leeway.distance(parts[a], frames[:, a - 1], parts[b], frames[:, b - 1]).distance
        for a, b in SELF_PAIRS
    ]
    return np.asarray(np.min(apart, axis=0))
