"""Obstacles of a log: what they are, and the distance of points to them.

Units are metres and rad, positions in the base frame of the arm, quaternions w x y z.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from leeway.logs.log import Floats, Ints
from leeway.shapes import Hull, Sphere, distance

SPHERE, CAPSULE, BOX, HULL, HALFSPACE = range(5)  # obstacle_t
NAMES = ("sphere", "capsule", "box", "hull", "plane")
VALUE_MAX = 100.0  # m, m/s, rad/s
UNIT_SLACK = 1e-3
TURNED = (1.0, 0.0, 0.0, 0.0)

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Obstacle:
    """A convex solid in its place. When it was there does not make it another one."""

    id: int
    p: Triple
    radius: float
    session: int  # the source that sent it last
    shape: int = SPHERE
    quat: tuple[float, ...] = TURNED
    size: Triple = (0.0, 0.0, 0.0)
    v: Triple = (0.0, 0.0, 0.0)
    omega: Triple = (0.0, 0.0, 0.0)
    vertices: tuple[Triple, ...] = ()
    expires_ns: int = field(default=0, compare=False)  # 0 = never

    @property
    def rotation(self) -> Floats:
        """Axes of the obstacle as columns, (3, 3)."""
        w, x, y, z = np.array(self.quat) / np.linalg.norm(self.quat)
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )

    @property
    def core(self) -> Floats:
        """Points whose hull, swept by a ball of `radius`, is the obstacle, (n, 3) m.

        Of a plane any point of its face.
        """
        corners = np.zeros((1, 3))
        if self.shape == CAPSULE:
            corners = np.array([[0, 0, -self.size[0]], [0, 0, self.size[0]]])
        elif self.shape == BOX:
            signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
            corners = signs * self.size
        elif self.shape == HULL:
            corners = np.array(self.vertices).reshape(-1, 3)
        core: Floats = np.array(self.p) + corners @ self.rotation.T
        return core

    @property
    def words(self) -> str:
        """What it is and where, for people."""
        place = ", ".join(f"{v:g}" for v in np.round(self.p, 4))
        if self.shape == SPHERE:
            size = f"sphere of radius {self.radius:g} m" if self.radius else "point"
        elif self.shape == CAPSULE:
            size = f"capsule of radius {self.radius:g} m and half length {self.size[0]:g} m"
        elif self.shape == BOX:
            size = "box of half extents " + ", ".join(f"{v:g}" for v in self.size) + " m"
        elif self.shape == HULL:
            size = f"hull of {len(self.vertices)} vertices"
        else:
            size = "plane through"
        return f"{size} at ({place}) m" if self.shape != HALFSPACE else f"{size} ({place}) m"


def is_usable(obstacle: Obstacle) -> bool:
    """Whether a program takes an obstacle: as lw_obstacle_check."""
    used = {CAPSULE: 1, BOX: 3}.get(obstacle.shape, 0)
    sizes = obstacle.size[:used]
    values = (*obstacle.p, *obstacle.v, *obstacle.omega, *sizes, obstacle.radius)
    values += tuple(v for vertex in obstacle.vertices for v in vertex)
    if not all(math.isfinite(v) and abs(v) <= VALUE_MAX for v in (*values, *obstacle.quat)):
        return False
    length = math.sqrt(sum(q * q for q in obstacle.quat))
    sizes_fit = all(v > 0 for v in sizes) if obstacle.shape == BOX else all(v >= 0 for v in sizes)
    known = SPHERE <= obstacle.shape <= HALFSPACE
    return known and abs(length - 1) <= UNIT_SLACK and sizes_fit and obstacle.radius >= 0


def distances_to(points: Floats, obstacles: tuple[Obstacle, ...]) -> Floats:
    """Distance of points (..., 3) to the surface of each obstacle, (..., n) m; negative inside."""
    flat = points.reshape(-1, 3)
    out = np.empty((len(flat), len(obstacles)))
    shapes: Ints = np.array([o.shape for o in obstacles])
    spheres = np.flatnonzero(shapes == SPHERE)
    if len(spheres):
        centres = np.array([obstacles[i].p for i in spheres])
        radii = np.array([obstacles[i].radius for i in spheres])
        out[:, spheres] = np.linalg.norm(flat[:, None] - centres, axis=-1) - radii
    for i in np.flatnonzero(shapes != SPHERE):
        out[:, i] = _distance_to(flat, obstacles[i])
    return out.reshape(*points.shape[:-1], len(obstacles))


def _distance_to(points: Floats, o: Obstacle) -> Floats:
    """Return the distances of points (n, 3) to an obstacle that is no sphere, (n,)."""
    if o.shape == HULL:
        return _distance_to_hull(points, o)
    local = (points - o.p) @ o.rotation
    if o.shape == HALFSPACE:
        return np.asarray(local[:, 2])
    if o.shape == CAPSULE:
        local[:, 2] -= np.clip(local[:, 2], -o.size[0], o.size[0])
        return np.asarray(np.linalg.norm(local, axis=1) - o.radius)
    beyond = np.abs(local) - o.size
    outside = np.linalg.norm(np.maximum(beyond, 0), axis=1)
    return np.asarray(outside + np.minimum(beyond.max(axis=1), 0) - o.radius)


def _distance_to_hull(points: Floats, o: Obstacle) -> Floats:
    poses = np.broadcast_to(np.eye(4), (len(points), 4, 4)).copy()
    poses[:, :3, 3] = points
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = o.rotation, o.p
    out = np.full(len(points), np.nan)
    known = np.isfinite(points).all(axis=1)
    if known.any():
        out[known] = distance(Sphere(0), poses[known], Hull(o.vertices, o.radius), pose).distance
    return out
