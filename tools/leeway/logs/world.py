"""The set of obstacles over a run, rebuilt from the OBSTACLES and HULL of its log.

The messages are merged by the controller's own code (lib/collision/world.c), so that the set of
every tick is the one which that tick saw.

Units are metres, positions in the base frame of the arm.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from leeway import _native
from leeway.logs.log import Commands, Floats, Ints, Log, wire
from leeway.logs.solids import Obstacle

_CHANNELS = {"OBSTACLES": wire.joint_command_t.OBSTACLES, "HULL": wire.joint_command_t.HULL}

World = tuple[Obstacle, ...]


@dataclass(frozen=True)
class WorldLine:
    """Worlds in the order in which they came, and which of them each tick saw."""

    worlds: list[World]
    index: Ints  # (n,) into worlds
    unknown_ticks: int  # ticks that saw a message which the log lacks: the world before it is taken


@dataclass(frozen=True)
class Surroundings:
    """What each of n ticks saw around the arm."""

    line: WorldLine
    distance: Floats  # (n, 6) m to the nearest surface; negative inside, NaN = no obstacle
    obstacle: Ints  # (n, 6) whose surface, 0 = no obstacle


def follow(log: Log, commands: Commands, points: Floats) -> Surroundings:
    """Return the obstacles that each command had seen, and how near points were to them.

    Commands name the newest message taken in by (world_channel, world_session, world_seq); logger
    times play no part.

    Parameters
    ----------
    commands
        n commands of one controller, in its order.
    points : (n, 6, 3) m
        Moving obstacles are where they were at the tick's time.
    """
    told = sorted(
        (int(order), name, row)
        for name, table in log.told.items()
        for row, order in enumerate(table.order)
    )
    seen = _runs_by_message(log, told, commands)
    distance = np.full(points.shape[:2], np.nan)
    obstacle = np.zeros(points.shape[:2], dtype=np.int64)
    index = np.full(len(commands), -1, dtype=np.int64)
    worlds: list[World] = [()]
    world = _native.World()
    for place, (_, name, row) in enumerate(told):
        if not world.apply(log.told[name].message(row), name == "HULL") or place not in seen:
            continue
        rows = np.concatenate(seen[place])
        now = tuple(_obstacle(values) for values in world.obstacles())
        for part, left in _not_expired(now, rows, commands.tick_ns[rows]):
            if left != worlds[-1]:
                worlds.append(left)
            index[part] = len(worlds) - 1
        d, whose = world.nearest(np.ascontiguousarray(points[rows]), commands.tick_ns[rows])
        distance[rows] = np.where(whose > 0, d, np.nan)
        obstacle[rows] = whose
    line = _without_gaps(worlds, index, commands)
    return Surroundings(line, distance, obstacle)


def _not_expired(world: World, rows: Ints, tick_ns: Ints) -> Iterator[tuple[Ints, World]]:
    """Yield what is left of a world, and in which of the rows."""
    expiries = {o.expires_ns for o in world if 0 < o.expires_ns <= tick_ns[-1]}
    edges = sorted({int(np.searchsorted(tick_ns, e)) for e in expiries} - {0})
    for part, times in zip(np.split(rows, edges), np.split(tick_ns, edges), strict=True):
        now = int(times[0])
        left = tuple(o for o in world if not 0 < o.expires_ns <= now) if expiries else world
        yield part, left


def _obstacle(values: tuple[Any, ...]) -> Obstacle:
    """Return an obstacle of the controller's world."""
    number, shape, p, quat, radius, size, v, omega, time_ns, expires_ns, vertices, owner = values
    corners = tuple(zip(*[iter(vertices)] * 3, strict=True))
    return Obstacle(
        id=number,
        p=tuple(p),
        radius=radius,
        session=owner,
        shape=shape,
        quat=quat,
        size=tuple(size),
        v=v,
        omega=omega,
        vertices=corners,
        time_ns=time_ns,
        expires_ns=expires_ns,
    )


def _runs_by_message(
    log: Log, told: list[tuple[int, str, int]], commands: Commands
) -> dict[int, list[Ints]]:
    """Return for messages, by their place among all, the runs of ticks that saw them last."""
    places = defaultdict(list)
    heads = {name: table.rows["h"] for name, table in log.told.items()}
    numbers = {n: (h["session"].tolist(), h["seq"].tolist()) for n, h in heads.items()}
    for place, (_, name, row) in enumerate(told):
        session, seq = numbers[name]
        places[_CHANNELS[name], session[row], seq[row]].append(place)
    keys = np.stack([commands.world_channel, commands.world_session, commands.world_seq])
    starts = np.flatnonzero(np.r_[True, np.any(keys[:, 1:] != keys[:, :-1], axis=0)])
    out: dict[int, list[Ints]] = defaultdict(list)
    for start, end in zip(starts, np.r_[starts[1:], len(commands)], strict=True):
        candidates = places.get(tuple(keys[:, start].tolist()), [])
        # Of one that came again the last before the tick; a log may hold it a little later.
        earlier = [p for p in candidates if told[p][0] < commands.order[start]]
        if candidates:
            out[earlier[-1] if earlier else candidates[0]].append(np.arange(start, end))
    return out


def _without_gaps(worlds: list[World], index: Ints, commands: Commands) -> WorldLine:
    """Give ticks whose message is missing the world before; drop worlds that no tick saw."""
    heard = commands.world_session != 0
    unknown = int(((index < 0) & heard).sum())
    last = np.maximum.accumulate(np.where(index < 0, -1, np.arange(len(index))))
    filled = np.where(last < 0, 0, index[np.maximum(last, 0)])
    used, renumbered = np.unique(filled, return_inverse=True)
    return WorldLine([worlds[i] for i in used], renumbered.astype(np.int64), unknown)
