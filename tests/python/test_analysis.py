"""Numbers of a run: motion, obstacles in force, distances, limits, timing, losses, events."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from leeway_lcm import leeway as wire
from log_maker import (
    CONTROLLER,
    PERIOD_NS,
    PLANT,
    SCENE,
    SOURCE,
    Run,
    analysed,
    scene,
    set_limits,
    stamp,
    texts,
)

from leeway import _native
from leeway.logs.analysis import analyse, percentiles
from leeway.logs.log import LogError, read_log

PERIOD = PERIOD_NS * 1e-9
DAMAGED = Run(ticks=8)


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
    assert a.smallest_distance == pytest.approx(min(c.clearance for c in run.commands), abs=1e-15)
    assert a.distance_check < 1e-15
    # The tip turns about axis 1 at a constant radius.
    assert a.tip_path_length == pytest.approx(0.5 * 0.4 * np.hypot(*tip[:2]), rel=1e-4)
    assert [event.kind for event in a.events] == ["start", "obstacle", "end"]
    assert texts(a, "end") == ["0.400 end of the scene: 0.4 s of motion"]


def test_motion_may_outlast_the_scene(tmp_path: Path) -> None:
    run = Run(ticks=60)
    found = texts(analysed(run, tmp_path), "end")
    assert found == ["0.472 end of the motion, which went on after the scene's 0.4 s"]


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


def test_being_stuck_and_the_ways_out_become_events(tmp_path: Path) -> None:
    run = Run()
    for command in run.commands[10:20]:
        command.stuck_since_ns, command.deviation = 1, 0.25
    for command in run.commands[20:30]:
        command.circulation = [0, 0, 1]
    for command in run.commands[30:40]:
        command.law_outcome = command.ASIDE
    assert texts(analysed(run, tmp_path), "stuck") == [
        "0.080 the tip is stuck 0.250 m from the goal until 0.152 s",
        "0.160 way out: circulation about (0, 0, 1)",
        "0.240 the circulation ends",
        "0.240 way out: the joints move aside until 0.312 s",
    ]


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


def test_a_crowd_of_sessions_is_told_in_one_line(tmp_path: Path) -> None:
    run = Run()
    strangers = [Run(ticks=6).states[3] for _ in range(500)]
    for session, state in enumerate(strangers, start=1000):
        state.h.session = session
    run.inserted[3] = [("JOINT_STATE", m) for m in strangers]
    told = texts(analysed(run, tmp_path), "restart")
    assert len(told) == 11
    assert "another plant, session 1009, 1 messages" in told[-2]
    assert "490 more plants, 490 messages" in told[-1]


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
    set_limits(run, "limits: {velocity: off}\nplant: {velocity: off}\n")
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
