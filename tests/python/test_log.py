"""Reading logs: framing, damage, foreign content."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from leeway_lcm import leeway as wire
from log_maker import CONTROLLER, PLANT, Run, event, obstacles, scene, stamp, status

from leeway.logs.log import Log, LogError, read_log, read_tables

WHOLE = Run(ticks=3)
FRAME = 28  # bytes of an event's header


def read_bytes(folder: Path, data: bytes, name: str | None = None) -> Log:
    path = folder / "x.lcm"
    path.write_bytes(data)
    return read_log(path, name)


def refusal(folder: Path, data: bytes, name: str | None = None) -> str:
    with pytest.raises(LogError) as caught:
        read_bytes(folder, data, name)
    text = str(caught.value)
    assert text.startswith(str(folder / "x.lcm"))
    assert "\n" not in text
    return text


@pytest.mark.parametrize(
    ("channel", "field", "kind"),
    [
        ("JOINT_COMMAND", "commands", wire.joint_command_t),
        ("STATUS", "statuses", wire.status_t),
        ("PLANT_STATUS", "plant_statuses", wire.status_t),
    ],
)
def test_columns_hold_every_field_of_the_wire(
    tmp_path: Path, channel: str, field: str, kind: Any
) -> None:
    message = stamp(kind(), 5, 6, 7)
    for number, name in enumerate(message.__slots__[1:], start=1):
        old = getattr(message, name)
        step = 1 / 8 if isinstance(old, list) and isinstance(old[0], float) else 1
        setattr(
            message,
            name,
            [number + i * step for i in range(len(old))] if isinstance(old, list) else number,
        )
    if channel == "JOINT_COMMAND":
        message.mode = message.VELOCITY  # the only field with few values
    table = getattr(read_bytes(tmp_path, WHOLE.data() + event(channel, message.encode())), field)
    row = table.take(np.array([len(table) - 1]))
    assert (row.session[0], row.seq[0], row.mono_ns[0], row.utime[0]) == (5, 6, 7, 7)
    for name in message.__slots__[1:]:
        assert np.array_equal(getattr(row, name)[0], getattr(message, name)), name


def test_all_kinds_of_messages_are_read(tmp_path: Path) -> None:
    run = Run(ticks=4)
    goal = stamp(wire.goal_t(), 7, 1)
    goal.p = [1.0, 2.0, 3.0]
    sphere = obstacles(7, 1, 0, [(9, (0.1, 0.2, 0.3), 0.05)])
    run.inserted[1] = [("GOAL", goal), ("STOP", stamp(wire.stop_t(), 7, 2)), ("OBSTACLES", sphere)]
    log = read_bytes(tmp_path, run.data())
    assert (log.truncated, log.undecodable, log.robot) == (0, {}, "")
    assert log.goals.p.tolist() == [[1, 2, 3]]
    assert log.stops.seq.tolist() == [2]
    assert (log.obstacles.op[1], log.obstacles.n[1], log.obstacles.id[1, 0]) == (0, 1, 9)
    assert log.obstacles.p[1, 0].tolist() == [0.1, 0.2, 0.3]
    assert [s.program for s in log.scenes] == ["leeway-simulator", "leeway-controller"]
    assert log.states.session.tolist() == [PLANT] * 4
    assert log.commands.session.tolist() == [CONTROLLER] * 4
    # Counted over all channels: scene, scene, obstacles, state, command, goal, stop, obstacles ...
    assert log.obstacles.order.tolist() == [2, 7]
    assert log.states.order.tolist() == [3, 8, 10, 12]


def test_foreign_and_undecodable_messages_are_counted(tmp_path: Path) -> None:
    state = Run(ticks=1).states[0].encode()
    other_layout = bytes([state[0] ^ 1]) + state[1:]
    extra = [
        ("LCM_SELF_TEST", b"lcm self test"),
        ("CAMERA", b""),
        ("JOINT_STATE", other_layout),
        ("JOINT_STATE", state[:-1]),
        ("JOINT_STATE", state + b"\0"),
        ("JOINT_COMMAND", b""),
        ("SCENE", b"\xff" * 20),
        ("SCENE", scene(1).encode()[:60]),
    ]
    log = read_bytes(tmp_path, WHOLE.data() + b"".join(event(*e) for e in extra))
    assert log.undecodable == {"JOINT_STATE": 3, "JOINT_COMMAND": 1, "SCENE": 2}
    assert (log.counts["CAMERA"], log.counts["LCM_SELF_TEST"], log.counts["JOINT_STATE"]) == (
        1,
        1,
        6,
    )
    assert len(log.states) == 3
    assert len(log.scenes) == 2


def test_messages_that_programs_refuse_are_no_part_of_the_log(tmp_path: Path) -> None:
    run = Run(ticks=6)
    bad = [Run(ticks=6).states[3] for _ in range(3)]
    bad[0].q = [np.nan, 0, 0, 0, 0, 0]
    bad[1].period_ns = -1
    bad[2].h.session = 0
    command = Run(ticks=6).commands[3]
    command.qd = [np.inf, 0, 0, 0, 0, 0]
    run.inserted[3] = [("JOINT_STATE", m) for m in bad] + [("JOINT_COMMAND", command)]
    log = read_bytes(tmp_path, run.data("A_"))
    assert log.undecodable == {"A_JOINT_STATE": 3, "A_JOINT_COMMAND": 1}
    assert log.states.seq.tolist() == [1, 2, 3, 4, 5, 6]
    assert log.commands.order.tolist() == [4, 6, 8, 14, 16, 18]
    # Replay looks at damaged messages too, and counts them itself.
    assert read_tables(tmp_path / "x.lcm").undecodable == {}


def test_cut_log_is_read_to_its_last_whole_event(tmp_path: Path) -> None:
    data = WHOLE.data()
    last = FRAME + len("JOINT_COMMAND") + len(WHOLE.commands[-1].encode())
    for missing in (1, last - FRAME, last - FRAME + 1, last - 1):
        log = read_bytes(tmp_path, data[:-missing])
        assert log.truncated == last - missing
        assert (len(log.states), len(log.commands)) == (3, 2)
    assert read_bytes(tmp_path, data[:-last]).truncated == 0


def test_damage_in_the_middle_ends_the_log_there(tmp_path: Path) -> None:
    data = bytearray(WHOLE.data())
    last = FRAME + len("JOINT_COMMAND") + len(WHOLE.commands[-1].encode())
    data[-last] ^= 1
    log = read_bytes(tmp_path, bytes(data))
    assert (log.truncated, len(log.commands)) == (last, 2)


def test_refusals_say_what_was_expected(tmp_path: Path) -> None:
    data = WHOLE.data()
    assert (
        "not an LCM log: expected events that start with 0xEDA1DA01, found 0x504B0304"
        in refusal(tmp_path, b"PK\3\4" + data)
    )
    assert "empty" in refusal(tmp_path, b"")
    assert "cut within its first event" in refusal(tmp_path, data[:40])
    assert "no JOINT_STATE in it: record with lcm-logger" in refusal(
        tmp_path, event("CAMERA", b"1")
    )
    with pytest.raises(LogError, match="cannot be read: No such file"):
        read_log(tmp_path / "missing.lcm")
    with pytest.raises(LogError, match="expected a log file"):
        read_log(tmp_path)


def test_other_layout_is_named_by_fingerprints(tmp_path: Path) -> None:
    state = WHOLE.states[0].encode()
    text = refusal(tmp_path, event("JOINT_STATE", b"\1\2\3\4\5\6\7\x08" + state[8:]))
    assert f"expected fingerprint {state[:8].hex()}, found 0102030405060708" in text


def test_robots_are_told_apart_by_prefix(tmp_path: Path) -> None:
    one, two = Run(ticks=2).data("ARM1_"), Run(ticks=5).data("ARM_2_")
    assert read_bytes(tmp_path, one).robot == "ARM1"
    assert len(read_bytes(tmp_path, one + two, "ARM_2").states) == 5
    assert "several robots in it, name one: found ARM1, ARM_2" in refusal(tmp_path, one + two)
    assert "no robot 'ARM3' in it: found ARM1, ARM_2" in refusal(tmp_path, one + two, "ARM3")
    assert "found one without a name" in refusal(tmp_path, WHOLE.data(), "ARM1")


def test_status_and_world_are_read_by_robot_and_may_be_missing(tmp_path: Path) -> None:
    for prefix, name in (("", None), ("ARM1_", "ARM1"), ("PLANT_2_", "PLANT_2")):
        run = Run(ticks=13)
        run.tell()
        run.before.append(("WORLD", obstacles(CONTROLLER, 1, 2, [(7, (1.0, 1.0, 0.4), 0.0)])))
        stranger = event("OTHER_STATUS", status(99, 0).encode())
        cut = event(prefix + "STATUS", status(CONTROLLER, 0).encode()[:-1])
        log = read_bytes(tmp_path, run.data(prefix) + stranger + cut, name)
        assert log.statuses.session.tolist() == [CONTROLLER] * 3
        assert log.plant_statuses.session.tolist() == [PLANT] * 3
        assert (log.statuses.refused.shape, log.statuses.age_ns.shape) == ((3, 16), (3, 4))
        assert log.statuses.ticks.tolist() == [500, 506, 512]
        assert log.worlds.id[:, 0].tolist() == [7]
        assert (log.counts[prefix + "WORLD"], log.undecodable) == (1, {prefix + "STATUS": 1})
    assert len(read_bytes(tmp_path, WHOLE.data()).statuses) == 0


def test_lengths_that_lie_are_not_believed(tmp_path: Path) -> None:
    head = struct.pack(">IqqII", 0xEDA1DA01, 0, 0, 0xFFFFFFFF, 0xFFFFFFFF)
    assert read_bytes(tmp_path, WHOLE.data() + head + b"x" * 50).truncated == FRAME + 50


# A piece of a log: anything, or a whole event with anything in it.
PIECES = st.one_of(
    st.binary(max_size=60),
    st.builds(
        event,
        st.sampled_from(
            [
                *("JOINT_STATE", "A_JOINT_COMMAND", "SCENE", "OBSTACLES", "GOAL", "STOP", "_STOP"),
                *("STATUS", "A_PLANT_STATUS", "WORLD", ""),
            ]
        ),
        st.binary(max_size=80),
    ),
    st.builds(lambda tail: event("SCENE", scene(1).encode()[:8] + tail), st.binary(max_size=80)),
    st.sampled_from([event(name, m.encode()) for name, m in WHOLE.messages()]),
)


@settings(
    max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(pieces=st.lists(PIECES, max_size=8), cut=st.integers(0, 40))
def test_no_bytes_raise_anything_but_log_error(
    tmp_path: Path, pieces: list[bytes], cut: int
) -> None:
    data = b"".join(pieces)
    data = data[: len(data) - cut]
    try:
        log = read_bytes(tmp_path, data)
    except LogError:
        return
    whole = sum(log.counts.values())
    assert 0 <= log.truncated < len(data)
    assert whole >= len(log.states) + len(log.commands) + len(log.scenes)
