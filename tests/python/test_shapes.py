"""leeway.distance: what its arguments may be, batches, and what its results mean."""

import numpy as np
import pytest

import leeway


def pose(x=0.0, y=0.0, z=0.0):
    """A pose without a turn."""
    out = np.eye(4)
    out[:3, 3] = x, y, z
    return out


CUBE = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3), -1).reshape(-1, 3)
# Made by each test: what a module keeps outlives the interpreter's clean-up.
MAKERS = [
    lambda: leeway.Sphere(1.0),
    lambda: leeway.Capsule(1.0, 0.0),
    lambda: leeway.Box([1.0, 1.0, 1.0]),
    lambda: leeway.Box([0.5, 0.5, 0.5], rounding=0.5),
    lambda: leeway.Hull(CUBE),
    lambda: leeway.Hull(0.5 * CUBE, rounding=0.5),
]


@pytest.mark.parametrize("make_a", MAKERS)
@pytest.mark.parametrize("make_b", MAKERS)
def test_bodies_of_half_width_one(make_a, make_b):
    """All are 2 m wide along x: apart, touching and overlapping have plain answers."""
    a, b = make_a(), make_b()
    for gap in (1.0, 0.25, -0.125):
        d, pa, pb, n = leeway.distance(a, pose(), b, pose(2 + gap))
        assert d == pytest.approx(gap, abs=1e-14)
        assert np.shape(d) == ()
        np.testing.assert_allclose(n, [-1, 0, 0], atol=1e-14)
        np.testing.assert_allclose(pa[0], 1, atol=1e-14)
        np.testing.assert_allclose(pb[0], 1 + gap, atol=1e-14)


@pytest.mark.parametrize("make", MAKERS)
def test_half_space(make):
    shape = make()
    floor = leeway.HalfSpace([0, 0, 1], 0.5)
    found = leeway.distance(shape, pose(z=2.0), floor, pose(z=0.25))
    assert found.distance == pytest.approx(0.25, abs=1e-14)
    np.testing.assert_allclose(found.normal, [0, 0, 1])
    back = leeway.distance(floor, pose(z=0.25), shape, pose(z=2.0))
    assert back.distance == found.distance
    np.testing.assert_array_equal(back.normal, -found.normal)
    np.testing.assert_array_equal(back.point_a, found.point_b)


def test_the_pose_turns_the_shape():
    turn = pose(3.0)
    turn[:3, :3] = [[0, 0, 1], [1, 0, 0], [0, 1, 0]]  # x to y, y to z, z to x
    found = leeway.distance(leeway.Capsule(0.5, 1.0), turn, leeway.Box([0.5, 1, 1]), pose())
    assert found.distance == pytest.approx(1.0, abs=1e-14)
    found = leeway.distance(leeway.Box([1, 2, 3]), turn, leeway.Sphere(0), pose(3.0, 0, 5))
    assert found.distance == pytest.approx(3.0, abs=1e-14)


def test_batches_broadcast_over_leading_axes():
    rng = np.random.default_rng(1)
    poses = np.tile(np.eye(4), (4, 5, 1, 1))
    poses[..., :3, 3] = rng.uniform(-3, 3, (4, 5, 3))
    hull, box = leeway.Hull(rng.uniform(-1, 1, (20, 3))), leeway.Box([0.5, 0.6, 0.7])
    found = leeway.distance(hull, poses, box, np.eye(4))
    assert found.distance.shape == (4, 5)
    assert found.point_a.shape == found.point_b.shape == found.normal.shape == (4, 5, 3)
    for i in np.ndindex(4, 5):
        one = leeway.distance(hull, poses[i], box, np.eye(4))
        for name in one._fields:
            np.testing.assert_array_equal(getattr(one, name), getattr(found, name)[i])
    crossed = leeway.distance(hull, poses[:, :1], box, poses[0])
    assert crossed.distance.shape == (4, 5)
    same = leeway.distance(hull, poses[2, 0], box, poses[0, 3])
    assert crossed.distance[2, 3] == same.distance
    none = leeway.distance(hull, poses[:0], box, np.eye(4))
    assert none.distance.shape == (0, 5)
    assert none.normal.shape == (0, 5, 3)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: leeway.Sphere(-1), "radius is negative"),
        (lambda: leeway.Sphere(np.nan), "finite"),
        (lambda: leeway.Capsule(0.1, -1), "half length"),
        (lambda: leeway.Box([1, 0, 1]), "half extent"),
        (lambda: leeway.Box([1, 1]), "three values"),
        (lambda: leeway.Box([1, 1, 1], rounding=-0.1), "radius is negative"),
        (lambda: leeway.Hull(np.zeros((0, 3))), "1 to 64"),
        (lambda: leeway.Hull(np.zeros((65, 3))), "1 to 64"),
        (lambda: leeway.Hull(np.zeros((3, 2))), r"\(n, 3\)"),
        (lambda: leeway.Hull([[0, 0, np.inf]]), "finite"),
        (lambda: leeway.HalfSpace([0, 0, 2], 0), "length 1"),
        (lambda: leeway.HalfSpace([0, 1], 0), "three values"),
    ],
)
def test_bad_shapes_are_refused(make, text):
    with pytest.raises(ValueError, match=text):
        make()


def test_bad_queries_are_refused():
    sphere, floor = leeway.Sphere(1), leeway.HalfSpace([0, 0, 1], 0)
    skewed = np.eye(4)
    skewed[0, 1] = 0.01
    for bad, text in ((np.eye(3), "shape"), (skewed, "orthonormal"), (pose(np.nan), "finite")):
        with pytest.raises(ValueError, match=text):
            leeway.distance(sphere, bad, sphere, np.broadcast_to(np.eye(4), (2, 4, 4))[0])
        with pytest.raises(ValueError, match=text):
            leeway.distance(sphere, np.eye(len(bad)), sphere, bad)
    with pytest.raises(ValueError, match="half-spaces"):
        leeway.distance(floor, np.eye(4), floor, np.eye(4))
