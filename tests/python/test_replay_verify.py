"""Verifying: what must be equal is, and every damage is found where it was done."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from log_maker import event, scene
from replay_maker import CONTROLLER, SCENE, Messages, Recorder, places, usual, write

from leeway import _native
from leeway.logs.log import as_rows, read_tables
from leeway.replay.digest import digest, input_words
from leeway.replay.ticks import FILLED_BY_PROCESS, Replay, spans
from leeway.replay.verify import ControllerResult, Verification, verify

TICKS = 50
# In OBSTACLES: fingerprint, header, owner, time, expiry, op, n, id and shape of the first entry.
FIRST_P = 8 + 32 + 8 + 8 + 4 + 1 + 4 + 4 + 1


def verified(log: Messages, folder: Path) -> Verification:
    return verify(read_tables(write(log, folder / "run.lcm")))


def only(result: Verification) -> ControllerResult:
    assert len(result.controllers) == 1
    return result.controllers[0]


def flip(log: Messages, place: int, byte: int, bit: int = 0) -> Messages:
    """Change one bit of one message."""
    name, data = log[place]
    changed = bytearray(data)
    changed[byte] ^= 1 << bit
    return [*log[:place], (name, bytes(changed)), *log[place + 1 :]]


def without(log: Messages, *gone: int) -> Messages:
    return [one for k, one in enumerate(log) if k not in gone]


def field_at(channel: str, byte: int) -> str:
    """Name of the field that a byte of a message belongs to."""
    layout: Any = as_rows(channel, b"").dtype
    inside = [n for n in layout.names if layout.fields[n][1] <= byte - 8]
    return str(inside[-1])


# --- what is equal ---


def test_every_tick_of_a_whole_log_is_equal(tmp_path: Path) -> None:
    c = only(result := verified(usual(), tmp_path))
    assert (c.verified, c.equal, result.result) == (TICKS, TICKS, "equal")
    assert c.same_build
    assert c.own_scene


def test_all_but_what_the_process_fills_in_is_compared() -> None:
    layout: Any = as_rows("JOINT_COMMAND", b"").dtype
    compared = {k for a, b in spans(layout) for k in range(a, b)}
    for name in layout.names:
        kind, offset = layout.fields[name][:2]
        own = set(range(offset + 8, offset + 8 + kind.itemsize))
        assert own.isdisjoint(compared) if name in FILLED_BY_PROCESS else own <= compared


def test_a_command_sent_again_is_no_tick(tmp_path: Path) -> None:
    r = Recorder()
    r.obstacles(7, 1, [])
    r.tick(5)
    r.repeat()
    r.repeat()
    r.tick(5)
    c = only(verified(r.log, tmp_path))
    assert (c.verified, c.equal, c.sent_again) == (10, 10, 2)


def test_a_restarted_controller_begins_anew(tmp_path: Path) -> None:
    first = Recorder()
    first.obstacles(7, 1, [(1, (0.6, -0.5, 0.5), 0.1)])
    first.tick(10)
    second = Recorder(CONTROLLER + 1, first.log)
    second.state, second.now = first.state, first.now
    second.tick(3)
    second.obstacles(7, 2, [(1, (0.6, -0.5, 0.5), 0.1)])
    second.tick(7)
    result = verified(first.log, tmp_path)
    assert [(c.verified, c.equal) for c in result.controllers] == [(10, 10), (10, 10)]
    assert result.result == "equal"


def test_ticks_lost_together_with_their_numbers_are_missing(tmp_path: Path) -> None:
    log = usual()
    commands = places(log, "JOINT_COMMAND")
    result = verified(without(log, *commands[20:23]), tmp_path)
    c = only(result)
    assert (c.not_in_log, c.verified, c.equal, result.result) == (3, 46, 46, "incomplete")
    assert sum(c.unknown.values()) == 1


# --- obstacles of several senders ---


def overtaking(*, swapped: bool) -> Messages:
    """Two senders' messages between two ticks, logged in the order taken or in the other."""
    r = Recorder()
    r.obstacles(7, 1, [(1, (0.6, -0.5, 0.5), 0.1)])
    r.tick(4)
    r.obstacles(7, 2, [(1, (0.55, -0.5, 0.5), 0.1), (5, (0.1, 0.6, 0.5), 0.1)])
    r.obstacles(8, 1, [(2, (0.4, -0.6, 0.5), 0.1)])
    if swapped:
        r.log[-2:] = r.log[:-3:-1]
    r.tick(6)
    return r.log


@pytest.mark.parametrize("swapped", [False, True])
def test_messages_that_overtook_one_another(tmp_path: Path, swapped: bool) -> None:
    result = verified(overtaking(swapped=swapped), tmp_path)
    assert (only(result).equal, result.result) == (10, "equal")


def test_a_message_logged_behind_the_command_that_knew_it(tmp_path: Path) -> None:
    r = Recorder()
    r.obstacles(7, 1, [(1, (0.6, -0.5, 0.5), 0.1)])
    r.tick(4)
    late = ("OBSTACLES", r.obstacles(8, 1, [(2, (0.4, -0.6, 0.5), 0.1)], logged=False))
    r.tick()
    r.log.append(late)
    r.obstacles(7, 2, [(1, (0.5, -0.5, 0.5), 0.1)])
    r.tick(5)
    result = verified(r.log, tmp_path)
    assert (only(result).equal, result.result) == (10, "equal")


def test_messages_that_the_controller_never_got(tmp_path: Path) -> None:
    r = Recorder()
    for seq in range(1, 30):  # before it listened
        r.obstacles(7, seq, [(1, (0.6, -0.5, 0.01 * seq), 0.1)], heard=False)
    r.tick(3)
    r.obstacles(7, 30, [(1, (0.6, -0.5, 0.4), 0.1)])
    r.tick(3)
    r.obstacles(8, 1, [(2, (0.4, -0.6, 0.5), 0.1)], heard=False)
    r.obstacles(7, 31, [(1, (0.6, -0.5, 0.5), 0.1)])
    r.tick(4)
    result = verified(r.log, tmp_path)
    assert (only(result).equal, result.result) == (10, "equal")


def test_a_message_that_the_log_lacks(tmp_path: Path) -> None:
    r = Recorder()
    r.obstacles(7, 1, [(1, (0.6, -0.5, 0.5), 0.1)])
    r.tick(4)
    r.obstacles(7, 2, [(1, (0.5, -0.5, 0.5), 0.1)], logged=False)
    r.tick(3)
    r.obstacles(7, 3, [(1, (0.4, -0.5, 0.5), 0.1)])
    r.tick(5)
    r.obstacles(7, 4, [(1, (0.3, -0.5, 0.5), 0.1)])
    r.tick(5)
    c = only(result := verified(r.log, tmp_path))
    assert (c.verified, c.equal, result.result) == (14, 14, "incomplete")
    assert list(c.unknown.items()) == [("OBSTACLES or HULL it had taken are not in the log", 3)]
    assert c.first_unknown == 5


def test_many_messages_before_the_first_tick(tmp_path: Path) -> None:
    r = Recorder()
    for seq in range(1, 40):
        r.obstacles(7, seq, [(seq % 5 + 1, (0.6, -0.5, 0.01 * seq), 0.1)], heard=seq > 20)
    r.tick(5)
    result = verified(r.log, tmp_path)
    assert (only(result).equal, result.result) == (5, "equal")


def test_a_message_that_the_log_lacks_before_one_that_it_has(tmp_path: Path) -> None:
    r = Recorder()
    r.obstacles(7, 1, [(1, (0.6, -0.5, 0.5), 0.1)])
    r.tick(4)
    r.obstacles(7, 2, [(2, (0.5, -0.5, 0.5), 0.1)], logged=False)
    r.obstacles(7, 3, [(1, (0.4, -0.5, 0.5), 0.1)])
    r.tick(3)
    r.obstacles(7, 4, [(2, (0.5, -0.5, 0.5), 0.1)])
    r.tick(3)
    c = only(result := verified(r.log, tmp_path))
    assert (c.equal, result.result) == (7, "incomplete")
    assert list(c.unknown.values()) == [3]


def test_a_log_that_begins_in_mid_run(tmp_path: Path) -> None:
    log = usual()
    begin = places(log, "JOINT_STATE")[10]
    announced = [one for one in log[:begin] if one[0] == "SCENE"]
    c = only(result := verified([*announced, *log[begin:]], tmp_path))
    # Both obstacles of the first message stay unknown, so the world does not become known again.
    assert result.result == "incomplete"
    assert c.verified == c.equal
    known = [one for one in log[:begin] if one[0] in ("SCENE", "OBSTACLES")]
    c = only(result := verified([*known, *log[begin:]], tmp_path))
    assert (c.equal, sum(c.unknown.values()), result.result) == (TICKS - 13, 1, "incomplete")


# --- damaged inputs ---


STATE_BYTES = range(8, len(usual()[places(usual(), "JOINT_STATE")[0]][1]))


@pytest.mark.parametrize("byte", STATE_BYTES)
def test_a_bit_of_a_joint_state(tmp_path: Path, byte: int) -> None:
    log = usual()
    place = places(log, "JOINT_STATE")[20]  # of tick 23
    c = only(result := verified(flip(log, place, byte, byte % 8), tmp_path))
    assert result.result == "differs"
    assert c.first is not None
    assert c.first.tick == 23
    assert c.differing == 1
    name = field_at("JOINT_STATE", byte)
    names = [change.name.partition("[")[0] for change in c.first.changed]
    assert f"JOINT_STATE {name}" in names or name == "h"
    assert names


def test_a_value_that_no_controller_takes(tmp_path: Path) -> None:
    log = usual()
    layout: Any = as_rows("JOINT_STATE", b"").dtype
    sign = 8 + layout.fields["period_ns"][1]
    c = only(verified(flip(log, places(log, "JOINT_STATE")[20], sign, 7), tmp_path))
    assert c.first is not None
    assert [change.name for change in c.first.changed] == ["JOINT_STATE period_ns"]
    # It is computed as if none had been heard, not from the state before.
    session = next(f for f in c.first.fields if f.name == "plant_session")
    assert session.replayed == 0


def test_a_joint_state_of_another_layout(tmp_path: Path) -> None:
    log = usual()
    place = places(log, "JOINT_STATE")[20]
    c = only(result := verified(flip(log, place, 0), tmp_path))  # another fingerprint
    assert (c.equal, result.result) == (TICKS - 1, "incomplete")
    assert c.unknown == {"its JOINT_STATE is not in the log": 1}
    assert c.first_unknown == 23


@pytest.mark.parametrize("byte", [0, 3, 7])
@pytest.mark.parametrize("axis", range(4))
def test_a_bit_of_an_obstacle(tmp_path: Path, byte: int, axis: int) -> None:
    log = usual()
    place = places(log, "OBSTACLES")[0]
    # after p come the four numbers of the quaternion, then the radius
    at = FIRST_P + 8 * (7 if axis == 3 else axis) + byte
    c = only(result := verified(flip(log, place, at), tmp_path))
    assert c.first is not None
    assert (c.first.tick, result.result) == (5, "differs")
    what = "radius" if axis == 3 else f"p[{axis}]"
    assert f"OBSTACLES id 1: {what}" in [change.name for change in c.first.changed]
    # The next message of its sender corrects it.
    assert c.differing == 12


def test_a_bit_of_a_repetition_that_changed_nothing(tmp_path: Path) -> None:
    r = Recorder()
    for seq in (1, 2, 3):
        r.obstacles(7, seq, [(1, (0.6, -0.5, 0.5), 0.1)])
        r.tick(4)
    c = only(result := verified(flip(r.log, places(r.log, "OBSTACLES")[1], FIRST_P + 11), tmp_path))
    assert c.first is not None
    assert (c.first.tick, c.differing, result.result) == (5, 4, "differs")
    assert "OBSTACLES id 1: p[1]" in [change.name for change in c.first.changed]


def test_a_bit_of_a_goal(tmp_path: Path) -> None:
    log = usual()
    c = only(result := verified(flip(log, places(log, "GOAL")[0], 8 + 32 + 8 + 3), tmp_path))
    assert c.first is not None
    assert (c.first.tick, result.result) == (25, "differs")
    assert [change.name for change in c.first.changed] == ["GOAL p[1]"]
    assert c.differing == 1  # each later tick is judged from the recorded one before


def test_a_goal_that_is_missing(tmp_path: Path) -> None:
    log = usual()
    c = only(result := verified(without(log, places(log, "GOAL")[0]), tmp_path))
    assert (c.equal, result.result) == (TICKS - 1, "incomplete")
    assert c.unknown == {"its GOAL or STOP is not in the log": 1}


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("rho_rep: 1.9", "rho_rep: 1.8"),
        ("-0.6, 0.5]", "-0.6, 0.6]"),
        ("rho_rep: 1.9", "rho_rep: 1.90"),  # the same value
        ("duration_s: 2", "duration_s: 3"),  # moves nothing
    ],
)
def test_another_scene(tmp_path: Path, old: str, new: str) -> None:
    log = usual()
    assert old in SCENE
    text, changed = (
        _native.read_scene(one, "scene", []).to_yaml() for one in (SCENE, SCENE.replace(old, new))
    )
    other = scene(CONTROLLER, yaml=SCENE.replace(old, new), build=_native.BUILD)
    log[0] = ("SCENE", other.encode())
    c = only(result := verified(log, tmp_path))
    if text == changed:
        assert result.result == "equal"
        return
    assert result.result == "differs"
    assert c.first is not None
    assert (c.first.tick, c.differing) == (1, TICKS)
    # A goal of the scene is in two values of the digest, its own and the scene's.
    explained = ["SCENE"] if "0.6" not in old else []
    assert [change.name for change in c.first.changed] == explained


def test_one_scene_message_that_says_something_else(tmp_path: Path) -> None:
    log = usual()
    other = log[0][1].replace(b"rho_rep: 1.9", b"rho_rep: 1.8")
    c = only(result := verified([("SCENE", other), log[0], log[0], *log[1:]], tmp_path))
    assert (c.damaged_scenes, c.equal, result.result) == (1, TICKS, "differs")


# --- damaged commands ---

COMMAND = usual()[places(usual(), "JOINT_COMMAND")[0]][1]
COMPARED = [k for a, b in spans(as_rows("JOINT_COMMAND", b"").dtype) for k in range(a, b)]


@pytest.mark.parametrize("byte", COMPARED)
def test_a_bit_of_a_command(tmp_path: Path, byte: int) -> None:
    log = usual()
    place = places(log, "JOINT_COMMAND")[22]
    c = only(result := verified(flip(log, place, byte, byte % 8), tmp_path))
    assert c.first is not None
    assert (c.first.tick, c.differing, result.result) == (23, 1, "differs")
    name = field_at("JOINT_COMMAND", byte)
    told = {f.name.partition("[")[0] for f in c.first.fields}
    assert name in told | {change.name for change in c.first.changed}


@pytest.mark.parametrize("bit", range(9))
def test_a_flag_of_a_command(tmp_path: Path, bit: int) -> None:
    log = usual()
    layout: Any = as_rows("JOINT_COMMAND", b"").dtype
    byte = 8 + layout.fields["flags"][1] + 3 - bit // 8
    c = only(verified(flip(log, places(log, "JOINT_COMMAND")[22], byte, bit % 8), tmp_path))
    assert c.first is not None
    assert (c.first.tick, c.differing, c.first.right_inputs) == (23, 1, True)
    assert [f.name for f in c.first.fields] == ["flags"]


@pytest.mark.parametrize("byte", range(len(COMMAND) - 32, len(COMMAND)))
def test_what_the_process_fills_in_is_free(tmp_path: Path, byte: int) -> None:
    log = usual()
    place = places(log, "JOINT_COMMAND")[22]
    assert verified(flip(log, place, byte), tmp_path).result == "equal"


def test_bits_that_print_alike(tmp_path: Path) -> None:
    log = usual()
    place = places(log, "JOINT_COMMAND")[0]  # at rest: 0.0
    layout: Any = as_rows("JOINT_COMMAND", b"").dtype
    c = only(verified(flip(log, place, 8 + layout.fields["qd"][1], 7), tmp_path))
    assert c.first is not None
    first = c.first.fields[0]
    assert (first.name, first.recorded, first.replayed) == ("qd[0]", 0.0, 0.0)
    assert (first.recorded_bits, first.replayed_bits) == ("0x" + "80" + 14 * "0", "0x" + 16 * "0")


# --- whole logs ---


def test_a_log_that_was_cut(tmp_path: Path) -> None:
    path = write(usual(), tmp_path / "run.lcm")
    path.write_bytes(path.read_bytes()[:-100])
    result = verify(read_tables(path))
    assert (only(result).equal, result.result) == (TICKS - 1, "incomplete")


def test_another_build_is_said(tmp_path: Path) -> None:
    log = usual()
    other = _native.BUILD.replace("leeway 0", "leeway 9").encode()
    log[0] = ("SCENE", log[0][1].replace(_native.BUILD.encode(), other))
    assert not only(verified(log, tmp_path)).same_build


# --- the digest ---


def test_the_digest_is_that_of_the_tick(tmp_path: Path) -> None:
    path = write(usual(), tmp_path / "run.lcm")
    replay = Replay(read_tables(path), CONTROLLER)
    count = 0
    for outcome in replay:
        assert outcome.inputs is not None
        state = replay.states.rows[outcome.inputs.state] if outcome.inputs.state >= 0 else None
        command = replay.commands.rows[outcome.row]
        world, warming_up = outcome.inputs.guess.world, outcome.inputs.warming_up
        words = input_words(replay.scene_digest, state, world, command, warming_up)
        assert digest(words) == int(command["input_digest"]) & (1 << 64) - 1
        count += 1
    assert count == TICKS


def test_nothing_is_explained_when_two_values_changed(tmp_path: Path) -> None:
    log = usual()
    place = places(log, "JOINT_STATE")[20]
    length = len(log[place][1])
    log = flip(flip(log, place, length - 20, 3), place, length - 70, 3)
    c = only(verified(log, tmp_path))
    assert c.first is not None
    assert (c.first.tick, c.first.changed) == (23, [])
    assert "JOINT_STATE" in c.first.suspects


def test_damage_in_the_framing_is_no_event(tmp_path: Path) -> None:
    path = tmp_path / "run.lcm"
    write(usual(), path)
    path.write_bytes(path.read_bytes() + b"\0" * 40 + event("JOINT_COMMAND", COMMAND))
    assert verify(read_tables(path)).truncated_bytes > 40
