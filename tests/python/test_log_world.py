"""Obstacles in force at every tick, and distances to them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from log_maker import (
    PERIOD_NS,
    PLANT,
    SOURCE,
    Run,
    analysed,
    hull,
    obstacles,
    see,
    texts,
)

from leeway.logs.log import read_log
from leeway.logs.world import follow

PERIOD = PERIOD_NS * 1e-9
DAMAGED = Run(ticks=8)


def test_obstacles_in_force_follow_the_echo_not_the_order_of_the_log(tmp_path: Path) -> None:
    run = Run(ticks=31)
    near = (0.0, -0.8, 0.1)
    run.inserted[5] = [("OBSTACLES", obstacles(SOURCE, 1, 0, [(900, near, 0.05)]))]
    run.inserted[15] = [("OBSTACLES", obstacles(SOURCE, 2, 1, [(900, (0.0, 0.0, 0.0), 0.0)]))]
    see(run, slice(10, 20), SOURCE, 1)  # taken in five ticks after it was logged
    see(run, slice(20, 31), SOURCE, 2)
    for command in run.commands[10:20]:
        command.clearance, command.clearance_link, command.clearance_obstacle = 0.3, 5, 900
    a = analysed(run, tmp_path)
    assert np.flatnonzero((a.nearest_obstacle == 900).any(axis=1)).tolist() == list(range(10, 20))
    centre = np.linalg.norm(a.points[12, 4] - near)
    assert a.distances[12, 4] == pytest.approx(
        min(centre - 0.05, np.linalg.norm(a.points[12, 4] - [1, 1, 0.4]))
    )
    assert texts(a, "obstacle") == [
        "0.000 obstacle 1 known at the start: point at (1, 1, 0.4) m, from leeway-simulator",
        "0.080 obstacle 900 added: sphere of radius 0.05 m at (0, -0.8, 0.1) m, "
        f"from another source, session {SOURCE}",
        "0.160 obstacle 900 removed",
    ]
    assert 10 * PERIOD - 1e-9 <= a.smallest.t < 20 * PERIOD
    assert a.smallest.obstacle == 900
    assert (a.smallest.distance, a.smallest.link) == (0.3, 5)


def test_repeated_message_is_taken_where_it_came_last(tmp_path: Path) -> None:
    run = Run(ticks=21)
    far = obstacles(SOURCE, 1, 0, [(7, (2.0, 0.0, 0.0), 0.0)])
    run.inserted = {
        5: [("OBSTACLES", far)],
        8: [("OBSTACLES", obstacles(44, 1, 0, [(8, (3.0, 0.0, 0.0), 0.0)]))],
        12: [("OBSTACLES", far)],
    }
    see(run, slice(5, 8), SOURCE, 1)
    see(run, slice(8, 12), 44, 1)
    see(run, slice(12, None), SOURCE, 1)
    a = analysed(run, tmp_path)
    assert [len(a.world.worlds[k]) for k in a.world.index[[4, 6, 10, 20]]] == [1, 2, 3, 3]


@pytest.mark.parametrize(
    "items",
    [
        [(7, (0.0, 0.0, 0.0), -0.1)],
        [(7, (0.0, 0.0, 100.1), 0.1)],
        [(7, (0.0, float("nan"), 0.0), 0.1)],
        [(0, (0.0, 0.0, 0.0), 0.1)],
        [(7, (0.0, 0.0, 0.0), 0.1), (7, (0.0, 0.0, 1.0), 0.1)],
    ],
)
def test_messages_that_the_controller_refuses_change_nothing(
    tmp_path: Path, items: list[Any]
) -> None:
    run = Run(ticks=5)
    run.before.append(("OBSTACLES", obstacles(SOURCE, 1, 0, items)))
    run.before.append(("OBSTACLES", obstacles(SOURCE, 2, 0, [(9, (5.0, 0.0, 0.0), 0.0)])))
    see(run, slice(0, None), SOURCE, 2)
    a = analysed(run, tmp_path)
    assert [o.id for o in a.world.worlds[0]] == [1, 9]


def test_moves_in_quick_succession_are_one_event(tmp_path: Path) -> None:
    run = Run(ticks=41)
    for k in range(10):
        message = obstacles(SOURCE, k + 1, 0, [(7, (1.0, 0.0, 0.1 * k), 0.0)])
        run.inserted[k + 5] = [("OBSTACLES", message)]
        see(run, slice(k + 5, None), SOURCE, k + 1)
    found = texts(analysed(run, tmp_path), "obstacle")
    assert len(found) == 3
    assert found[1].startswith("0.040 obstacle 7 added")
    assert "8 more moves until 0.112 s: changed: now point at (1, 0, 0.9) m" in found[2]


OPS = st.tuples(
    st.sampled_from([PLANT, SOURCE]),
    st.integers(0, 3),
    st.lists(st.tuples(st.integers(0, 4), st.floats(-101, 101), st.floats(-0.1, 1)), max_size=4),
)


Model = dict[int, tuple[float, float, int]]


def change(model: Model, session: int, op: int, items: list[Any]) -> Model | None:
    """Return the plain model after one message, None when the message is refused."""
    ids = [i for i, _, _ in items]
    in_range = all(abs(x) <= 100 and r >= 0 for _, x, r in items)
    if min(ids, default=1) <= 0 or len(set(ids)) < len(ids) or (op != 1 and not in_range):
        return None
    if op == 3:
        return {}
    if op == 1:
        return {i: o for i, o in model.items() if i not in ids}
    return survivors(model, session, op) | {i: (x, r, session) for i, x, r in items}


def survivors(model: Model, session: int, op: int) -> Model:
    return {i: o for i, o in model.items() if op == 0 or o[2] != session}


@settings(max_examples=60, deadline=None)
@given(ops=st.lists(OPS, min_size=1, max_size=8))
def test_world_agrees_with_a_plain_model(
    tmp_path_factory: pytest.TempPathFactory, ops: list[Any]
) -> None:
    run = Run(ticks=len(ops) + 2)
    expected: list[Model] = [{1: (1.0, 0.0, PLANT)}]
    run.before[2] = ("OBSTACLES", obstacles(PLANT, 1, 0, [(1, (1.0, 0.0, 0.0), 0.0)]))
    for k, (session, op, items) in enumerate(ops, start=1):
        entries = [(i, (x, 0.0, 0.0), r) for i, x, r in items]
        run.inserted[k] = [("OBSTACLES", obstacles(session, k + 1, op, entries))]
        after = change(expected[-1], session, op, items)
        if after is not None:
            see(run, slice(k, None), session, k + 1)
        expected.append(expected[-1] if after is None else after)
    log = read_log(run.write(tmp_path_factory.mktemp("world")))
    line = follow(log, log.commands, np.zeros((len(log.commands), 6, 3))).line
    found = [{o.id: (o.p[0], o.radius, o.session) for o in line.worlds[i]} for i in line.index]
    assert found[: len(expected)] == expected
    assert line.unknown_ticks == 0


def test_nearest_is_the_smallest_over_all_obstacles(tmp_path: Path) -> None:
    run = Run(ticks=3)
    items = [(k, (0.3 * k, -0.2 * k, 0.1), 0.02 * k) for k in range(1, 9)]
    run.before[2] = ("OBSTACLES", obstacles(PLANT, 1, 2, items))
    log = read_log(run.write(tmp_path))
    points = np.random.default_rng(1).normal(size=(3, 6, 3))
    around = follow(log, log.commands, points)
    distance, obstacle = around.distance, around.obstacle
    for row, column in np.ndindex(3, 6):
        each = {k: float(np.linalg.norm(points[row, column] - p)) - r for k, p, r in items}
        best = min(each, key=lambda k: each[k])
        assert obstacle[row, column] == best
        assert distance[row, column] == pytest.approx(each[best], abs=1e-14)


BOX = [(x, y, z) for x in (-0.1, 0.1) for y in (-0.2, 0.2) for z in (-0.3, 0.3)]


def test_every_shape_has_its_surface(tmp_path: Path) -> None:
    run = Run(ticks=12)
    m = obstacles(SOURCE, 1, 2, [(k, (k, 0.0, 0.0), 0.0) for k in range(1, 5)])
    m.o[0].shape, m.o[0].radius = m.o[0].SPHERE, 0.25
    m.o[1].shape, m.o[1].radius, m.o[1].size = m.o[1].CAPSULE, 0.125, [0.5, 0, 0]
    m.o[2].shape, m.o[2].size = m.o[2].BOX, [0.1, 0.2, 0.3]
    m.o[3].shape, m.o[3].p = m.o[3].HALFSPACE, [0, 0, -1]
    run.inserted[3] = [("HULL", hull(SOURCE, 1, 9, (0.0, 2.0, 0.0), BOX))]
    run.inserted[6] = [("OBSTACLES", m)]
    run.before[2] = ("OBSTACLES", obstacles(PLANT, 1, 2, []))
    see(run, slice(3, 6), SOURCE, 1, hull=True)
    see(run, slice(6, None), SOURCE, 1)
    log = read_log(run.write(tmp_path))
    points = np.tile(
        [[0.5, 0, 0], [2, 0, 1], [3, 0, 0.5], [0, 0, -0.75], [0, 1.5, 0], [9, 9, 9]], (12, 1, 1)
    )
    around = follow(log, log.commands, points)
    assert np.isnan(around.distance[:3]).all()
    assert around.obstacle[3:6].tolist() == [[9] * 6] * 3
    assert around.distance[4, 4] == pytest.approx(0.3)
    assert around.obstacle[8].tolist() == [1, 2, 3, 4, 4, 4]  # a REPLACE dropped the hull
    assert around.distance[8, :4].tolist() == pytest.approx([0.25, 0.375, 0.2, 0.25])
    a = analysed(run, tmp_path)
    found = " ".join(texts(a, "obstacle"))
    for text in (
        "hull of 8 vertices at (0, 2, 0) m",
        "capsule of radius 0.125 m and half length 0.5 m at (2, 0, 0) m",
        "box of half extents 0.1, 0.2, 0.3 m at (3, 0, 0) m",
        "plane through (0, 0, -1) m",
        "sphere of radius 0.25 m",
        "obstacle 9 removed",
    ):
        assert text in found


def test_a_moving_obstacle_is_where_it_was_at_the_tick(tmp_path: Path) -> None:
    run = Run(ticks=41)
    m = obstacles(SOURCE, 1, 2, [(7, (2.0, 0.0, 0.0), 0.25)])
    m.o[0].v, m.time_ns, m.valid_for_ms = [0.0, 0.0, 1.0], 10 * PERIOD_NS, 160
    run.before[2] = ("OBSTACLES", obstacles(PLANT, 1, 2, []))
    run.inserted[10] = [("OBSTACLES", m)]
    see(run, slice(10, None), SOURCE, 1)
    log = read_log(run.write(tmp_path))
    around = follow(log, log.commands, np.zeros((41, 6, 3)))
    z = (np.arange(10, 30) - 10) * PERIOD
    assert around.distance[10:30, 0] == pytest.approx(np.hypot(2, z) - 0.25)
    assert np.isnan(around.distance[30:]).all()  # it has expired


def test_no_obstacle_means_no_distance(tmp_path: Path) -> None:
    run = Run(ticks=5)
    run.before[2] = ("OBSTACLES", obstacles(PLANT, 1, 2, []))
    for command in run.commands:
        command.clearance, command.clearance_link, command.clearance_obstacle = np.inf, 0, 0
    a = analysed(run, tmp_path)
    assert np.isnan(a.smallest_distance)
    assert a.to_json()["smallest_distance"] == {
        "distance": None,
        "link": 0,
        "obstacle": 0,
        "t": None,
    }
