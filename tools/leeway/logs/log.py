"""LCM logs of runs: decoding, columns.

The layout of the messages comes from the generated `leeway_lcm` classes.

Units are SI (m, rad, s) except where a name ends in `_ns` or `_us`, and `utime` (us since 1970).
"""

from __future__ import annotations

import os
import re
import struct
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import numpy as np
from leeway_lcm import leeway as _generated
from numpy.typing import NDArray

from leeway import _native
from leeway.logs.framing import LogError as LogError  # callers of this module catch it
from leeway.logs.framing import open_events
from leeway.logs.messages import Commands as Commands  # callers take all of them from here
from leeway.logs.messages import Floats as Floats
from leeway.logs.messages import Goals as Goals
from leeway.logs.messages import Hulls as Hulls
from leeway.logs.messages import Ints as Ints
from leeway.logs.messages import Messages as Messages
from leeway.logs.messages import MessagesT as MessagesT
from leeway.logs.messages import Obstacles as Obstacles
from leeway.logs.messages import SceneMessage as SceneMessage
from leeway.logs.messages import States as States
from leeway.logs.messages import Statuses as Statuses
from leeway.logs.messages import Stops as Stops

wire = cast(Any, _generated)  # generated code carries no types: this is where they end

_FINGERPRINT = 8  # bytes
_ROBOT_CHANNEL = re.compile(
    r"(?:(.+)_)?"
    r"(JOINT_STATE|JOINT_COMMAND|GOAL|STOP|SCENE|WORLD|WORLD_HULL|STATUS|PLANT_STATUS)"
)
SHARED = ("OBSTACLES", "HULL")  # by all robots of a bus
_SCALARS = {"int8_t": ">i1", "int32_t": ">i4", "int64_t": ">i8", "double": ">f8"}
_FIXED = {
    "JOINT_STATE": wire.joint_state_t,
    "JOINT_COMMAND": wire.joint_command_t,
    "OBSTACLES": wire.obstacles_t,
    "HULL": wire.hull_t,
    "GOAL": wire.goal_t,
    "STOP": wire.stop_t,
    "WORLD": wire.obstacles_t,
    "WORLD_HULL": wire.hull_t,
    "STATUS": wire.status_t,
    "PLANT_STATUS": wire.status_t,
}


@dataclass(frozen=True)
class Table:
    """The messages of one channel as they are on the wire, one behind the other."""

    order: Ints  # place of each in the log, from 0, counted over all channels
    data: bytes
    rows: NDArray[np.void]  # the same bytes, as fields by name; big-endian

    def __len__(self) -> int:
        return len(self.order)

    def message(self, row: int) -> bytes:
        """Return the bytes of one message, fingerprint included."""
        size = len(self.data) // len(self)
        return self.data[row * size : (row + 1) * size]


@dataclass(frozen=True)
class Tables:
    """The messages of one robot in a log, undecoded."""

    path: Path
    robot: str  # prefix of its channels, "" = none
    truncated: int  # bytes behind the last whole event
    counts: dict[str, int]  # whole events per channel, foreign ones too
    undecodable: dict[str, int]  # of those, messages of another layout, per channel
    scenes: list[SceneMessage]
    tables: dict[str, Table]  # by channel without prefix


@dataclass(frozen=True)
class Log:
    """The messages of one robot in a log."""

    path: Path
    robot: str  # prefix of its channels, "" = none
    truncated: int  # bytes behind the last whole event
    counts: dict[str, int]  # whole events per channel, foreign ones too
    undecodable: dict[str, int]  # of those, messages that programs refuse, per channel
    scenes: list[SceneMessage]
    states: States
    commands: Commands
    obstacles: Obstacles
    hulls: Hulls
    goals: Goals
    stops: Stops
    worlds: Obstacles  # WORLD: the obstacles as the controller tells them
    world_hulls: Hulls  # WORLD_HULL
    told: dict[str, Table]  # OBSTACLES and HULL as they are on the wire
    statuses: Statuses  # of controllers
    plant_statuses: Statuses  # of simulators


def read_log(path: str | os.PathLike[str], name: str | None = None) -> Log:
    """Read the messages of one robot from an LCM log.

    Streams the file; memory is about the size of the messages. A log that was cut in mid-event
    is read up to its last whole event, and `Log.truncated` counts the bytes behind it. Foreign
    channels are skipped and counted, and so are messages that the programs themselves refuse: of
    another layout, or with values out of range.

    Parameters
    ----------
    path
        File that lcm-logger wrote.
    name
        Robot's prefix of channels (NAME_JOINT_STATE); None takes the only robot there is.

    Raises
    ------
    LogError
        The file cannot be read, is no LCM log, or holds no joint state of that robot.
    """
    tables = read_tables(path, name)
    by_name = {channel: _taken(channel, table) for channel, table in tables.tables.items()}
    refused = {
        _channel(tables.robot, channel): len(table) - len(by_name[channel])
        for channel, table in tables.tables.items()
        if len(by_name[channel]) < len(table)
    }
    return Log(
        path=tables.path,
        robot=tables.robot,
        truncated=tables.truncated,
        counts=tables.counts,
        undecodable=dict(Counter(tables.undecodable) + Counter(refused)),
        scenes=tables.scenes,
        states=_columns(by_name["JOINT_STATE"], States),
        commands=_columns(by_name["JOINT_COMMAND"], Commands),
        obstacles=_columns(by_name["OBSTACLES"], Obstacles),
        hulls=_columns(by_name["HULL"], Hulls),
        goals=_columns(by_name["GOAL"], Goals),
        stops=_columns(by_name["STOP"], Stops),
        worlds=_columns(by_name["WORLD"], Obstacles),
        world_hulls=_columns(by_name["WORLD_HULL"], Hulls),
        told={name: by_name[name] for name in SHARED},
        statuses=_columns(by_name["STATUS"], Statuses),
        plant_statuses=_columns(by_name["PLANT_STATUS"], Statuses),
    )


def read_tables(path: str | os.PathLike[str], name: str | None = None) -> Tables:
    """Read the messages of one robot as bytes; arguments and errors as in `read_log`."""
    path = Path(path)
    raw = _scan(path)
    return _sort(path, raw, _choose_robot(path, raw, name))


# --- collecting ---


@dataclass
class _Raw:
    """Undecoded messages of Leeway's channels."""

    counts: Counter[str] = field(default_factory=Counter)
    order: defaultdict[str, list[int]] = field(default_factory=lambda: defaultdict(list))
    data: defaultdict[str, list[bytes]] = field(default_factory=lambda: defaultdict(list))
    left: int = 0


def _scan(path: Path) -> _Raw:
    """Collect the messages of whole events."""
    raw = _Raw()
    with open_events(path) as events:
        for number, (_, _, channel, data) in enumerate(events):
            raw.counts[channel] += 1
            if channel in SHARED or _ROBOT_CHANNEL.fullmatch(channel):
                raw.order[channel].append(number)
                raw.data[channel].append(data)
        raw.left = events.left
    return raw


# --- decoding ---


def _dtype(kind: Any) -> np.dtype[Any]:
    """Return the layout of a generated message of fixed size."""
    rows = zip(kind.__slots__, kind.__typenames__, kind.__dimensions__, strict=True)
    return np.dtype(
        [(name, _scalar(typename), tuple(shape or ())) for name, typename, shape in rows]
    )


def _scalar(typename: str) -> Any:
    known = _SCALARS.get(typename)
    return known if known else _dtype(getattr(wire, typename.rsplit(".", 1)[1]))


_LAYOUT = {name: _dtype(kind) for name, kind in _FIXED.items()}
_MESSAGE = {
    name: np.dtype([("fingerprint", ">i8"), ("body", layout)]) for name, layout in _LAYOUT.items()
}


def _fingerprint(name: str) -> bytes:
    return cast(bytes, _FIXED[name]._get_packed_fingerprint())


def _fits(name: str, data: bytes) -> bool:
    size = _FINGERPRINT + _LAYOUT[name].itemsize
    return len(data) == size and data[:_FINGERPRINT] == _fingerprint(name)


def _channel(robot: str, name: str) -> str:
    return f"{robot}_{name}" if robot and name not in SHARED else name


def _choose_robot(path: Path, raw: _Raw, name: str | None) -> str:
    """Return the prefix of the robot to read; it has at least one joint state."""
    found = {}
    for channel in raw.data:
        match = _ROBOT_CHANNEL.fullmatch(channel)
        if match and match[2] == "JOINT_STATE":
            found[match[1] or ""] = any(_fits("JOINT_STATE", data) for data in raw.data[channel])
    robots = sorted(robot for robot, usable in found.items() if usable)
    if not robots:
        raise LogError(f"{path}: {_why_no_robot(raw, list(found))}")
    if name is not None and name not in robots:
        raise LogError(f"{path}: no robot {name!r} in it: {_listed(robots)}")
    if name is None and len(robots) > 1:
        raise LogError(f"{path}: several robots in it, name one: {_listed(robots)}")
    return robots[0] if name is None else name


def _why_no_robot(raw: _Raw, prefixes: list[str]) -> str:
    """Say what a log without a usable joint state has instead."""
    if not prefixes:
        return "no JOINT_STATE in it: record with lcm-logger while controller and simulator run"
    data = raw.data[_channel(prefixes[0], "JOINT_STATE")][0]
    return (
        "its JOINT_STATE has another layout: expected fingerprint "
        f"{_fingerprint('JOINT_STATE').hex()}, found {data[:_FINGERPRINT].hex() or 'no data'}: "
        "read it with the version of Leeway that recorded it"
    )


def _listed(robots: list[str]) -> str:
    return "found " + ", ".join(robot or "one without a name" for robot in robots)


def _sort(path: Path, raw: _Raw, robot: str) -> Tables:
    """Make a table of each channel of a robot, of the messages that have the right layout."""
    undecodable: dict[str, int] = {}
    tables = {}
    for name in _FIXED:
        channel = _channel(robot, name)
        tables[name] = _table(name, raw.order[channel], raw.data.pop(channel, []))
        if len(tables[name]) < len(raw.order[channel]):
            undecodable[channel] = len(raw.order[channel]) - len(tables[name])
    scene_channel = _channel(robot, "SCENE")
    scenes = [scene for data in raw.data[scene_channel] if (scene := _decode_scene(data))]
    if len(scenes) < len(raw.data[scene_channel]):
        undecodable[scene_channel] = len(raw.data[scene_channel]) - len(scenes)
    counts = dict(sorted(raw.counts.items()))
    return Tables(path, robot, raw.left, counts, undecodable, scenes, tables)


def _table(name: str, order: list[int], messages: list[bytes]) -> Table:
    fits = [k for k, data in enumerate(messages) if _fits(name, data)]
    data = b"".join(messages[k] for k in fits)
    return Table(np.array([order[k] for k in fits], dtype=np.int64), data, as_rows(name, data))


def _taken(name: str, table: Table) -> Table:
    """Return the messages of a table that a program would take, by the programs' own checks."""
    verdicts = np.frombuffer(_native.acceptable(name, table.data), dtype=np.bool_)
    if verdicts.all():
        return table
    data = b"".join(table.message(k) for k, taken in enumerate(verdicts) if taken)
    return Table(table.order[verdicts], data, as_rows(name, data))


def as_rows(name: str, data: bytes) -> NDArray[np.void]:
    """Return messages of a channel as fields by name, without copying them.

    Parameters
    ----------
    name
        Channel without a robot's prefix.
    data
        Whole messages, one behind the other.
    """
    rows: NDArray[np.void] = np.frombuffer(data, dtype=_MESSAGE[name])["body"]
    return rows


def _columns(table: Table, kind: type[MessagesT]) -> MessagesT:
    """Turn messages of one layout into columns of this machine's own byte order."""
    rows = table.rows
    names = rows.dtype.names or ()
    flat = {name: rows[name] for name in names if name not in ("h", "o")}
    for group in ("h", "o"):
        if group in names:
            flat |= {name: rows[group][name] for name in rows[group].dtype.names or ()}
    columns = {
        name: values.astype("f8" if values.dtype.kind == "f" else "i8")
        for name, values in flat.items()
    }
    return kind(order=table.order, **columns)


def _decode_scene(data: bytes) -> SceneMessage | None:
    """Decode SCENE, whose texts have no fixed size. None when it is no such message."""
    try:
        m = wire.scene_t.decode(data)
    except (ValueError, struct.error, IndexError):
        return None
    return SceneMessage(m.h.session, m.h.mono_ns, m.program, m.build, m.mode, m.file, m.yaml)
