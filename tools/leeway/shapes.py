"""Convex shapes and the distance between two of them."""

from __future__ import annotations

import warnings
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from leeway import _native

Array = npt.NDArray[np.float64]

# A certificate wider than this is reported, m.
GAP = 1e-9


class Shape:
    """A convex solid in a frame of its own; one of Sphere, Capsule, Box, Hull and HalfSpace.

    A pose, given with each query, puts it in its place. All sizes are in m.

    Raises
    ------
    ValueError
        A value that is not finite, a size that is not positive, a wrong number of vertices.
    """

    _native: _native.Shape


class Sphere(Shape):
    """A ball about the origin; radius 0 is a point."""

    def __init__(self, radius: float) -> None:
        self._native = _native.sphere(radius)


class Capsule(Shape):
    """A segment along z, from -half_length to half_length, swept by a ball."""

    def __init__(self, radius: float, half_length: float) -> None:
        self._native = _native.capsule(radius, half_length)


class Box(Shape):
    """A box about the origin with three half extents; `rounding` is added on all sides."""

    def __init__(self, half_extents: npt.ArrayLike, rounding: float = 0.0) -> None:
        self._native = _native.box(np.asarray(half_extents, dtype=np.float64).tolist(), rounding)


class Hull(Shape):
    """The convex hull of 1 to 64 vertices (n, 3); `rounding` is added on all sides.

    Flat and collinear hulls, repeated and inner vertices are welcome.
    """

    def __init__(self, vertices: npt.ArrayLike, rounding: float = 0.0) -> None:
        self._native = _native.hull(np.ascontiguousarray(vertices, dtype=np.float64), rounding)


class HalfSpace(Shape):
    """All points x with normal . x <= offset: a table, a wall. The normal has length 1."""

    def __init__(self, normal: npt.ArrayLike, offset: float) -> None:
        self._native = _native.halfspace(np.asarray(normal, dtype=np.float64).tolist(), offset)


class Distance(NamedTuple):
    """Distance of two shapes, for every pair of poses.

    `point_a` - `point_b` = `distance` * `normal`, for overlapping shapes too.
    """

    distance: Array
    """(...), m: between the surfaces; negative: how far they have to move apart."""
    point_a: Array
    """(..., 3), m: nearest, or deepest, point on a."""
    point_b: Array
    """(..., 3), m: nearest, or deepest, point on b."""
    normal: Array
    """(..., 3), unit: from b to a, the direction in which a moves away."""


def distance(
    shape_a: Shape, pose_a: npt.ArrayLike, shape_b: Shape, pose_b: npt.ArrayLike
) -> Distance:
    """Return the distance of two shapes, computed by the controller's own code.

    Where parallel faces or edges make many points the nearest ones, one of them is returned.

    Parameters
    ----------
    shape_a, shape_b
        Two of Sphere, Capsule, Box, Hull, HalfSpace; not two HalfSpace.
    pose_a, pose_b
        Where they are, (..., 4, 4), translation in m; the leading axes broadcast.

    Raises
    ------
    ValueError
        Two half-spaces; a pose of another shape, not finite, or whose rotation is not orthonormal.

    Warns
    -----
    RuntimeWarning
        A result whose own certificate leaves more than 1e-9 m open, with the worst gap.
    """
    poses = np.broadcast_arrays(
        np.asarray(pose_a, dtype=np.float64), np.asarray(pose_b, dtype=np.float64)
    )
    axes = poses[0].shape[:-2]
    if poses[0].shape[-2:] != (4, 4):
        raise ValueError("pose: expected arrays of shape (..., 4, 4)")
    flat_a, flat_b = (np.ascontiguousarray(p.reshape(-1, 4, 4)) for p in poses)
    d, point_a, point_b, normal, gap = _native.distance(
        shape_a._native, flat_a, shape_b._native, flat_b
    )
    if len(gap) and not gap.max() <= GAP:
        warnings.warn(f"a distance is proven to {gap.max():.2g} m only", RuntimeWarning, 2)
    points = (x.reshape((*axes, 3)) for x in (point_a, point_b, normal))
    return Distance(d.reshape(axes), *points)
