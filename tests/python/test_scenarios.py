"""What the comments in the scenarios claim."""

import pytest

import leeway


def run(root, name, changes=None):
    return leeway.simulate(leeway.load_scene(root / f"scenarios/{name}.yaml").with_(changes or {}))


def test_a_link_goes_around_the_point_of_scene_a(root):
    arm = run(root, "scene_a")
    assert arm.clearance.min() == pytest.approx(0.0649, abs=5e-4)
    assert arm.deviation[-1] < 1e-3


def test_origins_of_frames_do_not_see_the_point_of_scene_a(root):
    origins = {"law.control_points": "joints", "law.rho_rep": 0.15, "law.eta": 0.005}
    blind = run(root, "scene_a", origins)
    assert blind.clearance.min() == pytest.approx(0.19298, abs=1e-5)
    point = leeway.Sphere(0), [[1, 0, 0, -0.281], [0, 1, 0, -0.272], [0, 0, 1, 0.338], [0, 0, 0, 1]]
    assert leeway.clearance(leeway.Arm("ur5"), blind.q, [point]).min() < -0.06


def test_the_plain_field_stops_in_scene_b(root):
    assert run(root, "scene_b").deviation[-1] == pytest.approx(0.6107, abs=1e-3)


def test_a_way_leads_through_the_crowd(root):
    arm = run(root, "crowd")
    assert arm.deviation[-1] < 0.02
    assert arm.clearance.min() > 0.05


@pytest.mark.parametrize("name", ["person", "moving_box"])
def test_the_arm_gives_way_and_goes_on(root, name):
    alone, arm = run(root, name, {"obstacles": []}), run(root, name)
    late = arm.t > 6
    assert alone.deviation[late].max() < 0.03
    assert arm.deviation[late].max() > 0.15
    assert arm.clearance.min() > 0.1
    assert arm.deviation[-1] < 0.02


def test_links_keep_apart_over_the_table(root):
    fearless = {"law.eta_self": 0, "limits.clearance": "off"}
    assert run(root, "table", fearless).self_clearance.min() == pytest.approx(-0.034, abs=1e-3)
    guarded = run(root, "table", {"law.eta_self": 0})
    assert guarded.self_clearance.min() == pytest.approx(0.01, abs=1e-3)
    assert run(root, "table").self_clearance.min() > 0.025
