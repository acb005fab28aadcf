"""Logs made in memory for tests: framing, messages, whole runs."""

from __future__ import annotations

import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
from leeway_lcm import leeway as wire

from leeway import _native
from leeway.logs.analysis import Analysis, analyse
from leeway.logs.log import read_log

PLANT, CONTROLLER, SOURCE = 11, 22, 33
PERIOD_NS = 8_000_000
SCENE = """
robot: ur5
rate_hz: 125
duration_s: 0.4
q0: [0, 0, 0, 0, 0, 0]
law: {control_points: joints, attraction: cone, rho_rep: 1.9}
request: {goal: [0.5, -0.6, 0.5]}
obstacles:
  - {at: [1, 1, 0.4]}
"""


def event(channel: str, data: bytes, number: int = 0) -> bytes:
    """Return one event of a log."""
    name = channel.encode()
    return struct.pack(">IqqII", 0xEDA1DA01, number, number, len(name), len(data)) + name + data


def stamp(message: Any, session: int, seq: int, mono_ns: int = 0) -> Any:
    """Fill the header of a message and return the message."""
    message.h.session, message.h.seq = session, seq
    message.h.mono_ns = message.h.utime = mono_ns
    return message


def obstacles(
    session: int, seq: int, op: int, items: list[tuple[int, tuple[float, ...], float]]
) -> Any:
    """Return an OBSTACLES message of (id, centre, radius)."""
    m = stamp(wire.obstacles_t(), session, seq)
    m.op, m.n = op, len(items)
    m.o = [wire.obstacle_t() for _ in range(32)]
    for slot, (number, p, radius) in zip(m.o, items, strict=False):
        slot.id, slot.p, slot.quat, slot.radius = number, p, [1, 0, 0, 0], radius
    return m


def hull(
    session: int, seq: int, number: int, p: tuple[float, ...], vertices: list[tuple[float, ...]]
) -> Any:
    """Return a HULL message."""
    m = stamp(wire.hull_t(), session, seq)
    m.o.id, m.o.shape, m.o.p, m.o.quat = number, m.o.HULL, p, [1, 0, 0, 0]
    m.n = len(vertices)
    m.vertex[: m.n] = [list(v) for v in vertices]
    return m


def scene(session: int, program: str = "leeway-controller", **fields: str) -> Any:
    """Return a SCENE message."""
    m = stamp(wire.scene_t(), session, 1)
    m.program, m.build, m.mode, m.file, m.yaml = (
        program,
        "leeway 0",
        "realtime",
        "runs/test.yaml",
        SCENE,
    )
    for name, value in fields.items():
        setattr(m, name, value)
    return m


def status(session: int, mono_ns: int, ticks: int = 500, **fields: Any) -> Any:
    """Return a status_t of a program that runs well, seconds after its start."""
    m = stamp(wire.status_t(), session, 1 + mono_ns // PERIOD_NS, mono_ns)
    m.state, m.realtime, m.period_ns, m.ticks = m.RUNNING, m.FIFO | m.LOCKED, PERIOD_NS, ticks
    m.wake_late_ns, m.exec_ns = [20_000, 40_000, 60_000, 80_000], [30_000, 50_000, 70_000, 90_000]
    m.age_ns, m.allocations, m.clearance = [4_000_000] * 4, -1, math.inf
    for name, value in fields.items():
        setattr(m, name, value)
    return m


class Run:
    """A run of some ticks at constant joint speed, to be changed by a test before it is written.

    Lists of messages in the order of sending; every command answers the state of the same index.
    """

    def __init__(self, ticks: int = 51, speed: float = 0.5) -> None:
        self.before: list[tuple[str, Any]] = [
            ("SCENE", scene(PLANT, "leeway-simulator")),
            ("SCENE", scene(CONTROLLER)),
            ("OBSTACLES", obstacles(PLANT, 1, 2, [(1, (1.0, 1.0, 0.4), 0.0)])),
        ]
        self.states = [self._state(k, speed) for k in range(ticks)]
        self.commands = [self._command(k, speed) for k in range(ticks)]
        self.inserted: dict[int, list[tuple[str, Any]]] = {}  # before the state of that index

    @staticmethod
    def _state(k: int, speed: float) -> Any:
        m = stamp(wire.joint_state_t(), PLANT, k + 1, k * PERIOD_NS)
        m.plant_mode, m.command_session, m.command_seq = min(k, 1), CONTROLLER * min(k, 1), k
        m.tick, m.period_ns = k, PERIOD_NS
        m.q = [speed * k * PERIOD_NS * 1e-9, 0, 0, 0, 0, 0]
        m.qd = [speed * min(k, 1), 0, 0, 0, 0, 0]
        return m

    @staticmethod
    def _command(k: int, speed: float) -> Any:
        m = stamp(wire.joint_command_t(), CONTROLLER, k + 1, k * PERIOD_NS + PERIOD_NS // 2)
        m.plant_session, m.state_seq, m.state_tick, m.mode = PLANT, k + 1, k, 1
        m.q = [speed * k * PERIOD_NS * 1e-9, 0, 0, 0, 0, 0]
        m.qd = m.qd_law = [speed, 0, 0, 0, 0, 0]
        m.goal = [0.5, -0.6, 0.5]
        m.world_session, m.world_seq, m.world_version, m.obstacle_count = PLANT, 1, 1, 1
        m.world_channel = m.OBSTACLES
        m.tick, m.tick_ns = k + 1, k * PERIOD_NS
        m.wake_late_ns, m.previous_exec_ns, m.state_age_ns = 20_000 + k, 30_000 + k, 4_000_000
        origins = _native.Arm("ur5").frames(np.array(m.q))[1:, :3, 3]
        m.clearance = float(np.linalg.norm(origins - [1, 1, 0.4], axis=1).min())
        m.deviation = float(np.linalg.norm(origins[-1] - m.goal))
        return m

    def tell(self, **faults: dict[int, int]) -> dict[str, list[Any]]:
        """Let both programs tell STATUS every 6th tick, 48 ms; return the messages by channel.

        Parameters
        ----------
        faults
            By channel: tick from which on a set of faults is told, and that set.
        """
        told: dict[str, list[Any]] = {}
        for name, session in (("STATUS", CONTROLLER), ("PLANT_STATUS", PLANT)):
            in_force = 0
            for k in range(0, len(self.commands), 6):
                in_force = faults.get(name, {}).get(k, in_force)
                m = status(session, k * PERIOD_NS + PERIOD_NS // 2, 500 + k, faults=in_force)
                self.inserted.setdefault(k, []).append((name, m))
                told.setdefault(name, []).append(m)
        return told

    def messages(self) -> list[tuple[str, Any]]:
        """Return all messages in order."""
        out = list(self.before)
        for k in range(max(len(self.states), len(self.commands))):
            out += self.inserted.get(k, [])
            out += [("JOINT_STATE", m) for m in self.states[k : k + 1]]
            out += [("JOINT_COMMAND", m) for m in self.commands[k : k + 1]]
        return out

    def data(self, prefix: str = "") -> bytes:
        """Return the log."""
        events = [
            event(
                name if name in ("OBSTACLES", "HULL") else prefix + name,
                m if isinstance(m, bytes) else m.encode(),
                k,
            )
            for k, (name, m) in enumerate(self.messages())
        ]
        return b"".join(events)

    def write(self, folder: Path, name: str = "run.lcm") -> Path:
        """Write the log and return its path."""
        path = folder / name
        path.write_bytes(self.data())
        return path


def analysed(run: Run, folder: Path) -> Analysis:
    return analyse(read_log(run.write(folder)))


def texts(a: Analysis, kind: str) -> list[str]:
    return [f"{event.t:.3f} {event.text}" for event in a.events if event.kind == kind]


def see(run: Run, rows: slice, session: int, seq: int, hull: bool = False) -> None:
    """Make commands echo an OBSTACLES or HULL message."""
    for command in run.commands[rows]:
        command.world_session, command.world_seq = session, seq
        command.world_channel = command.HULL if hull else command.OBSTACLES


def set_limits(run: Run, lines: str) -> None:
    """Add lines to the scene that the controller announces."""
    run.before[1] = ("SCENE", scene(CONTROLLER, yaml=SCENE + lines))
