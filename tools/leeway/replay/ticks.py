"""Every tick of a controller in a log, computed again from its recorded inputs.

A command echoes what it was computed from, and a digest of every input. The messages are looked
up by the echoes; where the digest is not met, the other messages that could have been meant are
tried, so that a damaged echo and a damaged input are told apart.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from leeway import _native
from leeway.logs.log import Ints, LogError, SceneMessage, Table, Tables, as_rows
from leeway.replay.worlds import Echo, Guess, WorldLine

STOPPED, WARMING_UP = 8, 256
NOT_HEARD, MISSING = -1, -2  # instead of a row of JOINT_STATE
CHUNK = 8192  # ticks whose echoes are unpacked at a time
FILLED_BY_PROCESS = ("h", "compute_ns", "wake_late_ns", "previous_exec_ns", "skipped")


# What a tick says of its own memory; without hulls and roll-outs nothing else depends on it.
MEMORY = ("law_outcome", "stuck_since_ns", "circulation")
MEMORY_NS = 900_000_000  # stuck is judged over 0.8 s
WARM_TICKS = 256  # LW_WARM_TICKS: distances of hulls begin anew


class Verdict(Enum):
    """What came of a tick."""

    EQUAL = "equal"
    SENT_AGAIN = "sent again"  # the command before, once more
    DIFFERS = "differs"
    UNKNOWN = "unknown"  # an input is missing in the log


class Request(NamedTuple):
    """A GOAL or STOP that a tick obeyed; no message is the end of the process."""

    stop: bool
    message: bytes | None


class Inputs(NamedTuple):
    """What a tick was given."""

    time_ns: int
    state_age_ns: int
    warming_up: bool
    state: int  # row of JOINT_STATE, or NOT_HEARD
    request: Request | None  # taken in this tick
    guess: Guess


class Outcome(NamedTuple):
    """One command of the log and what came of its tick."""

    row: int  # of JOINT_COMMAND
    verdict: Verdict
    reason: str  # of UNKNOWN
    inputs: Inputs | None  # None when it could not be computed
    replayed: bytes  # the command computed here, b"" when it could not be
    right_inputs: bool  # they have the recorded digest
    lost: int = 0  # ticks before it whose commands the log lacks


class _Echoes(NamedTuple):
    """What a command says about itself, as plain numbers."""

    row: int
    order: int
    seq: int
    tick: int
    tick_ns: int
    state_age_ns: int
    flags: int
    digest: int
    state: int
    state_mono_ns: int
    request: tuple[bool, int, int]  # whether a stop, session, seq: each channel has its own seq
    world: Echo


def spans(layout: np.dtype[Any]) -> list[tuple[int, int]]:
    """Return the parts of a command's bytes that are compared, fingerprint counted in."""
    out: list[tuple[int, int]] = []
    for name in layout.names or ():
        if name in FILLED_BY_PROCESS:
            continue
        offset, size = _field(layout, name)
        start, end = offset + 8, offset + 8 + size
        if out and out[-1][1] == start:
            start = out.pop()[0]
        out.append((start, end))
    return out


def _field(layout: np.dtype[Any], name: str) -> tuple[int, int]:
    """Return where a field begins and its size, bytes."""
    fields: Any = layout.fields
    return fields[name][1], fields[name][0].itemsize


@dataclass(frozen=True)
class Configuration:
    """What a controller ran, from the SCENE messages of a log."""

    scene: SceneMessage
    own: bool  # said by the controller itself
    others: int  # SCENE messages of the same program that say something else


def configuration(log: Tables, session: int) -> Configuration:
    """Return what a controller ran; the simulator of the same run knows it too.

    Raises
    ------
    LogError
        No SCENE in the log.
    """
    own = [m for m in log.scenes if m.session == session]
    found = own or log.scenes
    if not found:
        raise LogError(
            f"{log.path}: no SCENE in it, so the controller's configuration is unknown: keep "
            "lcm-logger running for a second or more while controller and simulator run"
        )
    if not own:
        return Configuration(found[0], own=False, others=0)
    texts = [(m.yaml, m.build, m.mode) for m in own]
    usual = max(texts, key=texts.count)
    return Configuration(own[texts.index(usual)], True, len(texts) - texts.count(usual))


class Replay:
    """The ticks of one controller session, in the order of the log."""

    def __init__(self, log: Tables, session: int) -> None:
        self.log = log
        self.session = session
        self.configuration = configuration(log, session)
        self.scene = read_scene(log, self.configuration.scene)
        self.states, self.commands = log.tables["JOINT_STATE"], log.tables["JOINT_COMMAND"]
        self.rows = np.flatnonzero(self.commands.rows["h"]["session"] == session)
        self.line = WorldLine(log.tables["OBSTACLES"], log.tables["HULL"])
        self._controller = _native.Controller(self.scene, session)
        self.scene_digest = self._controller.scene_digest
        self._spans = spans(self.commands.rows.dtype)
        self._state_rows = _find_states(self.states, self.commands, self.rows)
        self._requests = _requests(log)
        self._last = b""  # command computed last
        self._last_seq = 0
        self._last_ns = 0  # its tick_ns
        self._resumed: _Echoes | None = None  # where it went on without a memory of its own

    def __iter__(self) -> Iterator[Outcome]:
        for start in range(0, len(self.rows), CHUNK):
            for echoes in self._unpack(slice(start, start + CHUNK)):
                yield self._step(echoes)
                self._last_seq, self._last_ns = echoes.seq, echoes.tick_ns

    def same(self, row: int, command: bytes) -> bool:
        """Whether a command equals a recorded one in all that the tick fills in."""
        recorded = self.commands.message(row)
        return all(recorded[a:b] == command[a:b] for a, b in self._spans)

    def feed(self, controller: _native.Controller, inputs: Inputs) -> bytes:
        """Give a controller the inputs of a tick and return its command."""
        request = inputs.request
        state = None if inputs.state == NOT_HEARD else self.states.message(inputs.state)
        if not controller.joint_state(state):
            controller.joint_state(None)  # damaged: no controller takes it
        if request is not None and request.message is not None:
            controller.request(request.message, request.stop)
        elif request is not None:
            controller.shutdown()
        world = inputs.guess.world
        return controller.tick(inputs.time_ns, inputs.state_age_ns, inputs.warming_up, world)

    def adopt(self, controller: _native.Controller, row: int) -> None:
        """Make a controller go on from a recorded command."""
        c = self.commands.rows[row]
        plant = (int(c["plant_session"]), int(c["state_seq"]))
        controller.adopt(int(c["tick"]), *plant, c["qd"].tolist())
        request = (int(c["request_session"]), int(c["request_seq"]))
        controller.adopt_request(*request, bool(c["flags"] & STOPPED), c["goal"].tolist())
        controller.adopt_memory(int(c["stuck_since_ns"]), c["circulation"].tolist())

    # --- one command ---

    def _step(self, e: _Echoes) -> Outcome:
        expected = self._controller.ticks + 1
        follows = self._last_seq > 0 and e.seq == self._last_seq + 1
        if self._last and e.tick == expected - 1 and self.same(e.row, self._last):
            return Outcome(e.row, Verdict.SENT_AGAIN, "", None, self._last, True)
        if self._last and e.tick == expected - 1 and e.tick_ns == self._last_ns:
            # In lockstep a tick is done once more when obstacles of its moment come late.
            self._controller.undo()
            return self._compute(e)
        first = self._last_seq == 0 and (e.tick == 1 or e.seq == 1)
        if not (first or follows or e.tick == expected):
            return self._resume(e)
        return self._compute(e)

    def _resume(self, e: _Echoes) -> Outcome:
        """Go on behind commands that the log lacks."""
        begin = self._last_seq == 0
        if begin:
            self.line.begin_late(e.order)
        reason = "the command before is not in the log"
        lost = 0 if begin else max(0, e.tick - self._controller.ticks - 1)
        outcome = self._compute(e)
        self._adopt(e.row)
        self._resumed = e
        return outcome._replace(verdict=Verdict.UNKNOWN, reason=reason, lost=lost)

    def _compute(self, e: _Echoes) -> Outcome:
        likeliest: Inputs | None = None
        for inputs in self._candidates(e):
            command = self.feed(self._controller, inputs)
            if _digest(command) == e.digest:
                self.line.take(inputs.guess)
                return self._judge(e, inputs, command, right=True)
            self._controller.undo()
            likeliest = likeliest or inputs
        return self._without_digest(e, likeliest)

    def _without_digest(self, e: _Echoes, inputs: Inputs | None) -> Outcome:
        """Judge a tick whose digest no inputs in the log lead to."""
        missing = self._missing(e, inputs)
        if inputs is None:
            guess = next(self.line.guesses(e.world, e.order))
            self.line.lose(guess)
        else:
            command = self.feed(self._controller, inputs)
            self.line.lose(inputs.guess)
        if missing or inputs is None:
            self._adopt(e.row)
            return Outcome(e.row, Verdict.UNKNOWN, missing, inputs, b"", False)
        outcome = self._judge(e, inputs, command, right=False)
        self._adopt(e.row)
        return outcome

    def _judge(self, e: _Echoes, inputs: Inputs, command: bytes, right: bool) -> Outcome:
        self._last = command
        if self.same(e.row, command):
            return Outcome(e.row, Verdict.EQUAL, "", inputs, command, right)
        if right and self._may_forget(e, command):
            self._adopt(e.row)
            reason = "what it remembered is older than the log"
            return Outcome(e.row, Verdict.UNKNOWN, reason, inputs, command, right)
        return Outcome(e.row, Verdict.DIFFERS, "", inputs, command, right)

    def _may_forget(self, e: _Echoes, command: bytes) -> bool:
        """Whether a command may differ because its history began before the log."""
        start = self._resumed
        if start is None:
            return False
        seen = e.tick_ns - start.tick_ns > MEMORY_NS and e.tick > start.tick + WARM_TICKS
        if seen and not self._controller.looks_back:
            self._resumed = None
            return False
        if self._controller.looks_back or len(self.line.hulls):
            return True
        layout = self.commands.rows.dtype
        recorded = self.commands.message(e.row)
        return all(
            recorded[at + 8 : at + 8 + size] == command[at + 8 : at + 8 + size]
            for name in layout.names or ()
            if name not in (*MEMORY, *FILLED_BY_PROCESS)
            for at, size in [_field(layout, name)]
        )

    def _missing(self, e: _Echoes, inputs: Inputs | None) -> str:
        """Say which input of a tick the log lacks, "" when it has all."""
        if inputs is None:
            return "its JOINT_STATE is not in the log"
        if e.request != self._controller.in_force and inputs.request is None:
            return "its GOAL or STOP is not in the log"
        if not inputs.guess.told or not self.line.known:
            return "OBSTACLES or HULL it had taken are not in the log"
        return ""

    # --- inputs ---

    def _candidates(self, e: _Echoes) -> Iterator[Inputs]:
        """Yield what a tick may have been given, likeliest first."""
        warming = bool(e.flags & WARMING_UP)
        for guess in self.line.guesses(e.world, e.order):
            for request in self._requests_like(e):
                for state in self._states_like(e):
                    for warm in (warming, not warming):
                        yield Inputs(e.tick_ns, e.state_age_ns, warm, state, request, guess)

    def _states_like(self, e: _Echoes) -> Iterator[int]:
        """Yield the state that a command echoes, then others published at the moment echoed."""
        if e.state != MISSING:
            yield e.state
        order, mono_ns = self._by_moment
        begin, end = np.searchsorted(mono_ns, (e.state_mono_ns, e.state_mono_ns + 1))
        yield from (row for row in order[begin:end].tolist() if row != e.state)

    @cached_property
    def _by_moment(self) -> tuple[Ints, Ints]:
        """States by the moment of their publication."""
        mono_ns = self.states.rows["h"]["mono_ns"].astype("i8")
        order = np.argsort(mono_ns, kind="stable")
        return order, mono_ns[order]

    def _requests_like(self, e: _Echoes) -> list[Request | None]:
        """Return the requests that a tick may have obeyed; None when it obeyed no new one."""
        if e.request == self._controller.in_force:
            return [None]
        stops, *number = e.request
        if number[0] == _native.SHUTDOWN:
            return [Request(True, None), None]
        own, other = (
            [Request(stop, data) for data in self._requests.get((stop, number[0], number[1]), ())]
            for stop in (stops, not stops)
        )
        return [*own, None, *other]  # the other kind only where the flag itself is damaged

    def _adopt(self, row: int) -> None:
        self.adopt(self._controller, row)
        self._last = self.commands.message(row)

    def _unpack(self, part: slice) -> Iterator[_Echoes]:
        rows = self.rows[part]
        c = self.commands.rows[rows]
        names = ("tick", "tick_ns", "state_age_ns", "flags", "input_digest")
        yield from map(
            _Echoes._make,
            zip(
                rows.tolist(),
                self.commands.order[rows].tolist(),
                c["h"]["seq"].tolist(),
                *(c[name].tolist() for name in names),
                self._state_rows[part].tolist(),
                c["state_mono_ns"].tolist(),
                zip(
                    ((c["flags"] & STOPPED) != 0).tolist(),
                    c["request_session"].tolist(),
                    c["request_seq"].tolist(),
                    strict=True,
                ),
                zip(
                    c["world_channel"].tolist(),
                    c["world_session"].tolist(),
                    c["world_seq"].tolist(),
                    c["world_version"].tolist(),
                    strict=True,
                ),
                strict=True,
            ),
        )


def read_scene(log: Tables, message: SceneMessage, sets: tuple[str, ...] = ()) -> _native.Scene:
    """Read a SCENE of a log as the controller did.

    Raises
    ------
    LogError
        This version refuses the scene.
    """
    try:
        return _native.read_scene(message.yaml, message.file, list(sets))
    except ValueError as error:
        raise LogError(
            f"{log.path}: the scene in it, of {message.build!r}, is refused: {error}"
        ) from error


def _digest(command: bytes) -> int:
    return int.from_bytes(command[_DIGEST], "big", signed=True)


def _digest_place() -> slice:
    start = 8 + _field(as_rows("JOINT_COMMAND", b"").dtype, "input_digest")[0]
    return slice(start, start + 8)


_DIGEST = _digest_place()


def _find_states(states: Table, commands: Table, rows: np.ndarray[Any, Any]) -> Any:
    """Return for each command the row of the state that it echoes, or NOT_HEARD or MISSING."""
    found = np.full(len(rows), MISSING, dtype=np.int64)
    wanted_session = commands.rows["plant_session"][rows].astype("i8")
    wanted_seq = commands.rows["state_seq"][rows].astype("i8")
    found[wanted_session == 0] = NOT_HEARD
    session = states.rows["h"]["session"].astype("i8")
    for plant in np.unique(wanted_session[wanted_session != 0]):
        own = np.flatnonzero(session == plant)
        asked = np.flatnonzero(wanted_session == plant)
        if not len(own):
            continue
        seq, first = np.unique(states.rows["h"]["seq"][own].astype("i8"), return_index=True)
        place = np.minimum(np.searchsorted(seq, wanted_seq[asked]), len(seq) - 1)
        hit = seq[place] == wanted_seq[asked]
        found[asked[hit]] = own[first[place[hit]]]
    return found


def _requests(log: Tables) -> dict[tuple[bool, int, int], list[bytes]]:
    """Return the different messages of each request: whether it is a stop, session, seq."""
    out: dict[tuple[bool, int, int], list[bytes]] = {}
    for stop, name in ((False, "GOAL"), (True, "STOP")):
        table = log.tables[name]
        for row in range(len(table)):
            h = table.rows["h"][row]
            known = out.setdefault((stop, int(h["session"]), int(h["seq"])), [])
            if table.message(row) not in known:
                known.append(table.message(row))
    return out
