"""What STATUS adds to a run, leave-taking plants, several controllers, and post-mortem logs."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from log_maker import (
    CONTROLLER,
    PERIOD_NS,
    PLANT,
    Run,
    analysed,
    event,
    scene,
    status,
    texts,
)

from leeway.logs.analysis import analyse
from leeway.logs.log import LogError, read_log

OVERRUN, LEASE = 2, 8
STALE, FOREIGN = 16, 128
MOVING, STOPPING, ENDED = 1, 2, 3

# --- programs ---


def test_programs_are_told_by_their_last_status_and_their_worst_seconds(tmp_path: Path) -> None:
    run = Run()
    told = run.tell()
    last = told["STATUS"][-1]
    last.skipped, last.stale_ticks, last.unsent, last.missed, last.takeovers = 3, 4, 5, 6, 1
    last.refused[last.FOREIGN], last.faults_ever = 9, OVERRUN | LEASE
    last.minor_faults, last.major_faults, last.allocations = 7, 2, 0
    told["STATUS"][2].exec_ns = [1_000, 2_000, 3_000, 555_000]
    run.inserted[50] = [("STATUS", status(99, 50 * PERIOD_NS, faults_ever=32))]  # not of the motion
    a = analysed(run, tmp_path)
    assert [program.name for program in a.programs] == ["controller", "simulator"]
    found = a.programs[0].to_json()
    assert (
        found
        | {
            "program": "leeway-controller",
            "session": CONTROLLER,
            "rate_hz": 125.0,
            "realtime": ["fifo", "locked"],
            "faults_ever": ["overrun", "lease"],
            "skipped": 3,
            "stale_ticks": 4,
            "unsent": 5,
            "missed": 6,
            "takeovers": 1,
            "refused": {"foreign": 9},
            "minor_faults": 7,
            "major_faults": 2,
            "allocations": 0,
            "worst_exec_us": {"p50": 30.0, "p99": 50.0, "p999": 70.0, "max": 555.0},
        }
        == found
    )
    assert a.programs[1].last.allocations is None
    assert a.programs[1].t[0] == pytest.approx(0)
    assert json.loads(json.dumps(a.to_json(), allow_nan=False))["programs"][0] == found


def test_logs_without_status_have_no_programs(tmp_path: Path) -> None:
    a = analysed(Run(), tmp_path)
    assert (a.programs, a.to_json()["programs"], a.post_mortem) == ([], [], False)


# --- faults ---


def test_faults_are_told_when_they_appear_and_go(tmp_path: Path) -> None:
    run = Run(ticks=301)
    run.tell(STATUS={12: OVERRUN, 60: 0, 90: OVERRUN, 150: 0, 288: LEASE}, PLANT_STATUS={294: 64})
    assert texts(analysed(run, tmp_path), "fault") == [
        "0.096 controller: overrun until 1.152 s",  # 0.288 s without it are no news
        "2.304 controller: lease to its last message",
        "2.352 simulator: bit 64 to its last message",
    ]


def test_faults_that_come_again_after_more_than_a_second_are_two(tmp_path: Path) -> None:
    run = Run(ticks=301)
    run.tell(STATUS={12: OVERRUN, 18: 0, 150: OVERRUN, 156: 0})
    assert texts(analysed(run, tmp_path), "fault") == [
        "0.096 controller: overrun until 0.096 s",
        "1.200 controller: overrun until 1.200 s",
    ]


def test_takeovers_are_told_with_the_new_session(tmp_path: Path) -> None:
    run = Run()
    told = run.tell()
    for m in told["PLANT_STATUS"][4:]:
        m.takeovers, m.peer_session = 1, 77
    for m in told["STATUS"][6:]:
        m.takeovers, m.peer_session = 1, 78
    assert texts(analysed(run, tmp_path), "restart") == [
        "0.192 simulator: another controller took over, session 77",
        "0.288 controller: another plant took over, session 78",
    ]


# --- other controllers, plants that leave ---


def test_foreign_spans_are_told_before_and_during_the_motion(tmp_path: Path) -> None:
    run = Run()
    for command in run.commands[:8]:  # idle, then braking, while the plant obeys another
        command.mode, command.flags = int(command.tick > 4), FOREIGN
    for state in run.states[:9]:
        state.command_session = 0 if state.tick == 0 else 99
    for command in run.commands[30:33]:
        command.flags = FOREIGN
    a = analysed(run, tmp_path)
    assert (a.t[0], a.flag_shares["foreign"]) == (pytest.approx(0.064), pytest.approx(3 / 43))
    assert texts(a, "foreign") == [
        "0.000 another controller commands the plant, 8 ticks until 0.056 s",
        "0.240 another controller commands the plant, 3 ticks until 0.256 s",
    ]
    assert texts(a, "start")[0].startswith("0.064 motion starts: first command obeyed")


def test_controller_that_was_never_obeyed_is_shown(tmp_path: Path) -> None:
    run = Run()
    for state in run.states:
        state.plant_mode, state.command_session = MOVING, 99
    for command in run.commands:
        command.flags = FOREIGN
    a = analysed(run, tmp_path)
    assert a.ticks == 51
    assert "first command that asks for motion; the plant obeyed none" in texts(a, "start")[0]
    assert a.losses["commands_not_obeyed"] == 0
    for command in run.commands:
        command.mode = 0
    with pytest.raises(LogError, match="no controller in it asked for motion: all 51 commands"):
        analysed(run, tmp_path)


def _left_alone(last_mode: int) -> Run:
    """Return a run whose last 11 commands answer the same state, stale, 0.4 s before the end."""
    run = Run(ticks=41)
    run.states[30].plant_mode = last_mode
    run.states[31:] = []
    for command in run.commands[31:]:
        command.state_seq, command.state_tick, command.flags = 31, 30, STALE
    return run


def test_plant_that_ended_is_told_and_its_silence_is_no_alarm(tmp_path: Path) -> None:
    a = analysed(_left_alone(ENDED), tmp_path)
    assert texts(a, "plant") == ["0.240 the plant ended in good order"]
    assert texts(a, "end") == ["0.240 joint states end 0.160 s before the scene does"]
    assert texts(a, "stale") == []


def test_plant_that_outlived_the_commands_and_ended_is_no_plant_that_obeys_again(
    tmp_path: Path,
) -> None:
    run = Run(ticks=31)
    run.commands[20:] = []
    for k, state in enumerate(run.states[22:], start=22):
        state.plant_mode, state.command_seq = ENDED if k == 30 else STOPPING, 20
    a = analysed(run, tmp_path)
    assert texts(a, "plant") == [
        "0.176 commands ceased: the plant ramps to rest",
        "0.240 the plant ended in good order",
    ]
    assert texts(a, "end") == ["0.152 commands end 0.248 s before the scene does"]


def test_plant_that_vanished_is_an_alarm_with_the_brake(tmp_path: Path) -> None:
    a = analysed(_left_alone(MOVING), tmp_path)
    assert texts(a, "plant") == []
    assert "is the plant gone? 10 commands follow" in texts(a, "end")[0]
    assert texts(a, "stale") == [
        "0.248 no fresh joint state: braked, 10 ticks until 0.320 s",
    ]


# --- post-mortem logs ---


def _post_mortem() -> Run:
    """Return what the controller writes: its SCENE, the states it used, its commands.

    Three ticks find no new state; the plant's next one is two numbers further, and echoes more.
    """
    run = Run()
    run.before = [("SCENE", scene(CONTROLLER)), run.before[2]]
    for k in (30, 31, 32):
        run.commands[k].state_seq, run.commands[k].state_tick = 30, 29
    run.states[30:33] = []
    run.states[:10] = []
    run.commands[:10] = []
    return run


def test_post_mortem_log_says_what_it_is_and_lacks_nothing(tmp_path: Path) -> None:
    a = analysed(_post_mortem(), tmp_path)
    assert a.post_mortem
    assert a.why_no_programs == "no STATUS of them in this post-mortem log"
    assert texts(a, "log")[0].startswith("0.080 post-mortem log: ")
    assert "the log starts in mid-motion, at tick 11 of the controller" in texts(a, "start")[0]
    assert a.losses["commands_not_in_log"] == a.losses["states_not_in_log"] == 0
    assert (a.losses["states_not_used"], a.losses["commands_not_obeyed"]) == (3, 0)
    assert texts(a, "obstacle")[0].endswith("from the plant")


def test_post_mortem_log_may_lack_commands(tmp_path: Path) -> None:
    run = _post_mortem()
    run.commands[5:7] = []
    run.states[5:7] = []
    assert analysed(run, tmp_path).losses["commands_not_in_log"] == 2


@pytest.mark.parametrize("sign", ["scene", "status", "state", "controller"])
def test_recorded_log_is_no_post_mortem_and_its_gaps_count(tmp_path: Path, sign: str) -> None:
    run = _post_mortem()
    path = run.write(tmp_path)
    more = {
        "scene": ("SCENE", scene(PLANT, "leeway-simulator")),
        "status": ("STATUS", status(CONTROLLER, 0)),
        "state": ("JOINT_STATE", Run().states[31]),
        "controller": ("JOINT_COMMAND", Run().commands[3]),
    }
    channel, message = more[sign]
    if sign == "controller":
        message.h.session, message.plant_session = 99, 98
    path.write_bytes(path.read_bytes() + event(channel, message.encode()))
    a = analyse(read_log(path))
    assert not a.post_mortem
    assert a.losses["states_not_in_log"] == (2 if sign == "state" else 3)
    assert not any("post-mortem" in text for text in texts(a, "log"))
