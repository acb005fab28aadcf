"""The set of obstacles over a run, replayed from the OBSTACLES messages of its log.

Follows the rules of the controller's own world (lib/collision/world.c, lib/bus/wire.c), so that
the set of every tick is the one which that tick saw.

Units are metres, positions in the base frame of the arm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from leeway.logs.log import Commands, Floats, Ints, Obstacles

WORLD_MAX = 256
CHANGE_MAX = 32
POSITION_MAX = 100.0
UPSERT, REMOVE, REPLACE, CLEAR = range(4)

_CHUNK = 1 << 20  # distances computed at once: bounds the memory


@dataclass(frozen=True)
class Obstacle:
    """A point (radius 0) or a sphere."""

    id: int
    p: tuple[float, float, float]
    radius: float
    session: int  # the source that sent it last


World = tuple[Obstacle, ...]


@dataclass(frozen=True)
class WorldLine:
    """Worlds in the order in which they came, and which of them each tick saw."""

    worlds: list[World]
    index: Ints  # (n,) into worlds
    unknown_ticks: int  # ticks that saw a message which the log lacks: the world before it is taken


def follow(messages: Obstacles, commands: Commands) -> WorldLine:
    """Return the obstacles that each command had seen.

    Commands name the newest message taken in by (world_session, world_seq); logger times play
    no part.

    Parameters
    ----------
    messages
        All OBSTACLES of a log.
    commands
        n commands of one controller, in its order.
    """
    history = _replay(messages)
    keys = np.stack([commands.world_session, commands.world_seq])
    starts = np.flatnonzero(np.r_[True, np.any(keys[:, 1:] != keys[:, :-1], axis=0)])
    ends = np.r_[starts[1:], len(commands)]
    worlds: list[World] = [()]
    index = np.zeros(len(commands), dtype=np.int64)
    unknown = 0
    for start, end in zip(starts, ends, strict=True):
        seen = _newest(
            history.get((int(keys[0, start]), int(keys[1, start])), []), int(commands.order[start])
        )
        if seen is None:
            unknown += int(end - start)
        elif seen != worlds[-1]:
            worlds.append(seen)
        index[start:end] = len(worlds) - 1
    return _without_unused(worlds, index, unknown)


def nearest(points: Floats, line: WorldLine) -> tuple[Floats, Ints]:
    """Distance of every point to the nearest surface, and whose surface that is.

    Parameters
    ----------
    points : (n, 6, 3) m
    line
        Worlds of the n ticks.

    Returns
    -------
    distance : (n, 6) m
        Negative inside an obstacle, NaN where there is none.
    obstacle : (n, 6)
        Its id, 0 where there is none.
    """
    distance = np.full(points.shape[:2], np.nan)
    obstacle = np.zeros(points.shape[:2], dtype=np.int64)
    edges = np.flatnonzero(np.diff(line.index)) + 1
    for rows in np.split(np.arange(len(points)), edges):
        world = line.worlds[line.index[rows[0]]] if len(rows) else ()
        if world:
            parts = max(1, len(rows) * 6 * len(world) // _CHUNK)
            for part in np.array_split(rows, parts):
                distance[part], obstacle[part] = _nearest_in(points[part], world)
    return distance, obstacle


def _nearest_in(points: Floats, world: World) -> tuple[Floats, Ints]:
    centres = np.array([o.p for o in world])
    to_surface = np.linalg.norm(points[:, :, None] - centres, axis=-1) - [o.radius for o in world]
    at = np.argmin(to_surface, axis=-1)
    ids = np.array([o.id for o in world])[at]
    return np.take_along_axis(to_surface, at[..., None], axis=-1)[..., 0], ids


def _replay(messages: Obstacles) -> dict[tuple[int, int], list[tuple[int, World]]]:
    """Return the worlds after each message, with its place in the log, by (session, seq)."""
    history: dict[tuple[int, int], list[tuple[int, World]]] = {}
    world: dict[int, Obstacle] = {}
    newest: dict[int, int] = {}
    for row in range(len(messages)):
        key = (int(messages.session[row]), int(messages.seq[row]))
        before = newest.get(key[0], 0)
        # Overtaken: the controller refuses it. Repeated: it is heard again and changes nothing.
        after = world if key[1] == before else _apply(world, messages, row)
        if key[1] < before or after is None:
            continue
        newest[key[0]] = key[1]
        world = after
        history.setdefault(key, []).append((int(messages.order[row]), tuple(world.values())))
    return history


def _apply(world: dict[int, Obstacle], messages: Obstacles, row: int) -> dict[int, Obstacle] | None:
    """Return the set after one message, None when the controller refuses that message."""
    op, session = int(messages.op[row]), int(messages.session[row])
    entries = _entries(messages, row)
    if entries is None:
        return None
    listed = {o.id for o in entries}
    if op == CLEAR:
        return {}
    if op == REMOVE:
        return {i: o for i, o in world.items() if i not in listed}
    kept = {i: o for i, o in world.items() if op == UPSERT or o.session != session or i in listed}
    after = kept | {o.id: o for o in entries}
    return after if len(after) <= WORLD_MAX else None


def _entries(messages: Obstacles, row: int) -> list[Obstacle] | None:
    """Return the used entries of a message, None when anything of it is out of range."""
    op, session, count = (
        int(values[row]) for values in (messages.op, messages.session, messages.n)
    )
    if session <= 0 or messages.seq[row] <= 0:
        return None
    if not UPSERT <= op <= CLEAR or not 0 <= count <= CHANGE_MAX:
        return None
    entries = []
    for i in range(count):
        x, y, z = (float(v) for v in messages.p[row, i])
        entries.append(
            Obstacle(int(messages.id[row, i]), (x, y, z), float(messages.radius[row, i]), session)
        )
    usable = all(o.id > 0 and (op == REMOVE or _in_range(o)) for o in entries)
    return entries if usable and len({o.id for o in entries}) == count else None


def _in_range(obstacle: Obstacle) -> bool:
    values = (*obstacle.p, obstacle.radius)
    return all(math.isfinite(v) and abs(v) <= POSITION_MAX for v in values) and obstacle.radius >= 0


def _newest(candidates: list[tuple[int, World]], before: int) -> World | None:
    """Return the last world that came before a place in the log, else the first one."""
    earlier = [world for order, world in candidates if order < before]
    return earlier[-1] if earlier else candidates[0][1] if candidates else None


def _without_unused(worlds: list[World], index: Ints, unknown: int) -> WorldLine:
    used, index = np.unique(index, return_inverse=True)
    return WorldLine([worlds[i] for i in used], index.astype(np.int64), unknown)
