"""Processes that die, freeze, come twice or lose their network: the arm rests and picks up."""

import contextlib
import signal
import subprocess
import time

import pytest
from helpers import Listener, kill, read, running, wait_until
from leeway_lcm import leeway as wire
from rig import (
    SCENE,
    Commander,
    assert_limits,
    assert_order,
    assert_plants,
    assert_rest,
    assert_smooth_takeover,
    commanded_by,
    moving,
    moving_pair,
    next_of,
    obeyed,
    of,
    plants_of,
    recording,
    resting,
    settled,
)

from leeway.processes import program

pytestmark = pytest.mark.usefixtures("private_network")
STATUSES = ("PLANT_STATUS", "STATUS")
FROZEN_S = 0.3
either_transport = pytest.mark.parametrize("transport", ["--transport=own", "--transport=lcm"])


@contextlib.contextmanager
def frozen(process):
    """Hold a process for FROZEN_S."""
    kill(process.pid, signal.SIGSTOP)
    try:
        yield
        time.sleep(FROZEN_S)
    finally:
        kill(process.pid, signal.SIGCONT)


# --- one side dies ---


@pytest.mark.parametrize("pause_s", [0.4, 0])
def test_a_killed_controller_is_replaced(root, pause_s):
    scene = root / SCENE
    with recording() as record, running("leeway-simulator", scene):
        listener = Listener()
        with running("leeway-controller", scene) as victim:
            old = listener.wait_for("JOINT_STATE", moving).command_session
            kill(victim.pid)
            killed = time.monotonic_ns()
        if pause_s:
            listener.wait_for(
                "JOINT_STATE", lambda s: resting(s) and s.h.mono_ns > killed + pause_s * 1e9
            )
        with running("leeway-controller", scene):
            new = listener.wait_for(
                "JOINT_STATE", lambda s: s.command_session != old and moving(s)
            ).command_session
            status = listener.wait_for("PLANT_STATUS", lambda s: s.peer_session == new)
    assert status.takeovers == 1
    assert status.faults_ever & status.PEER_TIMEOUT
    # The new one warms up first and says so.
    assert status.refused[status.IDLE] > 100
    (states,) = assert_plants(record).values()
    assert assert_order(states) == [old, new]
    assert_rest(states)
    assert_smooth_takeover(record, states, new)


def test_a_lease_runs_out_before_the_next_commander_is_obeyed(root):
    first, second, listener = Commander(), Commander(), Listener()
    with recording() as record, running("leeway-simulator", root / SCENE):
        first.run(until=lambda s: moving(s) and s.tick > 100)
        second.run(until=commanded_by(second.session))
        status = next_of(listener, "PLANT_STATUS")
    assert status.takeovers == 1
    assert status.refused[status.GUARD] > 0
    # 100 ms at 500 Hz, less what a busy machine keeps from answering.
    assert 10 < status.refused[status.FOREIGN] <= 51
    assert status.faults_ever & status.LEASE
    (states,) = assert_plants(record).values()
    assert assert_order(states) == [first.session, second.session]
    # It answered from the first state on, and was not obeyed for a quarter of a second.
    moved = next(s for s in states if s.plant_mode == s.MOVING)
    assert states[0].h.seq == 1
    assert moved.h.mono_ns - states[0].h.mono_ns > 0.24e9
    assert_rest(states)
    taken = next(s.h.mono_ns for s in states if s.command_session == second.session)
    began = min(s.h.mono_ns for s in states if s.command_seq == first.seq)
    # Both states came up to a period after the command that they tell of.
    assert taken - began > 0.095e9


def test_a_restarted_plant_obeys_only_what_was_meant_for_it(root):
    scene = root / SCENE
    with recording() as record, running("leeway-controller", scene):
        listener = Listener()
        with running("leeway-simulator", scene) as victim:
            old = listener.wait_for("JOINT_STATE", moving).h.session
            kill(victim.pid)
        with running("leeway-simulator", scene):
            state = listener.wait_for("JOINT_STATE", lambda s: s.h.session != old and moving(s))
            new = state.h.session
            plant_status = listener.wait_for("PLANT_STATUS", of(new, lambda s: s.taken > 0))
            status = next_of(listener, "STATUS", lambda s: s.peer_session == new)
    refused = plant_status.refused
    assert refused[plant_status.GUARD] + refused[plant_status.OTHER_PLANT] > 0
    assert plant_status.takeovers == 0
    assert status.takeovers == 1
    assert status.faults_ever & status.PEER_TIMEOUT
    plants = assert_plants(record)
    assert list(plants) == [old, new]
    assert_smooth_takeover(record, plants[new], state.command_session)
    # No command counts that does not echo this plant.
    commands = {c.h.seq: c for c in record.read("JOINT_COMMAND")}
    obeyed = {s.command_seq for s in plants[new] if s.command_seq}
    assert len(obeyed) > 10
    assert all(commands[seq].plant_session == new for seq in obeyed)
    assert any(c.plant_session == old for c in record.read("JOINT_COMMAND"))


# --- one side freezes ---


@either_transport
def test_a_frozen_controller_is_not_obeyed_for_what_it_says_late(root, transport):
    with moving_pair(root / SCENE, transport) as pair:
        listener = pair.listener
        with frozen(pair.controller):
            listener.wait_for("JOINT_STATE", resting)
        next_of(listener, "JOINT_STATE", moving)
        status = next_of(listener, "PLANT_STATUS")
    assert status.refused[status.STALE] > 0
    assert status.faults & status.PEER_TIMEOUT
    assert status.takeovers == 0
    (states,) = assert_plants(pair.record).values()
    assert assert_order(states) == [pair.state.command_session]
    assert_rest(states)


@either_transport
def test_a_frozen_plant_goes_on_without_a_step(root, transport):
    with moving_pair(root / SCENE, transport) as pair:
        listener = pair.listener
        with frozen(pair.simulator):
            held = next_of(listener, "STATUS", lambda s: s.faults & s.PEER_TIMEOUT)
        next_of(listener, "JOINT_STATE", moving)
        plant_status, status = (next_of(listener, name, obeyed) for name in STATUSES)
    assert held.state == held.STOPPING
    assert status.takeovers == plant_status.takeovers == 0
    assert plant_status.skipped >= 0.9 * FROZEN_S / 0.002
    assert plant_status.faults & plant_status.OVERRUN
    (states,) = assert_plants(pair.record).values()
    assert assert_order(states) == [pair.state.command_session]


# --- two of a kind ---


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGTERM], ids=["killed", "ended"])
def test_of_two_controllers_one_is_obeyed(root, end):
    scene = root / SCENE
    with moving_pair(scene) as pair:
        listener, first = pair.listener, pair.state.command_session
        with running("leeway-controller", scene, "--set=request.goal=[0.2,-0.5,0.5]"):
            told = listener.wait_for(
                "JOINT_COMMAND", lambda c: c.flags & c.FOREIGN and c.mode == c.VELOCITY
            )
            second = told.h.session
            told_status = listener.wait_for("STATUS", of(second, lambda s: s.faults & s.LEASE))
            plant_status = listener.wait_for(
                "PLANT_STATUS", lambda s: s.refused[s.FOREIGN] > 100 and s.faults & s.LEASE
            )
            obeyed_status = next_of(listener, "STATUS", of(first))
            pair.controller.send_signal(end)
            listener.wait_for("JOINT_STATE", commanded_by(second))
            after = next_of(listener, "PLANT_STATUS")
    assert told_status.state == told_status.STOPPING
    assert plant_status.peer_session == first
    assert plant_status.takeovers == 0
    assert not obeyed_status.faults_ever & obeyed_status.LEASE
    assert obeyed_status.state == obeyed_status.RUNNING
    assert after.takeovers == 1
    (states,) = assert_plants(pair.record).values()
    assert assert_order(states) == [first, second]
    assert_smooth_takeover(pair.record, states, second)


def test_of_two_plants_one_is_heard(root):
    scene = root / SCENE
    with moving_pair(scene) as pair:
        listener, first = pair.listener, pair.state.h.session
        with running("leeway-simulator", scene):
            other = listener.wait_for("JOINT_STATE", lambda s: s.h.session != first).h.session
            status = listener.wait_for("STATUS", lambda s: s.refused[s.FOREIGN] > 200)
            ignored = next_of(listener, "PLANT_STATUS", of(other))
            kill(pair.simulator.pid)
            killed = time.monotonic_ns()
            listener.wait_for("JOINT_STATE", of(other, moving))
            after = next_of(listener, "STATUS")
    assert status.peer_session == first
    assert status.takeovers == 0
    assert ignored.taken == 0
    assert ignored.state in (ignored.STARTING, ignored.WAITING)
    assert ignored.refused[ignored.OTHER_PLANT] + ignored.refused[ignored.GUARD] > 100
    assert after.peer_session == other
    assert after.takeovers == 1
    plants = assert_plants(pair.record)
    assert set(plants) == {first, other}
    assert_smooth_takeover(pair.record, plants[other], plants[other][-1].command_session)
    commands = [c for c in pair.record.read("JOINT_COMMAND") if c.mode == c.VELOCITY]
    assert {c.plant_session for c in commands if c.h.mono_ns < killed} == {first}


# --- the network goes ---


def _lo(*commands):
    for command in commands:
        subprocess.run(["ip", *command.split()], check=True)


@either_transport
def test_a_network_that_goes_and_comes_again(root, transport):
    with moving_pair(root / SCENE, transport) as pair:
        _lo("link set lo down")
        time.sleep(FROZEN_S)
        _lo("link set lo up", "route add 224.0.0.0/4 dev lo")
        next_of(pair.listener, "JOINT_STATE", moving)
        statuses = [next_of(pair.listener, name, obeyed) for name in STATUSES]
    for status in statuses:
        assert status.unsent >= 0.8 * FROZEN_S / 0.002
        assert status.faults & status.UNSENT
        assert status.faults & status.PEER_TIMEOUT
        assert status.takeovers == 0
    (states,) = plants_of(pair.record).values()
    lost = max(range(1, len(states)), key=lambda i: states[i].h.seq - states[i - 1].h.seq)
    assert states[lost].h.seq - states[lost - 1].h.seq > 100
    # It came to rest unheard.
    assert resting(states[lost])
    assert_limits(states)
    assert len(assert_order(states)) == 1


# --- an old recording is played ---


def _play(log, listener, reason):
    """Play the commands of a log on the bus; return how many are refused so, and the status."""
    command = [program("lcm-logplayer"), "--regexp=JOINT_COMMAND", "--speed=4", log]
    before = next_of(listener, "PLANT_STATUS")
    subprocess.run([str(word) for word in command], check=True, timeout=20, capture_output=True)
    after = settled(listener, "PLANT_STATUS")
    return after.refused[reason] - before.refused[reason], after


def test_played_commands_are_refused(root, tmp_path):
    scene, log = root / SCENE, tmp_path / "run.lcm"
    with recording() as record, running("leeway-controller", scene):
        listener = Listener()
        with running("leeway-simulator", scene) as victim:
            with running("lcm-logger", "-q", log):
                wait_until(log.exists, 5, "log")
                owner = listener.wait_for("JOINT_STATE", lambda s: moving(s) and s.tick > 200)
            stale, again = _play(log, listener, wire.status_t.STALE)
            kill(victim.pid)
        with running("leeway-simulator", scene):
            listener.wait_for("JOINT_STATE", lambda s: s.h.session != owner.h.session and moving(s))
            to_other, other = _play(log, listener, wire.status_t.OTHER_PLANT)
    # A burst of the player may overflow a queue.
    played = sum(c.mode == c.VELOCITY for c in read(log, "JOINT_COMMAND"))
    assert played > 50
    assert stale > 0.8 * played
    assert to_other > 0.8 * played
    for status in (again, other):
        assert status.takeovers == 0
        assert status.peer_session == owner.command_session
    for states in assert_plants(record).values():
        assert assert_order(states) == [owner.command_session]
