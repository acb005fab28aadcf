"""Capsules of the arms against golden ones, fitted to the makers' meshes."""

import numpy as np
import pytest

from leeway import _native


def _rows(entries):
    """Entries as rows of link, a, b, r in an order of their own."""
    rows = np.array([[e["dh_frame"], *e["a"], *e["b"], e["r"]] for e in entries])
    return rows[np.lexsort(rows.T[::-1])]


def _ours(robot, model):
    links, ends, radii = _native.body(robot, model)
    rows = np.column_stack([links, ends.reshape(-1, 6), radii])
    assert (np.diff(links) >= 0).all()
    return rows[np.lexsort(rows.T[::-1])]


@pytest.mark.parametrize("robot", ["ur5", "ur10"])
def test_one_capsule_a_link(golden, robot):
    capsules = golden("capsules.json")[robot]["single"]
    assert len(capsules) == 6
    np.testing.assert_array_equal(_ours(robot, "capsules"), _rows(capsules))


@pytest.mark.parametrize("robot", ["ur5", "ur10"])
def test_three_capsules_a_long_link(golden, robot):
    tables = golden("capsules.json")[robot]
    assert len(tables["multi"]) == 6
    others = [c for c in tables["single"] if c["dh_frame"] not in (2, 3)]
    np.testing.assert_array_equal(_ours(robot, "capsules_fine"), _rows(tables["multi"] + others))


def test_joints_are_points():
    links, ends, radii = _native.body("ur5", "joints")
    assert list(links) == [2, 3, 4, 5, 6]
    assert not ends.any()
    assert not radii.any()
