"""What the tests of faults share: relay, recorder, a commander by hand, and what must hold."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import json
import math
import select
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import lcm
import numpy as np
from helpers import TYPES, Listener, running
from leeway_lcm import leeway as wire
from relay import Bus, Faults, split

from leeway.bus import header, new_session, resolve_url

SCENE = "scenarios/reach.yaml"  # 500 Hz, all limits on, moves for 7 s
TIMEOUT_S, ACCELERATION, VELOCITY, POSITION = 0.02, 8.0, math.pi, 2 * math.pi
PERIOD_S = 0.002
GROUP, PLANT_PORT, CONTROLLER_PORT = "239.255.76.67", 7667, 7668
TINY = 1 + 1e-9
FRESH_NS = 10_000_000


def url_of(port: int) -> str:
    """URL of the bus on a port."""
    return resolve_url(None).replace(f":{PLANT_PORT}", f":{port}")


# --- processes ---


class RelayProcess:
    """The relay as a process of the test."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self._expect_ok()

    def _expect_ok(self) -> None:
        assert self.process.stdout is not None
        assert self.process.stdout.readline() == "ok\n", "the relay did not answer"

    def suffer(self, faults: Faults) -> None:
        """Treat packets so from now on."""
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(dataclasses.asdict(faults)) + "\n")
        self.process.stdin.flush()
        self._expect_ok()

    def account(self) -> dict[str, Any]:
        """End it and return what it did."""
        said = self.process.communicate(timeout=10)[0]
        assert self.process.returncode == 0
        return json.loads(said)


@contextlib.contextmanager
def relaying(seed: int) -> Iterator[RelayProcess]:
    """Run a relay between the plant's bus and the controller's."""
    script = Path(__file__).with_name("relay.py")
    command = [sys.executable, script, seed, GROUP, PLANT_PORT, CONTROLLER_PORT]
    process = subprocess.Popen(
        [str(word) for word in command], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    try:
        yield RelayProcess(process)
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


class Record:
    """All that was on a bus, in order: raw as it comes, decoded when asked."""

    def __init__(self, port: int) -> None:
        self._bus = Bus(GROUP, port)
        self._datagrams: list[bytes] = []
        self._ended = False
        self._thread = threading.Thread(target=self._record)
        self._thread.start()

    def _record(self) -> None:
        while not self._ended:
            select.select([self._bus.socket], [], [], 0.05)
            while (datagram := self._bus.receive()) is not None:
                self._datagrams.append(datagram)

    def end(self) -> None:
        """Stop recording."""
        self._ended = True
        self._thread.join()
        self._bus.socket.close()

    def packets(self) -> list[tuple[str, bytes]]:
        """Return channel and payload of all that came so far."""
        found = [split(datagram) for datagram in list(self._datagrams)]
        return [packet for packet in found if packet is not None]

    def read(self, channel: str) -> list[Any]:
        """Return all messages of a channel."""
        return [TYPES[channel].decode(data) for name, data in self.packets() if name == channel]


@contextlib.contextmanager
def recording(port: int = PLANT_PORT) -> Iterator[Record]:
    """Record a bus; with a deep buffer, so that a busy machine loses nothing."""
    record = Record(port)
    try:
        yield record
    finally:
        record.end()


@dataclasses.dataclass
class Pair:
    """Simulator and controller on one bus, recorded and moving."""

    simulator: subprocess.Popen[str]
    controller: subprocess.Popen[str]
    record: Record
    listener: Listener
    state: Any  # the first joint state that shows the motion


@contextlib.contextmanager
def moving_pair(scene: Path, *options: object) -> Iterator[Pair]:
    """Run simulator and controller, from their motion on; the record is whole after the block."""
    with (
        recording() as record,
        running("leeway-simulator", scene, *options) as simulator,
        running("leeway-controller", scene, *options) as controller,
    ):
        listener = Listener()
        state = listener.wait_for("JOINT_STATE", moving)
        yield Pair(simulator, controller, record, listener, state)


# --- messages awaited ---


def moving(state: Any) -> bool:
    """Whether the plant obeys and moves."""
    return state.plant_mode == state.MOVING and max(map(abs, state.qd)) > 0.1


def resting(state: Any) -> bool:
    """Whether the plant is at rest because commands ceased."""
    return state.plant_mode == state.STOPPING and not any(state.qd)


def obeyed(status: Any) -> bool:
    """Whether the sender of a status goes on as it should."""
    return status.state == status.RUNNING


def of(session: int, condition: Callable[[Any], bool] = lambda _: True) -> Callable[[Any], bool]:
    """Return a condition that only messages of one sender can meet."""
    return lambda message: message.h.session == session and condition(message)


def commanded_by(session: int) -> Callable[[Any], bool]:
    """Return the condition that the plant moves by one controller's commands."""
    return lambda state: state.command_session == session and moving(state)


def next_of(
    listener: Listener, channel: str, condition: Callable[[Any], bool] = lambda _: True
) -> Any:
    """Return the first message that was sent after this call and meets a condition."""
    start = time.monotonic_ns()
    return listener.wait_for(channel, lambda m: m.h.mono_ns > start and condition(m))


def settled(listener: Listener, channel: str, session: int | None = None) -> Any:
    """Return a status that repeats the losses of the one before: none is under way any more."""

    def counts(status: Any) -> tuple[int, ...]:
        return (status.missed, *status.refused)

    def next_status() -> Any:
        return next_of(listener, channel, lambda s: session in (None, s.h.session))

    before, status = next_status(), next_status()
    end = time.monotonic() + 5
    while counts(status) != counts(before):
        assert time.monotonic() < end, f"counts of {channel} do not settle"
        before, status = status, next_status()
    return status


# --- a commander by hand ---


class Commander:
    """A controller by hand: answers joint states with commands that a test has shaped."""

    def __init__(self, qd: Iterable[float] = (0.5, 0, 0, 0, 0, 0)) -> None:
        self.bus = lcm.LCM(resolve_url(None))
        self.session, self.seq = new_session(), 0
        self.qd = list(qd)
        self.state: Any = None
        self.bus.subscribe("JOINT_STATE", self._on_state)

    def _on_state(self, _: str, data: bytes) -> None:
        self.state = wire.joint_state_t.decode(data)

    def next_state(self, seconds: float = 2) -> Any:
        """Return the next joint state, none that has waited in the queue for long."""
        self.state, end = None, time.monotonic() + seconds
        while self.state is None or self.state.h.mono_ns < time.monotonic_ns() - FRESH_NS:
            assert time.monotonic() < end, "no joint state"
            self.bus.handle_timeout(50)
        return self.state

    def answer(self, state: Any) -> Any:
        """Return a good command, the next of this session."""
        self.seq += 1
        command = wire.joint_command_t()
        command.h = header(self.session, self.seq)
        command.plant_session, command.state_seq = state.h.session, state.h.seq
        command.state_tick, command.state_mono_ns = state.tick, state.h.mono_ns
        command.mode, command.qd = command.VELOCITY, list(self.qd)
        return command

    def run(
        self, until: Callable[[Any], bool], spoil: Callable[[Any], None] | None = None
    ) -> list[Any]:
        """Answer every state until one meets a condition; return the states answered."""
        states = []
        end = time.monotonic() + 10
        while not states or not until(states[-1]):
            assert time.monotonic() < end, "the plant does not get there"
            states.append(self.next_state())
            command = self.answer(states[-1])
            if spoil is not None:
                spoil(command)
            self.bus.publish("JOINT_COMMAND", command.encode())
        return states


# --- what the plant's own record must show ---


def plants_of(record: Record) -> dict[int, list[Any]]:
    """Session -> joint states of each plant, in order."""
    plants: dict[int, list[Any]] = {}
    for state in record.read("JOINT_STATE"):
        plants.setdefault(state.h.session, []).append(state)
    return plants


def assert_whole(states: list[Any]) -> None:
    """The recorder heard every state."""
    seqs = np.array([s.h.seq for s in states])
    gaps = [(int(a), int(b)) for a, b in itertools.pairwise(seqs) if b != a + 1]
    assert not gaps, f"the recorder missed states between {gaps} of {seqs[-1]}"


def assert_limits(states: list[Any]) -> None:
    """Finite, within every limit, and no step of velocity in any period."""
    q, qd = np.array([s.q for s in states]), np.array([s.qd for s in states])
    assert np.isfinite(q).all()
    assert np.isfinite(qd).all()
    assert np.abs(q).max() <= POSITION
    assert np.abs(qd).max() <= VELOCITY * TINY
    consecutive = np.diff([s.h.seq for s in states]) == 1
    assert consecutive.sum() > 20
    step = np.abs(np.diff(qd, axis=0)[consecutive]).max()
    assert step <= ACCELERATION * PERIOD_S * TINY, f"velocity step of {step:g} rad/s"
    jump = np.abs(np.diff(q, axis=0) - PERIOD_S * qd[1:])[consecutive].max()
    assert jump <= 1e-12, f"position jump of {jump:g} rad"


def assert_order(states: list[Any]) -> list[int]:
    """No command counts twice or backwards, no controller returns; list the controllers obeyed."""
    sessions: list[int] = []
    seq = 0
    for state in states:
        session = state.command_session
        if session not in (0, *sessions[-1:]):
            assert session not in sessions, "a controller was obeyed again after another one"
            sessions.append(session)
            seq = 0
        assert state.command_seq >= seq, "a command was obeyed backwards"
        seq = state.command_seq
    return sessions


def assert_rest(states: list[Any]) -> None:
    """At rest within timeout + v / a + one period of the last command before each stop.

    Counted in the plant's own periods, which a late wake-up of this machine does not stretch.
    """
    stops = [
        i
        for i, (before, state) in enumerate(itertools.pairwise(states), start=1)
        if (before.plant_mode, state.plant_mode) == (state.MOVING, state.STOPPING)
    ]
    assert stops, "the plant never stopped"
    for stop in stops:
        last = states[stop].command_seq
        accepted = next(i for i in range(stop, -1, -1) if states[i].command_seq != last) + 1
        speed = max(map(abs, states[stop - 1].qd))
        # A command is accepted up to one period before the state that first tells.
        periods = math.ceil((TIMEOUT_S + speed / ACCELERATION) / PERIOD_S - 1e-6)
        ramp = states[stop : accepted + periods + 1]
        if all(s.plant_mode == s.STOPPING for s in ramp):
            assert ramp[-1].h.seq == states[accepted].h.seq + periods, "the record ends too soon"
            assert not any(ramp[-1].qd), f"still moving {periods} periods after the last command"


def assert_smooth_takeover(record: Record, states: list[Any], session: int) -> None:
    """A controller's first obeyed command leaves from the velocity that the plant had."""
    first = next(s for s in states if s.command_session == session)
    by_number = {(c.h.session, c.h.seq): c for c in record.read("JOINT_COMMAND")}
    command = by_number[session, first.command_seq]
    assert command.plant_session == first.h.session
    known = next(s for s in states if s.h.seq == command.state_seq)
    step = np.abs(np.subtract(command.qd, known.qd)).max()
    assert step <= ACCELERATION * PERIOD_S * TINY, f"takeover with a step of {step:g} rad/s"


def assert_plants(record: Record) -> dict[int, list[Any]]:
    """Assert everything that holds for every plant, whatever befell it; session -> joint states."""
    plants = plants_of(record)
    for states in plants.values():
        assert_whole(states)
        assert_limits(states)
        assert_order(states)
    return plants
