"""Clearance of a whole arm among obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt

from leeway import _native
from leeway.arm import Arm
from leeway.shapes import Shape

Array = npt.NDArray[np.float64]
Model = Literal["capsules", "capsules_fine", "joints"]
Placed = tuple[Shape, npt.ArrayLike]


def _poses(placed: Sequence[Placed], what: str) -> Array:
    poses = [np.asarray(pose, dtype=np.float64) for _, pose in placed]
    if any(pose.shape != (4, 4) for pose in poses):
        raise ValueError(f"{what}: expected a pose of shape (4, 4)")
    return np.stack(poses) if poses else np.empty((0, 4, 4))


def clearance(
    arm: Arm,
    q: npt.ArrayLike,
    obstacles: Sequence[Placed],
    model: Model = "capsules",
    tool: Placed | None = None,
) -> Array:
    """Return the smallest distance between the arm and obstacles, by the controller's own code.

    Negative values tell how deep the worst pair overlaps. The arm's distance to itself and the
    fixed base are not part of it.

    Parameters
    ----------
    arm
        Whose links are looked at.
    q
        Configurations, (..., 6) rad; a result does not depend on the others in the batch.
    obstacles
        Pairs of a shape and its pose (4, 4) in the base frame, translation in m; at most 10,000.
    model
        What stands for the arm: "capsules" (one a link), "capsules_fine" (three each for upper arm
        and forearm), or "joints" (the origins of the DH frames 2 to 6 as points).
    tool
        A shape on the flange and its pose (4, 4) in the frame of the flange; not a HalfSpace.

    Returns
    -------
    Array
        (...), m; infinite without obstacles.

    Raises
    ------
    ValueError
        A q or pose of another shape or not finite, a rotation that is not orthonormal, too many
        obstacles, an unknown model, a tool of no radius.
    """
    configurations = np.asarray(q, dtype=np.float64)
    if configurations.ndim < 1 or configurations.shape[-1] != 6:
        raise ValueError("q: expected an array of shape (..., 6) in rad")
    flat = np.ascontiguousarray(configurations.reshape(-1, 6))
    held = [] if tool is None else [tool]
    smallest = _native.clearance(
        arm.name,
        flat,
        [shape._native for shape, _ in obstacles],
        _poses(obstacles, "obstacles"),
        model,
        ([shape._native for shape, _ in held], _poses(held, "tool")),
    )
    return smallest.reshape(configurations.shape[:-1])
