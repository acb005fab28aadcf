"""Kinematics against the golden files, which independent implementations agree on."""

import numpy as np
import pytest

import leeway

TOLERANCE = 1e-12


def _column(data, name):
    return np.array([sample[name] for sample in data["samples"]])


@pytest.mark.parametrize("robot", ["ur5", "ur10"])
def test_forward_kinematics_and_jacobian(golden, robot):
    data = golden(f"fk_{robot}.json")
    arm, q = leeway.Arm(robot), _column(data, "q")
    assert len(q) == 200
    np.testing.assert_allclose(
        arm.fk(q)[:, :3].reshape(-1, 12), _column(data, "T"), rtol=0, atol=TOLERANCE
    )
    np.testing.assert_allclose(
        arm.jacobian(q).reshape(-1, 36), _column(data, "J"), rtol=0, atol=TOLERANCE
    )


@pytest.mark.parametrize("robot", ["ur5", "ur10"])
def test_origins_of_all_frames(golden, robot):
    data = golden(f"origin_jac_{robot}.json")
    frames = leeway.Arm(robot).frames(_column(data, "q"))
    np.testing.assert_allclose(
        frames[:, :, :3, 3].reshape(-1, 18), _column(data, "origins"), rtol=0, atol=TOLERANCE
    )


@pytest.mark.parametrize("robot", ["ur5", "ur10"])
def test_jacobians_of_all_origins(golden, robot):
    data = golden(f"origin_jac_{robot}.json")
    q = _column(data, "q")
    frames = leeway.Arm(robot).frames(q)
    expected = _column(data, "J_origins").reshape(-1, 6, 3, 6)
    # Column j of J_i is z_{j-1} x (o_i - o_{j-1}) for j <= i; the base frame comes first.
    origins = np.concatenate([np.zeros((len(q), 1, 3)), frames[:, :, :3, 3]], axis=1)
    axes = np.concatenate([np.tile([[[0.0, 0, 1]]], (len(q), 1, 1)), frames[:, :, :3, 2]], axis=1)
    for i in range(6):
        for j in range(6):
            lever = origins[:, i + 1] - origins[:, j]
            column = np.cross(axes[:, j], lever) * (j <= i)
            np.testing.assert_allclose(expected[:, i, :, j], column, rtol=0, atol=TOLERANCE)


def test_batches_keep_their_leading_axes():
    arm = leeway.Arm("ur5")
    q = np.random.default_rng(3).uniform(-3, 3, (4, 5, 6))
    assert arm.fk(q).shape == (4, 5, 4, 4)
    assert arm.jacobian(q).shape == (4, 5, 6, 6)
    np.testing.assert_array_equal(arm.fk(q)[2, 3], arm.fk(q[2, 3]))


@pytest.mark.parametrize("q", [np.zeros(5), np.array(0.0), np.full(6, np.nan), np.full(6, np.inf)])
def test_bad_configurations_are_refused(q):
    with pytest.raises(ValueError, match="q: "):
        leeway.Arm("ur5").fk(q)


def test_unknown_arm_is_refused():
    with pytest.raises(ValueError, match="expected ur5 or ur10"):
        leeway.Arm("ur3")
