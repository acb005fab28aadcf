"""Obstacles of every shape: from the words of a command line to a message, and back from WORLD."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from leeway_lcm import leeway as wire

from leeway import _native, bus
from leeway.connection import Connection
from leeway.logs.solids import HULL, NAMES, Obstacle, Triple

LISTEN_S = 2.0  # for the first message of WORLD, and of the controller
CYCLE_S = 10.0  # for the whole set, which a large one takes
LIMIT = 100.0  # m, m/s, rad/s
NS_PER_MS = 1_000_000
IDENTITY = (1.0, 0.0, 0.0, 0.0)

Vector = tuple[float, ...]


class Refused(ValueError):
    """Words that mean no obstacle; the text says what was expected and what was found."""


# --- words ---


def angle(text: str) -> float:
    """Read an angle, as 0.5, 0.5rad or 30deg; rad."""
    match = re.fullmatch(r"([-+]?[0-9.]+(?:e[-+]?[0-9]+)?)(rad|deg)?", text.strip(), re.IGNORECASE)
    try:
        value = float(match[1]) if match else math.nan
    except ValueError:
        value = math.nan
    if match is None or not math.isfinite(value):
        raise Refused(f"expected an angle, as 0.5, 0.5rad or 30deg, found {text!r}")
    return math.radians(value) if (match[2] or "").lower() == "deg" else value


def duration_ms(text: str) -> int:
    """Read a time, as 5s, 500ms or 2min; ms."""
    match = re.fullmatch(r"([0-9]+(?:\.[0-9]*)?)(ms|s|min)?", text.strip())
    factor = {"ms": 1.0, "s": 1e3, "min": 6e4}[(match and match[2]) or "s"]
    value = round(float(match[1]) * factor) if match else 0
    if not 1 <= value < 1 << 31:
        raise Refused(
            f"expected a time from 1 ms to 35791 min, as 5s, 500ms or 2min, found {text!r}"
        )
    return value


def vertices(text: str) -> list[Vector]:
    """Read points "x,y,z x,y,z ..."; or a file of them, one a line.

    Raises
    ------
    Refused
        They are no points, or not 1 to 64.
    """
    try:
        is_file = Path(text).is_file()
    except OSError:  # too long for a name
        is_file = False
    if is_file:
        try:
            whole = Path(text).read_text()
        except UnicodeDecodeError:
            raise Refused(f"vertices: expected a text of points x,y,z, found {text}") from None
        lines = [line.partition("#")[0] for line in whole.splitlines()]
        points = [line.replace(",", " ").split() for line in lines if line.strip()]
    else:
        points = [point.split(",") for point in text.split()]
    try:
        found = [tuple(map(float, point)) for point in points]
    except ValueError as error:
        raise Refused(f"vertices: expected numbers, {error}, and there is no such file") from None
    if not 1 <= len(found) <= wire.hull_t.MAX or any(len(point) != 3 for point in found):
        raise Refused(
            f"vertices: expected 1 to {wire.hull_t.MAX} points x,y,z, found {len(found)} of "
            f"{sorted({len(point) for point in found})} numbers"
        )
    return found


def from_rpy(roll: float, pitch: float, yaw: float) -> Vector:
    """Return the quaternion w x y z of turns about x, then y, then z of the base, rad."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a / 2), math.sin(a / 2)) for a in (roll, pitch, yaw))
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def from_normal(normal: Sequence[float]) -> Vector:
    """Return a quaternion w x y z that turns z to a direction."""
    length = math.sqrt(sum(v * v for v in normal))
    if not (math.isfinite(length) and length > 0):
        raise Refused(f"normal: expected a direction, found {tuple(normal)}")
    x, y, z = (v / length for v in normal)
    if z < -1 + 1e-9:
        return (0.0, 1.0, 0.0, 0.0)
    w = math.sqrt((1 + z) / 2)
    return (w, -y / (2 * w), x / (2 * w), 0.0)


def to_rpy(quat: Sequence[float]) -> Vector:
    """Return the turns about x, y and z of the base that a quaternion w x y z is, rad."""
    w, x, y, z = quat
    return (
        math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        math.asin(max(-1.0, min(1.0, 2 * (w * y - x * z)))),
        math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
    )


# --- messages ---


@dataclass
class Draft:
    """An obstacle to be told."""

    number: int
    shape: int
    p: Vector
    quat: Vector = IDENTITY
    radius: float = 0.0
    size: Vector = (0.0, 0.0, 0.0)
    v: Vector = (0.0, 0.0, 0.0)
    omega: Vector = (0.0, 0.0, 0.0)
    valid_for_ms: int = 0
    vertices: list[Vector] = field(default_factory=list)  # of a hull; none = those it has

    @property
    def is_timed(self) -> bool:
        """Whether it needs to be said when it was there."""
        return self.valid_for_ms > 0 or any((*self.v, *self.omega))

    def message(self, time_ns: int) -> Any:
        """Return an obstacles_t or hull_t, without a stamp.

        Raises
        ------
        Refused
            No controller would take it.
        """
        self._check()
        entry = wire.obstacle_t()
        entry.id, entry.shape, entry.radius = self.number, self.shape, self.radius
        entry.p, entry.quat, entry.size = list(self.p), list(self.quat), list(self.size)
        entry.v, entry.omega = list(self.v), list(self.omega)
        if self.vertices:
            m = wire.hull_t()
            m.o, m.n = entry, len(self.vertices)
            m.vertex[: m.n] = [list(point) for point in self.vertices]
        else:
            m = wire.obstacles_t()
            m.op, m.n, m.o[0] = m.UPSERT, 1, entry
        if self.is_timed:
            m.time_ns, m.valid_for_ms = time_ns, self.valid_for_ms
        m.h = bus.header(1, 1)
        name = "HULL" if self.vertices else "OBSTACLES"
        if not _native.acceptable(name, m.encode())[0]:
            raise Refused(f"no controller would take this {NAMES[self.shape]}: {self}")
        return m

    def _check(self) -> None:
        if not 0 < self.number < 1 << 31:
            raise Refused(f"expected an id from 1 to {(1 << 31) - 1}, found {self.number}")
        if not (math.isfinite(self.radius) and 0 <= self.radius <= LIMIT):
            raise Refused(f"expected a radius from 0 to {LIMIT:g} (m), found {self.radius:g}")
        if self.shape == wire.obstacle_t.CAPSULE and not 0 <= self.size[0] <= LIMIT:
            found = 2 * self.size[0]
            raise Refused(f"expected a length from 0 to {2 * LIMIT:g} (m), found {found:g}")
        if self.shape == wire.obstacle_t.BOX and not all(0 < v <= LIMIT for v in self.size):
            edges = tuple(2 * v for v in self.size)
            raise Refused(f"expected three edges > 0, to {2 * LIMIT:g} (m), found {edges}")
        limited = {"at": self.p, "velocity": self.v, "omega": self.omega, "vertices": self.vertices}
        for name, values in limited.items():
            if not np.all(np.abs(np.array(values)) <= LIMIT):
                raise Refused(
                    f"{name}: expected numbers from -{LIMIT:g} to {LIMIT:g}, found {values}"
                )


def clock_ns(own: Connection, robot: str | None) -> int | None:
    """Return the time that a controller goes by, from its newest command; None without one."""
    found: list[int] = []

    def on_command(_: str, data: bytes) -> None:
        command = bus.decode(wire.joint_command_t, data)
        if command is not None:
            found.append(command.tick_ns)

    own.subscribe(bus.channel("JOINT_COMMAND", robot), on_command)
    end = time.monotonic() + LISTEN_S
    while not found and (left := end - time.monotonic()) > 0:
        own.handle(left)
    return found[-1] if found else None


# --- the set ---


class Listing:
    """Rebuilds the set that a controller tells: from a REPLACE of WORLD to the next."""

    def __init__(self, own: Connection, robot: str | None) -> None:
        self._bus = own
        self._found: dict[int, Obstacle] = {}
        self._begun = self._whole = False
        self.now_ns = 0  # time of the newest command
        own.subscribe(bus.channel("WORLD", robot), self._on_world)
        own.subscribe(bus.channel("WORLD_HULL", robot), self._on_hull)
        own.subscribe(bus.channel("JOINT_COMMAND", robot), self._on_command)

    def _on_command(self, _: str, data: bytes) -> None:
        command = bus.decode(wire.joint_command_t, data)
        if command is not None:
            self.now_ns = command.tick_ns

    def _on_world(self, _: str, data: bytes) -> None:
        m = bus.decode(wire.obstacles_t, data)
        if m is None or self._whole:
            return
        if m.op == m.REPLACE:
            self._begun, self._whole = True, self._begun
        for entry in m.o[: m.n if self._begun and not self._whole else 0]:
            self._note(m, entry, ())

    def _on_hull(self, _: str, data: bytes) -> None:
        m = bus.decode(wire.hull_t, data)
        if m is not None and self._begun and not self._whole:
            self._note(m, m.o, tuple(tuple(point) for point in m.vertex[: m.n]))

    def _note(self, m: Any, entry: Any, points: tuple[Triple, ...]) -> None:
        expires = m.time_ns + m.valid_for_ms * NS_PER_MS if m.valid_for_ms else 0
        self._found[entry.id] = Obstacle(
            id=entry.id,
            shape=entry.shape,
            p=tuple(entry.p),
            quat=tuple(entry.quat),
            radius=entry.radius,
            size=tuple(entry.size),
            v=tuple(entry.v),
            omega=tuple(entry.omega),
            time_ns=m.time_ns,
            expires_ns=expires,
            vertices=points,
            session=m.owner,
        )

    def obstacles(self) -> list[Obstacle] | None:
        """Wait for the whole set and return it by id; None when no controller tells any."""
        end = time.monotonic() + LISTEN_S
        while not self._whole and (left := end - time.monotonic()) > 0:
            began = self._begun
            self._bus.handle(left)
            if self._begun and not began:
                end = time.monotonic() + CYCLE_S
        return [self._found[number] for number in sorted(self._found)] if self._whole else None


def age_s(obstacle: Obstacle, now_ns: int) -> float | None:
    """Return how long ago it was there, s; None when that was not told."""
    return (now_ns - obstacle.time_ns) / 1e9 if obstacle.time_ns else None


def to_json(obstacle: Obstacle, now_ns: int) -> dict[str, Any]:
    """Return all values of an obstacle by name."""
    values = dict(vars(obstacle))
    values["shape"] = NAMES[obstacle.shape]
    values["owner"] = values.pop("session")
    return values | {
        "age_s": age_s(obstacle, now_ns),
        "vertices": obstacle.vertices if obstacle.shape == HULL else None,
    }
