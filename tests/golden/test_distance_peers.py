"""Distances against coal and python-fcl, on random capsules and shapes, where those are right.

Both are optional (`pip install coal python-fcl`, as pyproject.toml's group `peers` pins them).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import leeway

coal = pytest.importorskip("coal")
fcl = pytest.importorskip("fcl")

PAIRS = 500
FACES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
SHAPES = ("sphere", "capsule", "box", "hull")
APART = 1e-3  # m: nearer ones, and those that overlap, are coal's alone


def _rotation(random: np.random.Generator) -> np.ndarray:
    q, r = np.linalg.qr(random.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q * [np.linalg.det(q), 1, 1]


def _tetrahedron(random: np.random.Generator) -> tuple[Any, Any, Any]:
    v = random.uniform(-0.2, 0.2, (4, 3))
    if np.linalg.det(v[1:] - v[0]) < 0:
        v = v[[0, 2, 1, 3]]
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for point in v:
        points.append(point)
    for face in FACES:
        triangles.append(coal.Triangle(*face))
    faces = np.concatenate([[3, *face] for face in FACES])
    return leeway.Hull(v), coal.Convex(points, triangles), fcl.Convex(v, len(FACES), faces)


def _shape(kind: str, random: np.random.Generator) -> tuple[Any, Any, Any]:
    """Return a shape of ours, the same one of coal, and of fcl."""
    r, half = random.uniform(0.02, 0.2), random.uniform(0.01, 0.4)
    if kind == "sphere":
        return leeway.Sphere(r), coal.Sphere(r), fcl.Sphere(r)
    if kind == "capsule":
        return leeway.Capsule(r, half), coal.Capsule(r, 2 * half), fcl.Capsule(r, 2 * half)
    if kind == "box":
        sides = random.uniform(0.02, 0.3, 3)
        return leeway.Box(sides), coal.Box(*(2 * sides)), fcl.Box(*(2 * sides))
    return _tetrahedron(random)


def _measure(a: Any, b: Any, random: np.random.Generator) -> tuple[float, float, float]:
    """Return our distance, coal's and fcl's of two shapes in random places."""
    turn = (_rotation(random), _rotation(random))
    place = random.uniform(-0.6, 0.6, (2, 3))
    pose = np.broadcast_to(np.eye(4), (2, 4, 4)).copy()
    pose[:, :3, :3], pose[:, :3, 3] = turn, place
    there = [coal.Transform3s(*at) for at in zip(turn, place, strict=True)]
    objects = [
        fcl.CollisionObject(shape, fcl.Transform(*at))
        for shape, *at in zip((a[2], b[2]), turn, place, strict=True)
    ]
    return (
        float(leeway.distance(a[0], pose[0], b[0], pose[1]).distance),
        coal.distance(
            a[1], there[0], b[1], there[1], coal.DistanceRequest(), coal.DistanceResult()
        ),
        fcl.distance(*objects, fcl.DistanceRequest(), fcl.DistanceResult()),
    )


@pytest.mark.parametrize("kind", SHAPES)
def test_random_pairs(kind: str) -> None:
    random = np.random.default_rng(SHAPES.index(kind))
    pairs = [(_shape("capsule", random), _shape(kind, random)) for _ in range(PAIRS)]
    ours, coals, fcls = np.array([_measure(a, b, random) for a, b in pairs]).T
    apart = ours > APART
    assert PAIRS / 2 < apart.sum() < PAIRS

    # coal stops at a relative gap of 1e-6.
    np.testing.assert_allclose(ours, coals, rtol=1e-6, atol=1e-6)
    # fcl stops where it gains less than 1e-6: its boxes and hulls are millimetres too far at
    # most, and none is too near.
    excess = (fcls - ours)[apart]
    assert excess.min() > -1e-9
    assert excess.max() < (1e-9 if kind in ("sphere", "capsule") else 2e-3)
