"""What a controller would have commanded with another configuration. Numbers only.

Open loop: every tick gets its recorded inputs. The arm does not follow the other commands, so its
configurations, and with them the distances, are those of the log.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from leeway import _native
from leeway.logs.log import Floats, Ints, Tables, as_rows
from leeway.replay.ticks import Outcome, Replay, Verdict

FLAGS = {
    "position": 1,
    "velocity": 2,
    "acceleration": 4,
    "stopped": 8,
    "stale": 16,
    "not_finite": 32,
    "waiting": 64,
    "foreign": 128,
    "warming_up": 256,
    "clearance": 512,
    "contact": 1024,
}
# What the tick takes from the scene; everything else acts on the plant or comes over the bus.
USED_BY_TICK = ("robot", "rate_hz", "law", "limits", "request")
PROGRESS_TICKS = 2048


@dataclass(frozen=True)
class Largest:
    """Largest change of a joint's command."""

    joint: int  # 1..6
    change: float  # rad/s, other minus recorded
    tick: int
    t: float  # s


@dataclass(frozen=True)
class WhatIf:
    """Recorded and other commands of one controller; arrays have n rows, one a tick."""

    session: int
    file: str  # scene
    sets: list[str]
    without_effect: list[str]  # keys that no tick uses
    not_computed: int  # ticks whose inputs the log lacks
    not_reproduced: int  # ticks that differ from the log without any change
    tick: Ints
    t: Floats  # (n,) s, time of motion
    qd: Floats  # (n, 6) rad/s, recorded
    other_qd: Floats  # (n, 6)
    flags: Ints  # (n,) recorded
    other_flags: Ints  # (n,)

    @property
    def differs(self) -> Any:
        """Return which ticks give another command, (n,) bool; bits are compared."""
        words = self.qd.view(np.int64) != self.other_qd.view(np.int64)
        return words.any(axis=1) | (self.flags != self.other_flags)

    @property
    def largest(self) -> list[Largest]:
        """Return the largest change of each joint."""
        change = self.other_qd - self.qd
        rows = np.argmax(np.abs(change), axis=0) if len(change) else []
        return [
            Largest(j + 1, float(change[row, j]), int(self.tick[row]), float(self.t[row]))
            for j, row in enumerate(rows)
        ]

    def flag_changes(self) -> dict[str, tuple[int, int]]:
        """Return for each flag the ticks that gain it and that lose it."""
        out = {}
        for name, bit in FLAGS.items():
            had, has = (self.flags & bit) != 0, (self.other_flags & bit) != 0
            gained, lost = int((has & ~had).sum()), int((had & ~has).sum())
            if gained or lost:
                out[name] = (gained, lost)
        return out

    def to_json(self) -> dict[str, Any]:
        """Return plain values without the arrays."""
        rows = np.flatnonzero(self.differs)
        first = int(rows[0]) if len(rows) else None
        return {
            "session": self.session,
            "file": self.file,
            "set": self.sets,
            "open_loop": True,
            "without_effect": self.without_effect,
            "ticks": len(self.tick),
            "not_computed": self.not_computed,
            "not_reproduced": self.not_reproduced,
            "differing": len(rows),
            "first_tick": None if first is None else int(self.tick[first]),
            "first_t": None if first is None else float(self.t[first]),
            "largest": [vars(one) for one in self.largest],
            "flags": {
                name: {"gained": gained, "lost": lost}
                for name, (gained, lost) in self.flag_changes().items()
            },
        }


def what_if(
    log: Tables, session: int, sets: Sequence[str], progress: Callable[[int], None] | None = None
) -> WhatIf:
    """Compute every command of a controller with a changed scene.

    Parameters
    ----------
    sets
        ``"key=value"`` as on the command line.
    progress
        Called with the number of commands done.

    Raises
    ------
    LogError
        The log holds no SCENE, or one that this version refuses.
    ValueError
        A key or value is refused; the text says which and why.
    """
    replay = Replay(log, session)
    scene = replay.configuration.scene
    other = _Other(replay, _native.read_scene(scene.yaml, scene.file, list(sets)))
    for done, outcome in enumerate(replay):
        other.note(outcome)
        if progress and done % PROGRESS_TICKS == 0:
            progress(done)
    keys = [one.partition("=")[0].strip() for one in sets]
    recorded = replay.commands.rows[other.rows]
    computed = as_rows("JOINT_COMMAND", b"".join(other.commands))
    return WhatIf(
        session=session,
        file=scene.file,
        sets=list(sets),
        without_effect=[k for k in keys if k.partition(".")[0] not in USED_BY_TICK],
        not_computed=other.not_computed,
        not_reproduced=other.not_reproduced,
        tick=recorded["tick"].astype("i8"),
        t=recorded["state_tick"] * _period(replay),
        qd=recorded["qd"].astype("f8"),
        other_qd=computed["qd"].astype("f8"),
        flags=recorded["flags"].astype("i8"),
        other_flags=computed["flags"].astype("i8"),
    )


class _Other:
    """A second controller beside the one of the log."""

    def __init__(self, replay: Replay, scene: _native.Scene) -> None:
        self._replay = replay
        self._controller = _native.Controller(scene, replay.session)
        self.rows: list[int] = []
        self.commands: list[bytes] = []
        self.not_computed = 0
        self.not_reproduced = 0

    def note(self, outcome: Outcome) -> None:
        """Compute one tick with the inputs of the log."""
        if outcome.verdict is Verdict.SENT_AGAIN:
            return
        if outcome.verdict is Verdict.UNKNOWN or outcome.inputs is None:
            self.not_computed += 1
            self._replay.adopt(self._controller, outcome.row)
            return
        self.not_reproduced += outcome.verdict is Verdict.DIFFERS
        self.rows.append(outcome.row)
        self.commands.append(self._replay.feed(self._controller, outcome.inputs))


def _period(replay: Replay) -> float:
    """Return the plant's period, s."""
    return float(replay.states.rows["period_ns"][0]) * 1e-9
