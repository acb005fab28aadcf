"""The messages of a log as columns: one array a field, one entry a message.

Names, units and frames are those of lcmtypes/*.lcm.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Messages:
    """What every message carries, one entry a message, in the order of the log."""

    order: Ints  # place in the log, from 0, counted over all channels
    utime: Ints
    mono_ns: Ints
    session: Ints
    seq: Ints

    def __len__(self) -> int:
        return len(self.order)

    def take(self: MessagesT, rows: NDArray[Any]) -> MessagesT:
        """Return the messages of a mask or of indices.

        Parameters
        ----------
        rows : (n,) bool or (k,) int
        """
        return type(self)(**{f.name: getattr(self, f.name)[rows] for f in fields(self)})


MessagesT = TypeVar("MessagesT", bound=Messages)


@dataclass(frozen=True)
class States(Messages):
    """JOINT_STATE: fields of joint_state_t; q rad and qd rad/s are (n, 6)."""

    plant_mode: Ints
    command_session: Ints
    command_seq: Ints
    tick: Ints
    period_ns: Ints
    q: Floats
    qd: Floats


@dataclass(frozen=True)
class Commands(Messages):
    """JOINT_COMMAND: fields of joint_command_t; qd, qd_law, q (n, 6), goal, circulation (n, 3)."""

    plant_session: Ints
    state_seq: Ints
    state_tick: Ints
    state_mono_ns: Ints
    mode: Ints
    flags: Ints
    law_outcome: Ints
    qd: Floats
    qd_law: Floats
    q: Floats
    goal: Floats
    request_session: Ints
    request_seq: Ints
    world_channel: Ints
    world_session: Ints
    world_seq: Ints
    world_version: Ints
    obstacle_count: Ints
    deviation: Floats
    clearance: Floats
    clearance_link: Ints
    clearance_obstacle: Ints
    self_clearance: Floats
    self_link: Ints
    stuck_since_ns: Ints
    circulation: Floats
    tick: Ints
    tick_ns: Ints
    state_age_ns: Ints
    input_digest: Ints
    compute_ns: Ints
    wake_late_ns: Ints
    previous_exec_ns: Ints
    skipped: Ints


@dataclass(frozen=True)
class Solids(Messages):
    """What OBSTACLES and HULL have in common; fields of obstacle_t have its axes behind."""

    owner: Ints
    time_ns: Ints
    valid_for_ms: Ints
    n: Ints
    id: Ints
    shape: Ints
    p: Floats
    quat: Floats
    radius: Floats
    size: Floats
    v: Floats
    omega: Floats


@dataclass(frozen=True)
class Obstacles(Solids):
    """OBSTACLES, WORLD: n used entries of 32; p is (m, 32, 3) m."""

    op: Ints


@dataclass(frozen=True)
class Hulls(Solids):
    """HULL, WORLD_HULL: one obstacle each, p is (m, 3) m; n used entries of vertex (m, 64, 3) m."""

    vertex: Floats


@dataclass(frozen=True)
class Goals(Messages):
    """GOAL: p (m, 3) m."""

    p: Floats


@dataclass(frozen=True)
class Stops(Messages):
    """STOP."""


@dataclass(frozen=True)
class Statuses(Messages):
    """STATUS, PLANT_STATUS: fields of status_t; refused is (n, 16), percentiles are (n, 4)."""

    state: Ints
    faults: Ints
    faults_ever: Ints
    realtime: Ints
    period_ns: Ints
    ticks: Ints
    skipped: Ints
    stale_ticks: Ints
    unsent: Ints
    peer_session: Ints
    taken: Ints
    missed: Ints
    takeovers: Ints
    refused: Ints
    wake_late_ns: Ints
    exec_ns: Ints
    age_ns: Ints
    minor_faults: Ints
    major_faults: Ints
    allocations: Ints
    clearance: Floats
    deviation: Floats
    stuck_since_ns: Ints
    obstacle_count: Ints
    world_age_ns: Ints


@dataclass(frozen=True)
class SceneMessage:
    """SCENE: what a program says that it runs."""

    session: int
    mono_ns: int
    program: str
    build: str
    mode: str
    file: str
    yaml: str
