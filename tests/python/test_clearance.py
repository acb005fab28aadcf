"""leeway.clearance: the arm's own capsules against each obstacle, one by one."""

import threading
import time

import numpy as np
import pytest

import leeway
from leeway import _native


def pose(x=0.0, y=0.0, z=0.0):
    """A pose without a turn."""
    out = np.eye(4)
    out[:3, 3] = x, y, z
    return out


def random_pose(rng, spread):
    q = rng.normal(size=4)
    w, x, y, z = q / np.linalg.norm(q)
    out = np.eye(4)
    out[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    out[:3, 3] = rng.uniform(-spread, spread, 3)
    return out


def random_obstacles(rng, count, spread=1.2):
    makers = [
        lambda: leeway.Sphere(rng.uniform(0, 0.1)),
        lambda: leeway.Capsule(0.04, 0.05),
        lambda: leeway.Box(rng.uniform(0.02, 0.1, 3), rounding=0.01),
        lambda: leeway.Hull(rng.uniform(-0.1, 0.1, (12, 3))),
        lambda: leeway.HalfSpace([0, 0, 1.0], -1.4),
    ]
    return [(makers[i % len(makers)](), random_pose(rng, spread)) for i in range(count)]


def as_hull(a, b, r):
    return leeway.Hull([a, b], rounding=r)


def by_hand(arm, q, obstacles, model, tool=None):
    """Least distance of each part to each obstacle, by leeway.distance."""
    frames = arm.frames(q)
    links, ends, radii = _native.body(arm.name, model)
    parts = [(as_hull(*e, r), frames[k - 1]) for k, e, r in zip(links, ends, radii, strict=True)]
    if tool is not None:
        parts.append((tool[0], frames[5] @ tool[1]))
    return min(
        leeway.distance(part, at, shape, where).distance
        for part, at in parts
        for shape, where in obstacles
    )


@pytest.mark.parametrize("robot", ["ur5", "ur10"])
@pytest.mark.parametrize("model", ["capsules", "capsules_fine", "joints"])
def test_the_least_of_all_pairs(robot, model):
    rng = np.random.default_rng(3)
    arm = leeway.Arm(robot)
    for count in (1, 3, 40):
        obstacles = random_obstacles(rng, count)
        q = rng.uniform(-3, 3, (5, 6))
        found = leeway.clearance(arm, q, obstacles, model=model)
        expected = [by_hand(arm, one, obstacles, model) for one in q]
        np.testing.assert_allclose(found, expected, atol=1e-9)


TOOLS = [
    lambda: leeway.Sphere(0.05),
    lambda: leeway.Capsule(0.03, 0.1),
    lambda: leeway.Box([0.02, 0.03, 0.1], rounding=0.01),
    lambda: leeway.Hull([[0, 0, 0], [0.1, 0, 0], [0, 0.2, 0.1], [0.05, 0.05, 0.3]], rounding=0.01),
]


@pytest.mark.parametrize("make", TOOLS)
def test_a_tool_is_part_of_the_arm(make):
    rng = np.random.default_rng(4)
    arm = leeway.Arm("ur5")
    nearer = 0
    for _ in range(20):
        tool = (make(), random_pose(rng, 0.1))
        obstacles = random_obstacles(rng, 6)
        q = rng.uniform(-3, 3, 6)
        found = leeway.clearance(arm, q, obstacles, tool=tool)
        assert found == pytest.approx(by_hand(arm, q, obstacles, "capsules", tool), abs=1e-9)
        nearer += found < leeway.clearance(arm, q, obstacles)
    assert nearer > 0


def test_batches_broadcast_over_leading_axes():
    rng = np.random.default_rng(5)
    arm = leeway.Arm("ur10")
    obstacles = random_obstacles(rng, 10)
    q = rng.uniform(-3, 3, (4, 5, 6))
    found = leeway.clearance(arm, q, obstacles)
    assert found.shape == (4, 5)
    for i in np.ndindex(4, 5):
        one = leeway.clearance(arm, q[i], obstacles)
        assert np.shape(one) == ()
        assert one == found[i]
    assert leeway.clearance(arm, q[:0], obstacles).shape == (0, 5)
    assert leeway.clearance(arm, q.tolist(), obstacles).tolist() == found.tolist()


def test_no_obstacles():
    found = leeway.clearance(leeway.Arm("ur5"), np.zeros((3, 6)), [])
    assert found.tolist() == [np.inf] * 3


def test_touching_is_zero_and_overlap_negative():
    """At q = 0 the flange of the UR5 is at (-0.81725, -0.19145, -0.005491)."""
    arm, q = leeway.Arm("ur5"), np.zeros(6)
    ball = leeway.Sphere(0.1)
    for gap in (0.3, 0.0, -0.05):
        at = pose(-0.81725, -0.19145 - 0.1 - gap, -0.005491)
        found = leeway.clearance(arm, q, [(ball, at)], model="joints")
        assert found == pytest.approx(gap, abs=1e-12)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"q": np.zeros(5)}, "q: expected"),
        ({"q": np.float64(3)}, "q: expected"),
        ({"q": [0, 0, np.nan, 0, 0, 0]}, "not finite"),
        ({"obstacles": [("sphere", np.eye(3))]}, r"obstacles: .* \(4, 4\)"),
        ({"obstacles": [("sphere", 2 * np.eye(4))]}, "orthonormal"),
        ({"obstacles": [("sphere", pose(np.inf))]}, "finite"),
        ({"obstacles": [("sphere", np.eye(4))] * 10001}, "at most 10000"),
        ({"model": "mesh"}, "mesh"),
        ({"tool": ("plane", np.eye(4))}, "tool: a half-space"),
        ({"tool": ("point", np.eye(4))}, "tool: .*radius"),
        ({"tool": ("sphere", np.eye(3))}, r"tool: .*\(4, 4\)"),
    ],
)
def test_what_is_refused(change, text):
    shapes = {
        "sphere": leeway.Sphere(0.1),
        "point": leeway.Sphere(0),
        "plane": leeway.HalfSpace([0, 0, 1], 0),
    }
    good = {"q": np.zeros(6), "obstacles": [], "model": "capsules", "tool": None} | change
    good["obstacles"] = [(shapes[name], at) for name, at in good["obstacles"]]
    if good["tool"] is not None:
        good["tool"] = (shapes[good["tool"][0]], good["tool"][1])
    with pytest.raises(ValueError, match=text):
        leeway.clearance(leeway.Arm("ur5"), **good)


def test_ten_thousand_obstacles_and_other_threads():
    """The lock of the interpreter is free meanwhile: another thread goes on."""
    rng = np.random.default_rng(6)
    sphere = leeway.Sphere(0.01)
    obstacles = [(sphere, pose(*rng.uniform(-2, 2, 3))) for _ in range(10000)]
    centres = np.array([at[:3, 3] for _, at in obstacles])
    arm = leeway.Arm("ur5")
    q = rng.uniform(-3, 3, (20000, 6))
    running, turns = threading.Event(), []

    def count():
        running.set()
        while running.is_set():
            turns.append(time.perf_counter())

    thread = threading.Thread(target=count)
    thread.start()
    running.wait()
    start = time.perf_counter()
    found = leeway.clearance(arm, q, obstacles, model="joints")
    end = time.perf_counter()
    running.clear()
    thread.join()
    during = [start, *(t for t in turns if start < t < end), end]
    assert np.diff(during).max() < 0.5 * (end - start)
    for i in range(0, 20000, 1000):
        points = arm.frames(q[i])[1:, :3, 3]
        apart = np.linalg.norm(points[:, None] - centres, axis=-1).min() - 0.01
        assert found[i] == pytest.approx(apart, abs=1e-12)
