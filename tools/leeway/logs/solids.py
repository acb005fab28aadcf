"""Obstacles of a log: what they are.

Units are metres and rad, positions in the base frame of the arm, quaternions w x y z.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from leeway.logs.log import Floats

SPHERE, CAPSULE, BOX, HULL, HALFSPACE = range(5)  # obstacle_t
NAMES = ("sphere", "capsule", "box", "hull", "plane")  # by obstacle_t.shape
TURNED = (1.0, 0.0, 0.0, 0.0)

Triple = tuple[float, float, float]


def in_words(shape: int, p: Sequence[float], radius: float, size: Sequence[float]) -> str:
    """Say what a solid is and where."""
    place = ", ".join(f"{v:g}" for v in np.round(p, 4))
    if shape == HALFSPACE:
        return f"plane through ({place}) m"
    what = {
        SPHERE: f"sphere of radius {radius:g} m" if radius else "point",
        CAPSULE: f"capsule of radius {radius:g} m and half length {size[0]:g} m",
        BOX: "box of half extents " + ", ".join(f"{v:g}" for v in size) + " m",
        HULL: "hull",
    }
    return f"{what[shape]} at ({place}) m"


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
    time_ns: int = field(default=0, compare=False)  # when it was there, 0 = not told
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
        text = in_words(self.shape, self.p, self.radius, self.size)
        return text.replace("hull", f"hull of {len(self.vertices)} vertices", 1)
