"""Study of random scenes: what is drawn, where its obstacles truly are, and the intervals."""

import json

import numpy as np
import pytest

import leeway
from scenes import draw
from scenes.__main__ import table
from scenes.picture import draw_picture
from scenes.study import BARE, VARIANTS, results_of, rows_of, run_all, wilson
from scenes.truth import SELF_PAIRS, Truth, moves, self_clearance

ARM = leeway.Arm("ur5")
NUMBERS = (0, 1, 2, 7, 8, 9, 17, 18)


@pytest.fixture(scope="module", params=NUMBERS)
def drawn(request):
    return draw.draw_scene(1, request.param)


def test_goal_and_start_are_free(drawn):
    """All the time, by leeway.clearance; and the goal is where its configuration has the tip."""
    np.testing.assert_allclose(ARM.fk(drawn.goal_q)[:3, 3], drawn.goal, atol=1e-8)
    ends = np.stack([drawn.start, drawn.goal_q])
    assert self_clearance(ARM, ends).min() > draw.SELF_MARGIN
    t = np.linspace(0, draw.DURATION_S, 2001)
    for q in ends:
        truth = Truth(drawn.obstacles, t).along(ARM, np.tile(q, (len(t), 1)))
        assert truth.min() > draw.MARGIN - 0.01  # drawn at 201 times


def test_what_is_drawn(drawn):
    assert 1 <= len(drawn.obstacles) <= 10
    assert any(moves(o) for o in drawn.obstacles) == drawn.moving == (drawn.number % 10 >= 7)
    tip = ARM.fk(drawn.start)[:3, 3]
    assert draw.APART[0] < np.linalg.norm(drawn.goal - tip) < draw.APART[1]
    assert drawn.text() == draw.draw_scene(1, drawn.number).text()
    assert drawn.text() != draw.draw_scene(2, drawn.number).text()


def test_obstacles_are_where_the_simulator_has_them(drawn):
    """A sensor that tells every tick makes the controller's own word the truth."""
    scene = leeway.load_scene(drawn.text())
    run = leeway.simulate(scene.with_({"sensor.rate_hz": 125, "duration_s": 6}))
    truth = Truth(drawn.obstacles, run.t).along(ARM, run.q)
    np.testing.assert_allclose(truth, run.clearance, atol=1e-9)


def test_all_shapes_and_motions_occur():
    found = [o for n in range(40) for o in draw.draw_scene(3, n).obstacles]
    assert {o["shape"] for o in found} == {"sphere", "capsule", "box", "hull"}
    kinds = {o["motion"]["kind"] if "motion" in o else "linear" for o in found if moves(o)}
    assert kinds == {"waypoints", "circle", "linear"}


def test_links_against_each_other():
    """The watched pairs are those of the controller: its own word for a start."""
    assert len(SELF_PAIRS) == 8
    text = json.loads(draw.draw_scene(1, 0).text()) | {"obstacles": [], "duration_s": 0.008}
    rng = np.random.default_rng(1)
    near = 0
    for q in rng.uniform(-2.5, 2.5, (60, 6)):
        told = leeway.simulate(leeway.load_scene(json.dumps(text | {"q0": q.tolist()}) + "\n"))
        if np.isfinite(told.self_clearance[0]):
            near += 1
            assert self_clearance(ARM, q[None])[0] == pytest.approx(told.self_clearance[0])
    assert near > 5


def test_wilson():
    """Values of Newcombe, Statistics in Medicine 17 (1998), table I, method 3."""
    for hits, count, low, high in (
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ):
        assert wilson(hits, count) == pytest.approx((low, high), abs=5e-5)
    assert wilson(20, 20)[1] == 1.0


def test_the_study_counts(tmp_path):
    ways = {"bare": BARE, "guard": VARIANTS["capsules + rollout + guard"]}
    outcomes = [o for found in run_all(1, NUMBERS[:5], 1, {}, ways) for o in found]
    assert outcomes == [o for found in run_all(1, NUMBERS[:5], 2, {}, ways) for o in found]
    results = results_of(1, outcomes)
    assert results["count"] == 5
    assert results["static"]["bare"]["reach"]["of"] == 3
    assert results["moving"]["bare"]["reach"]["of"] == 2
    for way in ways:
        chosen = [o for o in outcomes if o.variant == way]
        assert results["all"][way]["reach"]["hits"] == sum(o.reached for o in chosen)
        assert results["all"][way]["clearance"]["min"] == min(o.clearance for o in chosen)
    assert json.dumps(rows_of(outcomes), allow_nan=False)
    assert "bare" in table(results)
    draw_picture(outcomes, tmp_path / "scenes.png")
    assert (tmp_path / "scenes.png").stat().st_size > 10000
