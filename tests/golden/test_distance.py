"""Distances against golden pairs that long-double brute force and another library agree on."""

import warnings

import numpy as np
import pytest

import leeway

TOLERANCE = 1e-9
# With cores this near and no radius the normal is rounding: no certificate.
NO_CERTIFICATE = {"r=0 d=+1e-9", "r=0 d=+1e-6", "r=0 d=-1e-6"}


def _pairs(golden):
    records = golden("pairs_a.json") + golden("pairs_b.json")
    assert len(records) == 500
    return records


def _pose(x, y, z, origin):
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([x, y, z])
    pose[:3, 3] = origin
    return pose


def _capsule(a, b, r):
    """Capsule between two points: the shape and its pose."""
    a, b = np.array(a), np.array(b)
    length = np.linalg.norm(b - a)
    z = (b - a) / length if length > 0 else np.array([0.0, 0, 1])
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    return leeway.Capsule(r, length / 2), _pose(x, np.cross(z, x), z, a + (b - a) / 2)


def _obstacle(obs):
    if obs["type"] == "sphere":
        return leeway.Sphere(obs["r"]), _pose(*np.eye(3), obs["c"])
    if obs["type"] == "capsule":
        return _capsule(obs["a"], obs["b"], obs["r"])
    if obs["type"] == "box":
        return leeway.Box(obs["half"]), _pose(*np.reshape(obs["R"], (3, 3)).T, obs["c"])
    return leeway.Hull(obs["v"]), np.eye(4)


def _hull_of(obs):
    """The core of an obstacle as a hull, and what it is swept by."""
    if obs["type"] == "sphere":
        return leeway.Hull([obs["c"]], obs["r"])
    if obs["type"] == "capsule":
        return leeway.Hull([obs["a"], obs["b"]], obs["r"])
    if obs["type"] == "box":
        signs = np.stack(np.meshgrid(*[[-1, 1]] * 3), -1).reshape(-1, 3)
        axes = np.reshape(obs["R"], (3, 3))
        return leeway.Hull(obs["c"] + (signs * obs["half"]) @ axes.T)
    return leeway.Hull(obs["v"])


def _check(record, found):
    d, pa, pb, n = found
    size = max(1, *np.abs(pa), *np.abs(pb))
    assert d == pytest.approx(record["d"], rel=0, abs=TOLERANCE)
    assert np.linalg.norm(n) == pytest.approx(1, rel=0, abs=1e-12)
    np.testing.assert_allclose(pa - pb, d * n, rtol=0, atol=1e-11 * size)
    if record["witness_agrees"] and not record["core_overlap"]:
        np.testing.assert_allclose(pa, record["pa"], rtol=0, atol=1e-5)
        np.testing.assert_allclose(pb, record["pb"], rtol=0, atol=1e-5)


@pytest.mark.filterwarnings("ignore:a distance is proven to")
def test_golden_pairs(golden):
    for record in _pairs(golden):
        link = _capsule(*record["link"].values())
        _check(record, leeway.distance(*link, *_obstacle(record["obs"])))


@pytest.mark.filterwarnings("ignore:a distance is proven to")
def test_golden_pairs_as_hulls(golden):
    """GJK and EPA know no closed forms: every obstacle as a hull, and link and obstacle both."""
    for record in _pairs(golden):
        hull = _hull_of(record["obs"])
        ends = [record["link"]["a"], record["link"]["b"]]
        link_hull = leeway.Hull(ends, record["link"]["r"])
        for first in ((link_hull, np.eye(4)), _capsule(*record["link"].values())):
            d = leeway.distance(*first, hull, np.eye(4)).distance
            assert d == pytest.approx(record["d"], rel=0, abs=TOLERANCE), record["id"]


@pytest.mark.filterwarnings("ignore:a distance is proven to")
def test_roles_can_be_swapped(golden):
    for record in _pairs(golden):
        link, obstacle = _capsule(*record["link"].values()), _obstacle(record["obs"])
        there, back = leeway.distance(*link, *obstacle), leeway.distance(*obstacle, *link)
        assert back.distance == pytest.approx(there.distance, rel=0, abs=1e-12)
        if record["obs"]["type"] in ("sphere", "capsule"):
            continue  # parallel axes and crossing ones have more than one answer
        np.testing.assert_array_equal(back.normal, -there.normal)
        np.testing.assert_array_equal(back.point_a, there.point_b)
        np.testing.assert_array_equal(back.point_b, there.point_a)


def test_certificates_close_the_golden_pairs(golden):
    """A warning names a distance that its own normal does not prove to 1e-9."""
    warned = set()
    for record in _pairs(golden):
        link, obstacle = _capsule(*record["link"].values()), _obstacle(record["obs"])
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            leeway.distance(*link, *obstacle)
        if caught:
            assert "proven to" in str(caught[0].message)
            warned.add(record["class"])
    assert warned
    assert warned <= NO_CERTIFICATE
