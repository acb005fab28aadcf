"""Numbers of a run: motion, obstacles in force, distances, limits, timing, losses, events."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from leeway_lcm import leeway as wire
from log_maker import CONTROLLER, PERIOD_NS, PLANT, SCENE, SOURCE, Run, obstacles, scene, stamp

from leeway import _native
from leeway.analysis import Analysis, analyse, percentiles
from leeway.log import LogError, read_log
from leeway.world import follow, nearest

PERIOD = PERIOD_NS * 1e-9
DAMAGED = Run(ticks=8)


def analysed(run: Run, folder: Path) -> Analysis:
    return analyse(read_log(run.write(folder)))


def texts(a: Analysis, kind: str) -> list[str]:
    return [f"{event.t:.3f} {event.text}" for event in a.events if event.kind == kind]


def see(run: Run, rows: slice, session: int, seq: int) -> None:
    """Make commands echo an OBSTACLES message."""
    for command in run.commands[rows]:
        command.world_session, command.world_seq = session, seq


def set_limits(run: Run, lines: str) -> None:
    """Add lines to the scene that the controller announces."""
    run.before[1] = ("SCENE", scene(CONTROLLER, yaml=SCENE + lines))


def test_plain_run(tmp_path: Path) -> None:
    run = Run()
    a = analysed(run, tmp_path)
    tip = _native.Arm("ur5").fk(np.array(run.commands[-1].q))[:3, 3]
    assert (a.label, a.mode, a.robot, a.rho, a.gamma, a.attraction) == (
        "test",
        "realtime",
        "ur5",
        1.9,
        2,
        "cone",
    )
    assert (a.ticks, a.late_ticks, a.truncated_bytes) == (51, 0, 0)
    assert a.t == pytest.approx(np.arange(51) * PERIOD, abs=1e-15)
    assert a.period == pytest.approx(PERIOD)
    assert a.tip[-1] == pytest.approx(tip, abs=1e-15)
    assert a.final_deviation == pytest.approx(run.commands[-1].deviation, abs=1e-15)
    assert a.smallest_distance == pytest.approx(min(c.distance for c in run.commands), abs=1e-15)
    assert a.distance_check < 1e-15
    # The tip turns about axis 1 at a constant radius.
    assert a.tip_path_length == pytest.approx(0.5 * 0.4 * np.hypot(*tip[:2]), rel=1e-4)
    assert [event.kind for event in a.events] == ["start", "obstacle", "end"]
    assert texts(a, "end") == ["0.400 end of the scene: 0.4 s of motion"]


def test_motion_begins_with_the_first_command_obeyed_and_ends_with_the_last_new_state(
    tmp_path: Path,
) -> None:
    run = Run(ticks=20)
    idle = Run(ticks=1).commands[0]
    idle.mode = 0
    refused = Run(ticks=1).commands[0]
    for early, (message, seq) in enumerate(((idle, 1), (refused, 2))):
        message.h.seq = message.tick = seq
        run.before.append(("JOINT_COMMAND", message))
        run.before[-1][1].h.mono_ns = -2 + early
    for k, command in enumerate(run.commands):
        command.h.seq, command.tick = k + 3, k + 3
    for k, state in enumerate(run.states):
        state.command_seq = k + 2 if k else 0
    run.commands[19].state_seq = run.commands[19].state_tick = 19  # the last state again
    run.commands[19].flags = 16
    a = analysed(run, tmp_path)
    assert a.ticks == 19
    assert a.flag_shares["stale"] == 0
    assert "is the plant gone? 1 commands follow" in texts(a, "end")[0]


def test_obstacles_in_force_follow_the_echo_not_the_order_of_the_log(tmp_path: Path) -> None:
    run = Run(ticks=31)
    near = (0.0, -0.8, 0.1)
    run.inserted[5] = [("OBSTACLES", obstacles(SOURCE, 1, 0, [(900, near, 0.05)]))]
    run.inserted[15] = [("OBSTACLES", obstacles(SOURCE, 2, 1, [(900, (0.0, 0.0, 0.0), 0.0)]))]
    see(run, slice(10, 20), SOURCE, 1)  # taken in five ticks after it was logged
    see(run, slice(20, 31), SOURCE, 2)
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
    assert a.smallest.point >= 2


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


@settings(max_examples=60, deadline=None)
@given(ops=st.lists(OPS, min_size=1, max_size=8))
def test_world_agrees_with_a_plain_model(
    tmp_path_factory: pytest.TempPathFactory, ops: list[Any]
) -> None:
    run = Run(ticks=len(ops) + 2)
    model: dict[int, tuple[float, float, int]] = {1: (1.0, 0.0, PLANT)}
    expected = [dict(model)]
    run.before[2] = ("OBSTACLES", obstacles(PLANT, 1, 0, [(1, (1.0, 0.0, 0.0), 0.0)]))
    for k, (session, op, items) in enumerate(ops, start=1):
        run.inserted[k] = [
            (
                "OBSTACLES",
                obstacles(session, k + 1, op, [(i, (x, 0.0, 0.0), r) for i, x, r in items]),
            )
        ]
        ids = [i for i, _, _ in items]
        usable = all(i > 0 for i in ids) and len(set(ids)) == len(ids)
        if op != 1:
            usable = usable and all(abs(x) <= 100 and r >= 0 for _, x, r in items)
        if usable:
            see(run, slice(k, None), session, k + 1)
            if op == 3:
                model = {}
            elif op == 1:
                model = {i: o for i, o in model.items() if i not in ids}
            else:
                if op == 2:
                    model = {i: o for i, o in model.items() if o[2] != session or i in ids}
                model = model | {i: (x, r, session) for i, x, r in items}
        expected.append(dict(model))
    log = read_log(run.write(tmp_path_factory.mktemp("world")))
    line = follow(log.obstacles, log.commands)
    found = [{o.id: (o.p[0], o.radius, o.session) for o in line.worlds[i]} for i in line.index]
    assert found[: len(expected)] == expected
    assert line.unknown_ticks == 0


def test_nearest_is_the_smallest_over_all_obstacles(tmp_path: Path) -> None:
    run = Run(ticks=3)
    items = [(k, (0.3 * k, -0.2 * k, 0.1), 0.02 * k) for k in range(1, 9)]
    run.before[2] = ("OBSTACLES", obstacles(PLANT, 1, 2, items))
    log = read_log(run.write(tmp_path))
    points = np.random.default_rng(1).normal(size=(3, 6, 3))
    distance, obstacle = nearest(points, follow(log.obstacles, log.commands))
    for row, column in np.ndindex(3, 6):
        each = {k: float(np.linalg.norm(points[row, column] - p)) - r for k, p, r in items}
        best = min(each, key=lambda k: each[k])
        assert obstacle[row, column] == best
        assert distance[row, column] == pytest.approx(each[best], abs=1e-14)


def test_no_obstacle_means_no_distance(tmp_path: Path) -> None:
    run = Run(ticks=5)
    run.before[2] = ("OBSTACLES", obstacles(PLANT, 1, 2, []))
    a = analysed(run, tmp_path)
    assert np.isnan(a.smallest_distance)
    assert a.to_json()["smallest_distance"] == {
        "distance": None,
        "point": 0,
        "obstacle": 0,
        "t": None,
    }


def test_limits_are_told_as_kept_up_to_rounding_and_as_exceeded_beyond(tmp_path: Path) -> None:
    run = Run(speed=0.5)
    set_limits(
        run,
        "limits: {velocity: 0.5, acceleration: 62.5}\nplant: {velocity: off, acceleration: 100}\n",
    )
    a = analysed(run, tmp_path)
    use = {u.key: u for u in a.limits}
    assert use["limits.velocity"].share == pytest.approx(1)
    assert use["limits.acceleration"].share == pytest.approx(1)  # 0.5 rad/s from rest in one period
    assert (use["limits.acceleration"].t, use["limits.acceleration"].joint) == (0, 1)
    assert use["plant.acceleration"].share == pytest.approx(0.625)
    assert not use["plant.velocity"].on
    assert a.limits_kept

    run.commands[30].qd = [0, 0, 0, -0.5 * (1 + 1e-8), 0, 0]
    use = {u.key: u for u in analysed(run, tmp_path).limits}
    assert use["limits.velocity"].exceeded
    assert (use["limits.velocity"].joint, use["limits.velocity"].t) == (4, pytest.approx(0.24))
    assert use["limits.acceleration"].largest[3] == pytest.approx(0.5 / PERIOD)


def test_joint_range_counts_from_its_middle(tmp_path: Path) -> None:
    run = Run(speed=1.0)
    set_limits(
        run,
        "limits: {position_min: [-1, -1, -1, -1, -1, -1], position_max: [0.5, 1, 1, 1, 1, 1]}\n",
    )
    use = analysed(run, tmp_path).limits[0]
    assert use.share == pytest.approx((0.4 + 0.25) / 0.75)
    assert use.joint == 1
    run.states[-1].q = [0.51, 0, 0, 0, 0, 0]
    assert analysed(run, tmp_path).limits[0].exceeded


def test_acceleration_is_not_taken_over_a_gap_of_the_log(tmp_path: Path) -> None:
    run = Run()
    for k in range(20, 51):
        run.commands[k].qd = [1.5, 0, 0, 0, 0, 0]
    run.commands[15:20] = []
    for k in range(15, len(run.commands)):
        assert run.commands[k].tick == k + 6
    a = analysed(run, tmp_path)
    acceleration = next(u for u in a.limits if u.key == "limits.acceleration")
    assert acceleration.largest[0] == pytest.approx(0.5 / PERIOD)
    assert a.losses["commands_not_in_log"] == 5


def test_losses_are_counted_by_the_messages_own_numbers(tmp_path: Path) -> None:
    run = Run()
    run.states[10:12] = []
    run.commands[20].state_seq, run.commands[20].state_tick = (
        20,
        19,
    )  # state 20 again, so state 21 unused
    for state in run.states[30:]:
        state.command_seq += 1
    a = analysed(run, tmp_path)
    assert a.losses["states_not_in_log"] == 2
    assert (a.losses["states_used_again"], a.losses["states_not_used"]) == (1, 1)
    assert (
        a.losses["commands_not_obeyed"] == 3
    )  # two states with their echoes are missing, one was passed over


def test_messages_are_ordered_by_seq_and_counted_once(tmp_path: Path) -> None:
    run = Run()
    run.commands[10], run.commands[11] = run.commands[11], run.commands[10]
    run.inserted[30] = [("JOINT_COMMAND", run.commands[5]), ("JOINT_STATE", run.states[5])]
    a = analysed(run, tmp_path)
    assert a.ticks == 51
    assert (np.diff(a.t) > 0).all()
    assert a.plant_t == pytest.approx(np.arange(51) * PERIOD)


def test_timing_counts_ticks_of_motion(tmp_path: Path) -> None:
    run = Run()
    for command in run.commands:
        command.skipped = 4  # before the motion
    run.commands[-1].skipped = 6
    run.commands[0].previous_exec_ns = 10**9  # of a tick before the motion
    a = analysed(run, tmp_path)
    assert a.late_ticks == 2
    assert a.timing["wake_late_us"] == {"p50": 20.025, "p99": 20.05, "p99_9": 20.05, "max": 20.05}
    assert a.timing["exec_us"]["p50"] == 30.025
    assert a.timing["exec_us"]["max"] == 30.05
    run.before[1] = ("SCENE", scene(CONTROLLER, mode="lockstep"))
    lockstep = analysed(run, tmp_path)
    assert (lockstep.timing, lockstep.late_ticks) == ({}, 0)


def test_percentiles_are_values_that_occurred() -> None:
    values = np.arange(1.0, 1001.0)
    assert percentiles(values) == {"p50": 500, "p99": 990, "p99_9": 999, "max": 1000}


def test_requests_become_events(tmp_path: Path) -> None:
    run = Run()
    goal, stop, ignored = (
        stamp(wire.goal_t(), SOURCE, 1),
        stamp(wire.stop_t(), SOURCE, 2),
        stamp(wire.stop_t(), 44, 1),
    )
    goal.h.mono_ns, stop.h.mono_ns, ignored.h.mono_ns = (k * PERIOD_NS for k in (10, 40, 20))
    run.inserted = {10: [("GOAL", goal)] * 3, 40: [("STOP", stop)], 20: [("STOP", ignored)]}
    for k, command in enumerate(run.commands):
        if k >= 10:
            command.request_session, command.request_seq = SOURCE, 1 if k < 40 else 2
            command.goal = [0.2, -0.6, 0.6] if k < 40 else [0, 0, 0]
            command.flags = 8 if k >= 40 else 0
    a = analysed(run, tmp_path)
    assert texts(a, "goal") == ["0.080 goal changed to (0.2, -0.6, 0.6) m"]
    assert (
        texts(a, "stop")[1] == "0.320 stop request obeyed: braked to rest, 11 ticks until 0.400 s"
    )
    # A stop keeps the goal: deviation is not taken to the zeros that such a command carries.
    assert a.goal[-1].tolist() == [0.2, -0.6, 0.6]
    assert a.final_deviation == pytest.approx(np.linalg.norm(a.tip[-1] - [0.2, -0.6, 0.6]))
    assert a.flag_shares["stopped"] == pytest.approx(11 / 51)


@pytest.mark.parametrize("echoed", [False, True])
def test_stop_that_no_command_obeys_is_told(tmp_path: Path, echoed: bool) -> None:
    run = Run()
    stop = stamp(wire.stop_t(), SOURCE, 1, 20 * PERIOD_NS)
    run.inserted = {20: [("STOP", stop)]}
    for command in run.commands[10:] if echoed else []:  # as of a GOAL with the same stamp
        command.request_session, command.request_seq = SOURCE, 1
    found = texts(analysed(run, tmp_path), "stop")
    assert len(found) == 1
    assert found[0].endswith(f"stop asked for by session {SOURCE}, not obeyed")


def test_newest_sessions_that_moved_are_taken_and_others_told(tmp_path: Path) -> None:
    old, new = Run(ticks=9), Run(ticks=21)
    for k, command in enumerate(new.commands):
        command.h.session, command.plant_session = 222, 111
        command.h.mono_ns = new.states[k].h.mono_ns = 10**9 + k * PERIOD_NS
        new.states[k].h.session, new.states[k].command_session = 111, 222 * min(k, 1)
    late = Run(ticks=1).states[0]  # a plant that never moved
    late.h.session, late.h.mono_ns = 999, 2 * 10**9
    new.before = [("SCENE", scene(222, file="second.yaml"))]
    path = tmp_path / "run.lcm"
    tail = Run(ticks=0)
    tail.before = [("JOINT_STATE", late)]
    path.write_bytes(old.data() + new.data() + tail.data())
    a = analyse(read_log(path))
    assert (a.ticks, a.label) == (21, "second")
    found = [event.text for event in a.events if event.kind == "restart"]
    assert [text.split(":")[0] for text in found] == [
        f"another plant, session {PLANT}, 9 messages",
        f"another controller, session {CONTROLLER}, 9 messages",
        "another plant, session 999, 1 messages",
    ]
    times = [event.t for event in a.events if event.kind == "restart"]
    assert times[0] < 0 < times[2]


def test_ceasing_commands_and_stale_states_are_told(tmp_path: Path) -> None:
    run = Run()
    for state in run.states[20:25]:
        state.plant_mode = 2
    for command in run.commands[30:33]:
        command.flags = 16
    a = analysed(run, tmp_path)
    assert texts(a, "plant") == [
        "0.160 commands ceased: the plant ramps to rest; commands again at 0.200 s"
    ]
    assert texts(a, "stale") == ["0.240 no fresh joint state: braked, 3 ticks until 0.256 s"]


def test_cut_log_is_told_last(tmp_path: Path) -> None:
    path = Run().write(tmp_path)
    path.write_bytes(path.read_bytes()[:-5])
    a = analyse(read_log(path))
    assert a.truncated_bytes > 0
    assert a.events[-1].kind == "log"
    assert a.ticks == 50


def test_logs_without_motion_or_scene_are_refused(tmp_path: Path) -> None:
    still = Run()
    for state in still.states:
        state.plant_mode = state.command_session = state.command_seq = 0
    with pytest.raises(LogError, match="the arm never moved"):
        analysed(still, tmp_path)
    alone = Run()
    alone.commands = []
    with pytest.raises(LogError, match="no JOINT_COMMAND in it"):
        analysed(alone, tmp_path)
    nameless = Run()
    nameless.before = nameless.before[2:]
    with pytest.raises(LogError, match="no SCENE in it"):
        analysed(nameless, tmp_path)
    future = Run()
    future.before[1] = ("SCENE", scene(CONTROLLER, yaml=SCENE + "wings: 2\n"))
    with pytest.raises(LogError, match=r"is refused: .*wings"):
        analysed(future, tmp_path)


@settings(max_examples=80, deadline=None)
@given(changes=st.lists(st.tuples(st.floats(0, 1), st.integers(0, 255)), min_size=1, max_size=30))
def test_damaged_numbers_raise_nothing_but_log_error(
    tmp_path_factory: pytest.TempPathFactory, changes: list[tuple[float, int]]
) -> None:
    data = bytearray(DAMAGED.data())
    for at, value in changes:
        data[int(at * (len(data) - 1))] = value
    path = tmp_path_factory.mktemp("damage") / "x.lcm"
    path.write_bytes(data)
    try:
        a = analyse(read_log(path))
    except LogError:
        return
    json.dumps(a.to_json(), allow_nan=False)


def test_json_is_strict_and_without_arrays(tmp_path: Path) -> None:
    run = Run()
    set_limits(run, "limits: {velocity: off}\n")
    document = json.dumps(analysed(run, tmp_path).to_json(), allow_nan=False)
    back = json.loads(document)
    assert back["limits"][1]["limit"] == [None] * 6
    assert back["ticks"] == 51
    assert {
        "final_deviation",
        "smallest_distance",
        "late_ticks",
        "losses",
        "events",
        "scene",
    } <= back.keys()
    assert len(document) < 10_000
