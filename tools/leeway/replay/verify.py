"""Whether a log's commands are what its inputs lead to, to the last bit. Numbers only."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from leeway import _native
from leeway.logs.log import Tables, as_rows
from leeway.replay.digest import Change, explain, input_words, scene_change
from leeway.replay.ticks import FILLED_BY_PROCESS, Outcome, Replay, Verdict

PROGRESS_TICKS = 2048
ECHOED = {
    "JOINT_STATE": {"plant_session", "state_seq", "state_tick", "state_mono_ns", "q"},
    "GOAL or STOP": {"request_session", "request_seq", "goal"},
    "OBSTACLES or HULL": {
        "world_channel",
        "world_session",
        "world_seq",
        "world_version",
        "obstacle_count",
        "clearance",
        "clearance_link",
        "clearance_obstacle",
    },
}


@dataclass(frozen=True)
class FieldDifference:
    """A field of a command that came out otherwise."""

    name: str
    recorded: float
    replayed: float
    recorded_bits: str
    replayed_bits: str


@dataclass(frozen=True)
class Difference:
    """A tick whose command came out otherwise."""

    tick: int
    t: float  # s, time of motion; 0 before it
    seq: int  # of the command
    fields: list[FieldDifference]
    right_inputs: bool  # the inputs in the log are those that the controller had
    changed: list[Change]  # inputs that are not, where one alone explains it
    suspects: list[str]  # else the messages that echoes point at
    scene: list[Change]  # the scene as the cause: so if it is the same in other ticks


@dataclass
class ControllerResult:
    """What came of the ticks of one controller."""

    session: int
    file: str  # scene
    mode: str
    build: str
    own_scene: bool
    damaged_scenes: int
    verified: int = 0
    equal: int = 0
    sent_again: int = 0
    not_in_log: int = 0  # ticks whose commands the log lacks
    unknown: Counter[str] = field(default_factory=Counter)  # reason -> ticks
    first_unknown: int = 0  # tick
    fields: Counter[str] = field(default_factory=Counter)  # name -> ticks that differ in it
    first: Difference | None = None
    inputs_changed: int = 0  # ticks that differ because an input in the log is another

    @property
    def differing(self) -> int:
        """Ticks that differ."""
        return self.verified - self.equal

    @property
    def same_build(self) -> bool:
        """Whether this build is the one that recorded it."""
        return self.build == _native.BUILD

    @property
    def whole(self) -> bool:
        """Whether every tick could be verified."""
        return not self.unknown and not self.not_in_log

    def to_json(self) -> dict[str, Any]:
        """Return plain values."""
        own = {name: value for name, value in vars(self).items() if name != "first"}
        first = None
        if self.first is not None:
            first = vars(self.first) | {
                "fields": [vars(f) for f in self.first.fields],
                "changed": [c._asdict() for c in self.first.changed],
                "scene": [c._asdict() for c in self.first.scene],
            }
        return own | {
            "differing": self.differing,
            "same_build": self.same_build,
            "first": first,
        }


@dataclass
class Verification:
    """What came of a log."""

    path: Path
    truncated_bytes: int
    undecodable: dict[str, int]
    controllers: list[ControllerResult]

    @property
    def result(self) -> str:
        """Return equal, differs, or incomplete: equal as far as could be verified."""
        if any(c.differing or c.damaged_scenes for c in self.controllers):
            return "differs"
        whole = not self.truncated_bytes and all(c.whole for c in self.controllers)
        return "equal" if whole else "incomplete"

    def to_json(self) -> dict[str, Any]:
        """Return plain values."""
        return {
            "path": str(self.path),
            "result": self.result,
            "this_build": _native.BUILD,
            "truncated_bytes": self.truncated_bytes,
            "undecodable": self.undecodable,
            "controllers": [c.to_json() for c in self.controllers],
        }


def sessions(log: Tables) -> list[int]:
    """Return the controllers of a log, oldest first."""
    found, first = np.unique(log.tables["JOINT_COMMAND"].rows["h"]["session"], return_index=True)
    return [int(s) for s in found[np.argsort(first)]]


def verify(log: Tables, progress: Callable[[int], None] | None = None) -> Verification:
    """Compute every command of a log again and compare all bits.

    Parameters
    ----------
    progress
        Called with the number of commands done.

    Raises
    ------
    LogError
        The log holds no SCENE, or one that this version refuses.
    """
    results, done = [], 0
    for session in sessions(log):
        replay = Replay(log, session)
        result = _start(replay)
        for outcome in replay:
            _note(replay, result, outcome)
            done += 1
            if progress and done % PROGRESS_TICKS == 0:
                progress(done)
        results.append(result)
    return Verification(log.path, log.truncated, log.undecodable, results)


def _start(replay: Replay) -> ControllerResult:
    configuration = replay.configuration
    scene = configuration.scene
    return ControllerResult(
        session=replay.session,
        file=scene.file,
        mode=scene.mode,
        build=scene.build,
        own_scene=configuration.own,
        damaged_scenes=configuration.others,
    )


def _note(replay: Replay, result: ControllerResult, outcome: Outcome) -> None:
    """Count one outcome."""
    verdict = outcome.verdict
    if verdict is Verdict.SENT_AGAIN:
        result.sent_again += 1
        return
    if verdict is Verdict.UNKNOWN:
        result.unknown[outcome.reason] += 1
        result.first_unknown = result.first_unknown or _tick(replay, outcome)
        result.not_in_log += outcome.lost
        return
    result.verified += 1
    result.equal += verdict is Verdict.EQUAL
    if verdict is Verdict.DIFFERS:
        difference = describe(replay, outcome)
        result.fields.update({f.name.partition("[")[0] for f in difference.fields})
        result.inputs_changed += not difference.right_inputs
        result.first = result.first or difference
        # Another scene explains every tick by the same value.
        first = result.first
        if first is not difference and not first.changed and first.scene == difference.scene:
            first.changed.extend(first.scene)


def _tick(replay: Replay, outcome: Outcome) -> int:
    return int(replay.commands.rows["tick"][outcome.row])


def describe(replay: Replay, outcome: Outcome) -> Difference:
    """Say in which fields a tick differs and which input explains it."""
    recorded = replay.commands.rows[outcome.row]
    replayed = as_rows("JOINT_COMMAND", outcome.replayed)[0]
    fields = compare_fields(recorded, replayed)
    changed: list[Change] = []
    suspects: list[str] = []
    scene: list[Change] = []
    inputs = outcome.inputs
    state = None
    if inputs is not None and inputs.state >= 0:
        state = replay.states.rows[inputs.state]
    if inputs is not None and not outcome.right_inputs:
        world = inputs.guess.world
        words = input_words(replay.scene_digest, state, world, replayed, inputs.warming_up)
        changed = explain(words, world, int(recorded["input_digest"]))
        scene = scene_change(words, int(recorded["input_digest"]))
        names = {f.name.partition("[")[0] for f in fields}
        suspects = [] if changed else [m for m, echoed in ECHOED.items() if echoed & names]
    t = float(state["tick"]) * float(state["period_ns"]) * 1e-9 if state is not None else 0.0
    return Difference(
        tick=int(replayed["tick"]),
        t=t,
        seq=int(recorded["h"]["seq"]),
        fields=fields,
        right_inputs=outcome.right_inputs,
        changed=changed,
        suspects=suspects,
        scene=scene,
    )


def compare_fields(recorded: Any, replayed: Any) -> list[FieldDifference]:
    """Compare all fields of two commands that the tick fills in, bit by bit."""
    out = []
    for name in recorded.dtype.names:
        if name in FILLED_BY_PROCESS:
            continue
        a, b = np.atleast_1d(recorded[name]), np.atleast_1d(replayed[name])
        for k, (x, y) in enumerate(zip(a, b, strict=True)):
            bits = [f"0x{v.byteswap().tobytes().hex()}" for v in (x, y)]
            if bits[0] != bits[1]:
                label = f"{name}[{k}]" if a.size > 1 else name
                out.append(FieldDifference(label, x.item(), y.item(), *bits))
    return out
