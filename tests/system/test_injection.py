"""Commands that must not count: spoiled, old, meant for another plant, or from a competitor."""

import itertools
import math

import numpy as np
import pytest
from helpers import Listener, running
from leeway_lcm import leeway as wire
from rig import (
    SCENE,
    Commander,
    assert_order,
    assert_plants,
    assert_rest,
    moving_pair,
    recording,
    settled,
)

pytestmark = pytest.mark.usefixtures("private_network")
EACH = 50  # messages of each kind
BEHIND_STALE = ("FOREIGN", "BACKWARDS")  # reasons that the gate looks at after the age


def _with(**values):
    """Return what sets fields of a command; `h_` ones of its header."""

    def spoil(command, _):
        for name, value in values.items():
            target = command.h if name.startswith("h_") else command
            setattr(target, name.removeprefix("h_"), value)

    return spoil


def _speed(value):
    return _with(qd=[0.5, 0, value, 0, 0, 0])


def _echo(lag):
    """Return what makes a command the answer to a state some numbers back."""

    def spoil(command, _):
        command.state_seq -= lag

    return spoil


def _replay(command, state):
    """Pose as the owner, with a number that it used long ago."""
    command.h.session, command.h.seq = state.command_session, 1


# Kind -> how a competitor's command is spoiled, and the reason it must be refused for.
KINDS = {
    "good but for its sender": (_with(), "FOREIGN"),
    "stale echo": (_echo(1000), "STALE"),
    "echo of a state to come": (_echo(-1000), "STALE"),
    "NaN": (_speed(math.nan), "NO_NUMBER"),
    "infinite": (_speed(math.inf), "NO_NUMBER"),
    "minus infinite": (_speed(-math.inf), "NO_NUMBER"),
    "huge": (_speed(1e9), "RANGE"),
    "over the plant's limit": (_speed(-3.2), "RANGE"),
    "another plant": (_with(plant_session=12345), "OTHER_PLANT"),
    "no plant": (_with(plant_session=0), "OTHER_PLANT"),
    "replayed number of the owner": (_replay, "BACKWARDS"),
    "no motion asked": (_with(mode=wire.joint_command_t.IDLE), "IDLE"),
    "unknown mode": (_with(mode=7), "RANGE"),
    "no session": (_with(h_session=0), "RANGE"),
    "negative number": (_with(h_seq=-1), "RANGE"),
}


@pytest.mark.parametrize("transport", ["--transport=own", "--transport=lcm"])
def test_a_competitor_is_refused_for_the_right_reason(root, transport):
    with moving_pair(root / SCENE, transport) as pair:
        listener, competitor, owner = pair.listener, Commander(), pair.state.command_session
        for kind, (spoil, reason) in KINDS.items():
            _assert_refused(listener, competitor, kind, spoil, reason)
        status = listener.wait_for("PLANT_STATUS", lambda _: True)
    assert status.peer_session == owner
    assert status.takeovers == 0
    (states,) = assert_plants(pair.record).values()
    assert assert_order(states) == [owner]


def _assert_refused(listener, competitor, kind, spoil, reason):
    before = np.array(settled(listener, "PLANT_STATUS").refused)
    for _ in range(EACH):
        state = competitor.next_state()
        command = competitor.answer(state)
        spoil(command, state)
        competitor.bus.publish("JOINT_COMMAND", command.encode())
    after = np.array(settled(listener, "PLANT_STATUS").refused)
    counted = {n: int(c) for n, c in enumerate(after - before) if c}
    # On a busy machine the odd command is too old before anything else is wrong with it.
    stale = counted.pop(wire.status_t.STALE, 0) if reason in BEHIND_STALE else 0
    assert counted == {getattr(wire.status_t, reason): EACH - stale}, kind
    assert stale < EACH / 2, kind


def test_what_is_no_joint_command(root):
    with moving_pair(root / SCENE) as pair:
        listener, competitor = Listener(channels=["PLANT_STATUS"]), Commander()
        whole = competitor.answer(competitor.next_state()).encode()
        for data, reason in (
            (whole[:-1], "SIZE"),
            (whole + b"\0", "SIZE"),
            (b"", "SIZE"),
            (bytes(8) + whole[8:], "TYPE"),
        ):
            before = np.array(settled(listener, "PLANT_STATUS").refused)
            for _ in range(EACH):
                competitor.next_state()
                competitor.bus.publish("JOINT_COMMAND", data)
            after = settled(listener, "PLANT_STATUS")
            assert (np.array(after.refused) - before)[getattr(after, reason)] == EACH
            assert after.faults & after.BAD_INPUT
    (states,) = assert_plants(pair.record).values()
    assert assert_order(states) == [pair.state.command_session]


def test_bad_commands_of_the_owner_are_skipped(root):
    bad = itertools.cycle([math.nan, 1e9, math.inf, 3.2, -math.inf])
    sent = {"NO_NUMBER": 0, "RANGE": 0, "good": 0}

    def spoil(command):
        if command.h.seq % 3:
            sent["good"] += 1
            return
        command.qd[2] = next(bad)
        sent["RANGE" if math.isfinite(command.qd[2]) else "NO_NUMBER"] += 1

    with recording() as record, running("leeway-simulator", root / SCENE):
        commander, listener = Commander(), Listener()
        commander.run(until=lambda s: s.tick > 500, spoil=spoil)
        status = settled(listener, "PLANT_STATUS")
    assert sent["NO_NUMBER"] > 50
    assert status.refused[status.NO_NUMBER] == sent["NO_NUMBER"]
    assert status.refused[status.RANGE] == sent["RANGE"]
    assert status.taken + status.refused[status.GUARD] == sent["good"]
    assert status.taken > 300
    (states,) = assert_plants(record).values()
    assert_rest(states)
    obeyed = [s for s in states if 100 < s.tick <= 500]
    assert np.mean([s.plant_mode == s.MOVING for s in obeyed]) > 0.9
    assert obeyed[-1].q[0] - obeyed[0].q[0] > 0.3
    assert all(s.q[2] == states[0].q[2] for s in states)


def test_joint_states_that_are_no_numbers(root):
    with moving_pair(root / SCENE) as pair:
        poser = Commander()
        posed = poser.next_state()
        posed.q = [math.nan, *posed.q[1:]]
        for _ in range(EACH):
            poser.next_state()
            posed.h.seq += 1000
            poser.bus.publish("JOINT_STATE", posed.encode())
        status = settled(pair.listener, "STATUS")
    assert status.refused[status.NO_NUMBER] == EACH
    assert status.peer_session == pair.state.h.session
    assert status.faults & status.BAD_INPUT
    assert np.isfinite([c.qd for c in pair.record.read("JOINT_COMMAND")]).all()
