"""Scenes A and B against the golden runs: a link, a trap, and the ways around; stuck in C1..C4.

The golden q have 12 decimals and the runs differ from them by no more than that: 5e-13. A start
that is 1e-10 off ends at most 2e-9 off.
"""

import numpy as np
import pytest

import leeway

TOLERANCE = 1e-11
STUCK, ASIDE = 3, 4  # of joint_command_t
ORIGINS = {"law.control_points": "joints", "law.rho_rep": 0.15, "law.eta": 0.005}
FINE = {"law.control_points": "capsules_fine"}
OFF = {"limits.clearance": "off"}
# Label of the golden run -> what differs from the scene, and the capsules that its dcap is of.
SCENE_A = {
    "joint_origins": (OFF | ORIGINS, "capsules"),
    "capsules_single": ({}, "capsules"),
    "capsules_single_eta4": ({"law.eta": 0.004}, "capsules"),
    "capsules_10": (FINE, "capsules_fine"),
}
VORTEX = {"law.remedy": "vortex", "law.circulation": 1}
SCENE_B = {
    "plain": {},
    "vortex_z_minus_c1": VORTEX | {"law.axis": [0, 0, -1]},
    "vortex_minus_n_c1": VORTEX | {"law.axis": [-0.27, -0.96, 0]},
}


def run(root, name, changes):
    return leeway.simulate(leeway.load_scene(root / "scenarios" / f"{name}.yaml").with_(changes))


def points(positions):
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, 3] = positions
    return [(leeway.Sphere(0), pose) for pose in poses]


def clearance(q, positions, model="capsules"):
    return leeway.clearance(leeway.Arm("ur5"), q, points(positions), model=model)


def skeleton_distance(q, positions):
    """Smallest distance of the segments between origins 1 to 6 to the points."""
    origins = leeway.Arm("ur5").frames(q)[:, :, :3, 3]
    start, along = origins[:, :-1, None], np.diff(origins, axis=1)[:, :, None]
    to_point = np.array(positions) - start
    length2 = (along**2).sum(-1)
    t = np.clip((to_point * along).sum(-1) / length2, 0, 1)
    return np.linalg.norm(to_point - t[..., None] * along, axis=-1).min()


def first(condition):
    """Return the first step at which a condition holds; None if it never does."""
    steps = np.flatnonzero(condition)
    return int(steps[0]) if len(steps) else None


def assert_run(arm, golden_run, positions, model="capsules"):
    """Assert q, and the metrics, which have six decimals."""
    assert len(arm.q) == golden_run["k"][-1] + 1
    np.testing.assert_allclose(arm.q[golden_run["k"]], golden_run["q"], rtol=0, atol=TOLERANCE)
    around = clearance(arm.q, positions, model)
    found = {
        "dj": clearance(arm.q, positions, "joints").min(),
        "dsk": skeleton_distance(arm.q, positions),
        "dcap": around.min(),
        "dcap0": around[0],
        "e": arm.deviation[-1],
        "ptp": np.ptp(arm.deviation[-200:]),
    }
    assert found == pytest.approx({key: golden_run[key] for key in found}, abs=1e-6)
    if "step_of_min_clearance" in golden_run:
        assert around.argmin() == golden_run["step_of_min_clearance"]


# --- scene A ---


@pytest.mark.parametrize("label", SCENE_A)
def test_scene_a(root, golden, label):
    scene, (changes, model) = golden("scenes.json")["sceneA"], SCENE_A[label]
    arm = run(root, "scene_a", changes)
    assert_run(arm, scene["runs"][label], scene["O"], model)
    assert STUCK not in arm.outcome
    assert arm.deviation[-1] < 1e-3
    if label != "joint_origins":
        assert clearance(arm.q, scene["O"], model).min() > 0.05


def test_a_link_passes_through_what_origins_never_come_near(root, golden):
    (point,) = golden("scenes.json")["sceneA"]["O"]
    blind = run(root, "scene_a", OFF | ORIGINS)
    alone = run(root, "scene_a", OFF | ORIGINS | {"obstacles": []})
    np.testing.assert_array_equal(blind.q, alone.q)
    np.testing.assert_array_equal(blind.qd, alone.qd)
    assert blind.clearance.min() > 0.19
    assert skeleton_distance(blind.q, [point]) < 0.02
    inside = clearance(blind.q, [point])
    assert (inside.argmin(), inside.min()) == (171, pytest.approx(-0.0618, abs=1e-4))


# --- scene B ---


@pytest.mark.parametrize("label", SCENE_B)
def test_scene_b(root, golden, label):
    scene = golden("scenes.json")["sceneB"]
    arm = run(root, "scene_b", OFF | SCENE_B[label])
    assert_run(arm, scene["runs"][label], scene["O"])
    assert first(arm.deviation < 0.01) == scene["runs"][label]["first_step_e_lt_1cm"]
    assert first(arm.outcome == STUCK) == (241 if label == "plain" else None)
    if label == "plain":
        assert arm.deviation[241] == pytest.approx(0.6133, abs=5e-5)
        assert (arm.outcome[241:] == STUCK).all()


@pytest.mark.parametrize(
    ("control_points", "stuck_at", "seconds", "room"),
    [("joints", 241, 8, 0.09), ("capsules", 222, 16, 0.1)],
)
def test_a_rollout_finds_the_way_out(root, golden, control_points, stuck_at, seconds, room):
    points_b = golden("scenes.json")["sceneB"]["O"]
    kept = run(root, "scene_b", {"law.control_points": control_points}).scene.to_dict()
    assert kept["limits"]["clearance"] == [0.01]
    arm = run(root, "scene_b", {"law.remedy": "rollout", "law.control_points": control_points})
    assert first(arm.outcome == STUCK) == stuck_at
    assert first(arm.deviation < 0.01) * 0.008 < seconds
    assert arm.deviation[-1] < 0.01
    assert arm.outcome[-1] != STUCK
    assert arm.clearance.min() > 0.01
    assert arm.self_clearance.min() > 0.01
    assert clearance(arm.q, points_b).min() > room


def test_a_motion_aside_is_told(root):
    arm = run(root, "table", {"law.remedy": "rollout"})
    aside = np.flatnonzero(arm.outcome == ASIDE)
    starts = np.flatnonzero(np.diff(aside, prepend=-9) > 1)
    lengths = np.diff(np.append(starts, len(aside))) / arm.scene.to_dict()["rate_hz"]
    assert len(lengths) > 0
    np.testing.assert_allclose(lengths, 1.5, atol=0.01)


# --- the paper's cases ---


@pytest.mark.parametrize("attraction", ["cone", "cone_par"])
@pytest.mark.parametrize(
    ("gamma", "eta", "steps"), [(1, 3, (None, None, 505, 725)), (2, 20, (None, None, 574, 525))]
)
def test_when_the_cases_are_stuck(root, attraction, gamma, eta, steps):
    changes = {"law.gamma": gamma, "law.eta": eta, "law.attraction": attraction}
    for case, expected in zip(("c1", "c2", "c3", "c4"), steps, strict=True):
        assert first(run(root, case, changes).outcome == STUCK) == expected, case
