"""The set of obstacles over a run, replayed from the OBSTACLES and HULL messages of its log.

Follows the rules of the controller's own world (lib/collision/world.c, lib/bus/wire.c), so that
the set of every tick is the one which that tick saw.

Units are metres, positions in the base frame of the arm.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import cast

import numpy as np

from leeway.logs.log import Commands, Floats, Hulls, Ints, Obstacles
from leeway.logs.solids import HULL as HULL_SHAPE
from leeway.logs.solids import Obstacle, Triple, distances_to, is_usable

WORLD_MAX = 10000
CHANGE_MAX = 32
VERTICES_MAX = 64
UPSERT, REMOVE, REPLACE, CLEAR = range(4)
OBSTACLES, HULL = 1, 2  # world_channel of a command

_CHUNK = 1 << 20  # distances computed at once: bounds the memory

World = tuple[Obstacle, ...]


@dataclass(frozen=True)
class WorldLine:
    """Worlds in the order in which they came, and which of them each tick saw."""

    worlds: list[World]
    index: Ints  # (n,) into worlds
    unknown_ticks: int  # ticks that saw a message which the log lacks: the world before it is taken


def follow(messages: Obstacles, hulls: Hulls, commands: Commands) -> WorldLine:
    """Return the obstacles that each command had seen.

    Commands name the newest message taken in by (world_channel, world_session, world_seq); logger
    times play no part.

    Parameters
    ----------
    messages, hulls
        All OBSTACLES and HULL of a log.
    commands
        n commands of one controller, in its order.
    """
    history = _replay(messages, hulls)
    keys = np.stack([commands.world_channel, commands.world_session, commands.world_seq])
    starts = np.flatnonzero(np.r_[True, np.any(keys[:, 1:] != keys[:, :-1], axis=0)])
    ends = np.r_[starts[1:], len(commands)]
    worlds: list[World] = [()]
    index = np.zeros(len(commands), dtype=np.int64)
    unknown = 0
    for start, end in zip(starts, ends, strict=True):
        channel, session, seq = (int(key) for key in keys[:, start])
        seen = _newest(history.get((channel, session, seq), []), int(commands.order[start]))
        if seen is None:
            unknown += int(end - start)
            index[start:end] = len(worlds) - 1
            continue
        for part, world in _not_expired(seen, commands.tick_ns[start:end]):
            if world != worlds[-1]:
                worlds.append(world)
            index[start + part.start : start + part.stop] = len(worlds) - 1
    return _without_unused(worlds, index, unknown)


def _not_expired(world: World, tick_ns: Ints) -> Iterator[tuple[slice, World]]:
    """Yield what is left of a world, and in which ticks."""
    expiries = {o.expires_ns for o in world if 0 < o.expires_ns <= tick_ns[-1]}
    edges = sorted({0, len(tick_ns), *(int(np.searchsorted(tick_ns, e)) for e in expiries)})
    for start, stop in pairwise(edges):
        now = int(tick_ns[start])
        left = tuple(o for o in world if not 0 < o.expires_ns <= now) if expiries else world
        yield slice(start, stop), left


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
    to_surface = distances_to(points, world)
    at = np.argmin(to_surface, axis=-1)
    ids = np.array([o.id for o in world])[at]
    return np.take_along_axis(to_surface, at[..., None], axis=-1)[..., 0], ids


# --- messages ---

Key = tuple[int, int, int]  # channel, session, seq


@dataclass(frozen=True)
class _Change:
    """A message as the world takes it."""

    order: int
    key: Key
    op: int
    time_ns: int
    entries: list[Obstacle] | None  # None: something is out of range


def _replay(messages: Obstacles, hulls: Hulls) -> dict[Key, list[tuple[int, World]]]:
    """Return the worlds after each message, with its place in the log."""
    history: dict[Key, list[tuple[int, World]]] = {}
    world: dict[int, Obstacle] = {}
    newest: dict[tuple[int, int], int] = {}
    for change in sorted(_changes(messages, hulls), key=lambda change: change.order):
        sender, seq = change.key[:2], change.key[2]
        before = newest.get(sender, 0)
        # Overtaken: the controller refuses it. Repeated: it is heard again and changes nothing.
        after = world if seq == before else _apply(world, change)
        if seq < before or after is None:
            continue
        newest[sender] = seq
        world = after
        history.setdefault(change.key, []).append((change.order, tuple(world.values())))
    return history


def _changes(messages: Obstacles, hulls: Hulls) -> Iterator[_Change]:
    for row in range(len(messages)):
        key = (OBSTACLES, int(messages.session[row]), int(messages.seq[row]))
        op, time_ns = int(messages.op[row]), int(messages.time_ns[row])
        yield _Change(int(messages.order[row]), key, op, time_ns, _entries(messages, row))
    for row in range(len(hulls)):
        key = (HULL, int(hulls.session[row]), int(hulls.seq[row]))
        time_ns = int(hulls.time_ns[row])
        yield _Change(int(hulls.order[row]), key, UPSERT, time_ns, _hull(hulls, row))


def _apply(world: dict[int, Obstacle], change: _Change) -> dict[int, Obstacle] | None:
    """Return the set after one message, None when the controller refuses that message."""
    if change.entries is None:
        return None
    session, listed = change.key[1], {o.id for o in change.entries}
    if change.op == CLEAR:
        return {}
    if change.op == REMOVE:
        return {i: o for i, o in world.items() if i not in listed}
    entries = {o.id: o for o in change.entries}
    for number, entry in entries.items():
        if entry.shape == HULL_SHAPE and not entry.vertices:
            # Named without vertices: it keeps those it has.
            if number not in world or world[number].shape != HULL_SHAPE:
                return None
            entries[number] = replace(entry, vertices=world[number].vertices)
    kept = {
        i: o
        for i, o in world.items()
        if (change.op == UPSERT or o.session != session or i in listed)
        and not (o.session == session and 0 < o.expires_ns <= change.time_ns)
    }
    after = kept | entries
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
    entries = [_obstacle(messages, (row, i), row) for i in range(count)]
    usable = all(o.id > 0 and (op == REMOVE or is_usable(o)) for o in entries)
    return entries if usable and len({o.id for o in entries}) == count else None


def _hull(hulls: Hulls, row: int) -> list[Obstacle] | None:
    """Return the hull of a message, None when anything of it is out of range."""
    if hulls.session[row] <= 0 or hulls.seq[row] <= 0 or not 1 <= hulls.n[row] <= VERTICES_MAX:
        return None
    vertices = tuple(_triple(v) for v in hulls.vertex[row, : hulls.n[row]])
    hull = replace(_obstacle(hulls, row, row), vertices=vertices)
    return [hull] if hull.id > 0 and hull.shape == HULL_SHAPE and is_usable(hull) else None


def _obstacle(m: Obstacles | Hulls, at: int | tuple[int, int], row: int) -> Obstacle:
    valid_ns = int(m.valid_for_ms[row]) * 1_000_000
    return Obstacle(
        id=int(m.id[at]),
        p=_triple(m.p[at]),
        radius=float(m.radius[at]),
        session=int(m.session[row]),
        shape=int(m.shape[at]),
        quat=tuple(m.quat[at].tolist()),
        size=_triple(m.size[at]),
        v=_triple(m.v[at]),
        omega=_triple(m.omega[at]),
        expires_ns=int(m.time_ns[row]) + valid_ns if valid_ns > 0 else 0,
    )


def _triple(values: Floats) -> Triple:
    return cast(Triple, tuple(values.tolist()))


def _newest(candidates: list[tuple[int, World]], before: int) -> World | None:
    """Return the last world that came before a place in the log, else the first one."""
    earlier = [world for order, world in candidates if order < before]
    return earlier[-1] if earlier else candidates[0][1] if candidates else None


def _without_unused(worlds: list[World], index: Ints, unknown: int) -> WorldLine:
    used, index = np.unique(index, return_inverse=True)
    return WorldLine([worlds[i] for i in used], index.astype(np.int64), unknown)
