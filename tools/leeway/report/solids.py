"""Surfaces of obstacles and of the arm, for pictures in space.

Units are m, base frame of the arm.
"""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from leeway import _native
from leeway.logs.log import Floats
from leeway.logs.solids import HALFSPACE, Obstacle

THIN = 1e-3  # m: what is flat is drawn this thick
EDGES = [(i, i | bit) for i in range(8) for bit in (1, 2, 4) if not i & bit]  # of a box


# Directions of a ball, rows from pole to pole, columns around.
_TILT, _TURN = np.meshgrid(np.linspace(0, np.pi, 12), np.linspace(0, 2 * np.pi, 19), indexing="ij")


def faces(core: Floats, radius: float) -> list[Floats]:
    """Polygons of the surface of the hull of core points (n, 3) swept by a ball, (k, 3) m each.

    Corners and edges of a rounded box or hull are drawn sharp, very sharp ones a little too short.
    """
    found = _polygons(core) if len(core) > 2 else []
    if not found:
        far = np.linalg.norm(core[:, None] - core, axis=-1)
        i, j = np.unravel_index(int(np.argmax(far)), far.shape)
        return _round(core[i], core[j], max(radius, THIN))
    grown = core.copy()
    for k in range(len(core)):
        normals = np.array([normal for normal, corners in found if k in corners])
        if len(normals):
            out = np.linalg.lstsq(normals, np.full(len(normals), radius), rcond=None)[0]
            grown[k] += out * min(1.0, 2 * radius / max(float(np.linalg.norm(out)), 1e-12))
    return [grown[corners] for _, corners in found]


def _round(a: Floats, b: Floats, radius: float) -> list[Floats]:
    """Return the surface of a segment swept by a ball, as quads."""
    length = float(np.linalg.norm(b - a))
    axis = (b - a) / length if length > 0 else np.array([0.0, 0.0, 1.0])
    side = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    side /= np.linalg.norm(side)
    around = np.cross(axis, side)
    ball = (
        np.sin(_TILT)[..., None] * np.cos(_TURN)[..., None] * side
        + np.sin(_TILT)[..., None] * np.sin(_TURN)[..., None] * around
        + np.cos(_TILT)[..., None] * axis
    )
    # The half of the ball that looks along the axis sits on b, the other one on a.
    upper = (np.cos(_TILT) > 0)[..., None]
    points = radius * ball + np.where(upper, b, a)
    quads = np.stack([points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]], axis=2)
    return list(quads.reshape(-1, 4, 3))


def _polygons(points: Floats) -> list[tuple[Floats, list[int]]]:
    """Return the faces of a hull: outer normal and corners in order. None when it is a line."""
    tiny = 1e-9 * (1 + float(np.ptp(points, axis=0).max()))
    triples = np.array(list(combinations(range(len(points)), 3)))
    a, b, c = (points[triples[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    area = np.linalg.norm(normals, axis=1)
    known = area > tiny**2
    normals, a = normals[known] / area[known, None], a[known]
    normals, a = np.vstack([normals, -normals]), np.vstack([a, a])
    height = normals @ points.T - np.einsum("ij,ij->i", normals, a)[:, None]
    found: dict[tuple[int, ...], Floats] = {}
    for k in np.flatnonzero((height <= 1e3 * tiny).all(axis=1)):
        corners = tuple(np.flatnonzero(height[k] >= -1e3 * tiny).tolist())
        found.setdefault((*corners, int(np.sign(normals[k].sum()))), normals[k])
    return [(normal, _in_order(points, normal, key[:-1])) for key, normal in found.items()]


def _in_order(points: Floats, normal: Floats, corners: tuple[int, ...]) -> list[int]:
    """Return the corners of a face around its middle."""
    across = points[list(corners)] - points[list(corners)].mean(axis=0)
    side = across[np.argmax(np.linalg.norm(across, axis=1))]
    angle = np.arctan2(across @ np.cross(normal, side), across @ side)
    return [corners[k] for k in np.argsort(angle)]


def polygon_in(obstacle: Obstacle, lower: Floats, upper: Floats) -> Floats:
    """Corners of the part of a plane that lies in a box, in order, (n, 3); none when outside."""
    normal, size = obstacle.rotation[:, 2], upper - lower
    corners = np.array([lower + size * [k >> b & 1 for b in range(3)] for k in range(8)])
    height = (corners - obstacle.p) @ normal
    cuts = [
        corners[i] + (corners[j] - corners[i]) * height[i] / (height[i] - height[j])
        for i, j in EDGES
        if (height[i] > 0) != (height[j] > 0)
    ]
    if len(cuts) < 3:
        return np.empty((0, 3))
    points = np.array(cuts)
    across = (points - points.mean(axis=0)) @ obstacle.rotation[:, :2]
    ordered: Floats = points[np.argsort(np.arctan2(across[:, 1], across[:, 0]))]
    return ordered


def draw_obstacle(
    axes: Any, obstacle: Obstacle, box: tuple[Floats, Floats], colour: str, alpha: float
) -> None:
    """Draw an obstacle's surface; of a plane what lies in the box."""
    if obstacle.shape == HALFSPACE:
        corners = polygon_in(obstacle, *box)
        if len(corners):
            _add(axes, [corners], colour, 0.25 * alpha, 8, shade=False)
    else:
        _add(axes, faces(obstacle.core, obstacle.radius), colour, alpha, 15)


def draw_arm(axes: Any, robot: str, q: Floats, colour: str, alpha: float, zorder: int) -> None:
    """Draw the capsules that stand for the links at a configuration (6,) rad."""
    frames = _native.Arm(robot).frames(np.ascontiguousarray(q[None]))[0]
    for link, ends, radius in zip(*_native.body(robot, "capsules"), strict=True):
        pose = frames[link - 1]
        core = ends @ pose[:3, :3].T + pose[:3, 3]
        _add(axes, faces(core, float(radius)), colour, alpha, zorder)


def _add(
    axes: Any, polygons: list[Floats], colour: str, alpha: float, zorder: int, shade: bool = True
) -> None:
    collection = Poly3DCollection(
        polygons, facecolors=colour, edgecolors=colour, alpha=alpha, shade=shade, zorder=zorder
    )
    collection.set_linewidth(0)
    collection.set_rasterized(True)  # hundreds of polygons weigh more than their picture
    axes.add_collection3d(collection)
