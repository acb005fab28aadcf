"""What happened in a run, as a list for people.

Units are s of motion and m.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from leeway.logs.log import Floats, Log, Messages
from leeway.logs.motion import MOVING, STOPPING, Motion
from leeway.logs.world import Obstacle, World, WorldLine

STOPPED, STALE, NOT_FINITE = 8, 16, 32
_OTHERS_SHOWN = 10  # other sessions of controllers or of plants that are events of their own
MERGE_S = 0.5  # moves of an obstacle that follow one another this closely are one event


@dataclass
class Event:
    """One thing that happened."""

    t: float  # s of motion; below 0 or beyond the end for what happened outside of it
    kind: str  # start, obstacle, goal, stop, stale, plant, restart, end, log
    text: str


def list_events(
    log: Log, motion: Motion, line: WorldLine, goal: Floats, duration: float
) -> list[Event]:
    """Return the events of a run in the order of time.

    Parameters
    ----------
    goal : (n, 3) m
        Goal in force at each of the n ticks.
    duration
        Length of the scene, s.
    """
    sources = {scene.session: scene.program for scene in log.scenes}
    events = [
        Event(
            float(motion.t[0]),
            "start",
            f"motion starts: first command obeyed, goal {_point(goal[0])}",
        )
    ]
    events += _obstacle_events(motion.t, line, sources)
    events += _goal_events(log, motion, goal)
    events += _flag_events(motion)
    events += _plant_events(motion)
    events += _restarts(log, motion)
    events += _ending(motion, duration)
    events.sort(key=lambda event: event.t)
    if log.truncated:
        last = max(events[-1].t, float(motion.t[-1]))
        events.append(
            Event(
                last, "log", f"log is cut here: {log.truncated} bytes behind the last whole event"
            )
        )
    return events


def _point(p: Floats | tuple[float, float, float]) -> str:
    return "(" + ", ".join(f"{float(v):g}" for v in np.round(p, 4)) + ") m"


def _shape(obstacle: Obstacle) -> str:
    size = f"sphere of radius {obstacle.radius:g} m" if obstacle.radius else "point"
    return f"{size} at {_point(obstacle.p)}"


# --- obstacles ---


def _obstacle_events(t: Floats, line: WorldLine, sources: dict[int, str]) -> list[Event]:
    """Return what was there at the start and every change, a series of moves as one event."""
    events: list[Event] = []
    runs: dict[
        int, tuple[Event, str, float, int]
    ] = {}  # id -> event of the moves, its start, last time, count
    rows = np.r_[0, np.flatnonzero(np.diff(line.index)) + 1]
    before: World = ()
    for row in rows:
        now, time = line.worlds[line.index[row]], float(t[row])
        for number, text, moved in _changes(before, now, sources, first=row == 0):
            run = runs.get(number)
            if moved and run and time - run[2] <= MERGE_S:
                event, start, _, count = run
                event.text = f"{start}; {count} more moves until {time:.3f} s: {text}"
                runs[number] = (event, start, time, count + 1)
                continue
            event = Event(time, "obstacle", f"obstacle {number} {text}")
            events.append(event)
            runs.pop(number, None)
            if moved:
                runs[number] = (event, event.text, time, 1)
        before = now
    return events


def _changes(
    before: World, now: World, sources: dict[int, str], first: bool
) -> Iterator[tuple[int, str, bool]]:
    """Yield id, text and whether it only changed, for each difference of two worlds."""
    old, new = {o.id: o for o in before}, {o.id: o for o in now}
    for number in sorted(old.keys() | new.keys()):
        if number not in new:
            yield number, "removed", False
        elif number not in old:
            verb = "known at the start" if first else "added"
            source = sources.get(
                new[number].session, f"another source, session {new[number].session}"
            )
            yield number, f"{verb}: {_shape(new[number])}, from {source}", False
        elif (old[number].p, old[number].radius) != (new[number].p, new[number].radius):
            yield number, f"changed: now {_shape(new[number])}", True


# --- requests ---


def _goal_events(log: Log, motion: Motion, goal: Floats) -> list[Event]:
    rows = np.flatnonzero(np.any(goal[1:] != goal[:-1], axis=1)) + 1
    events = [
        Event(float(motion.t[row]), "goal", f"goal changed to {_point(goal[row])}") for row in rows
    ]
    events += _not_obeyed(log.goals, motion, "goal")
    events += _not_obeyed(log.stops, motion, "stop")
    return events


def _not_obeyed(messages: Messages, motion: Motion, kind: str) -> Iterator[Event]:
    """Yield the requests that came during the motion and that no command echoes."""
    c = motion.commands
    echoed = set(zip(c.request_session.tolist(), c.request_seq.tolist(), strict=True))
    asked: set[tuple[int, int]] = set()
    for row in range(len(messages)):
        stamp = (int(messages.session[row]), int(messages.seq[row]))
        mono = int(messages.mono_ns[row])
        during = int(c.mono_ns[0]) <= mono < int(c.mono_ns[-1])
        if stamp in asked or not during:
            continue
        asked.add(stamp)
        newer = bool(np.any(c.mono_ns[1:] > mono))
        stopped = np.any((c.flags & STOPPED != 0) & (c.mono_ns > mono))
        if newer and (stamp not in echoed or (kind == "stop" and not stopped)):
            yield Event(
                motion.time_of(mono), kind, f"{kind} asked for by session {stamp[0]}, not obeyed"
            )


def _spans(active: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> list[tuple[int, int]]:
    """Return first and last row of every run of True."""
    edges = np.diff(np.r_[0, active.astype(np.int8), 0])
    return list(zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1, strict=True))


def _flag_events(motion: Motion) -> Iterator[Event]:
    kinds = {
        STOPPED: ("stop", "stop request obeyed: braked to rest"),
        STALE: ("stale", "no fresh joint state: braked"),
        NOT_FINITE: ("stale", "a value was no number: braked"),
    }
    for bit, (kind, text) in kinds.items():
        for first, last in _spans((motion.commands.flags & bit) != 0):
            start, end = float(motion.t[first]), float(motion.t[last])
            yield Event(start, kind, f"{text}, {last - first + 1} ticks until {end:.3f} s")


# --- processes ---


def _plant_events(motion: Motion) -> Iterator[Event]:
    """Yield when commands ceased for the plant, and when it obeyed again."""
    mode = motion.states.plant_mode
    for first, last in _spans(mode == STOPPING):
        at_end = last == len(mode) - 1
        again = "" if at_end else f"; commands again at {float(motion.plant_t[last + 1]):.3f} s"
        yield Event(
            float(motion.plant_t[first]),
            "plant",
            f"commands ceased: the plant ramps to rest{again}",
        )


def _restarts(log: Log, motion: Motion) -> Iterator[Event]:
    """Yield the other sessions of controllers and plants in the log."""
    for what, messages, chosen in (
        ("controller", log.commands, motion.controller),
        ("plant", log.states, motion.plant),
    ):
        others = messages.take(messages.session != chosen)
        sessions, first, counts = np.unique(others.session, return_index=True, return_counts=True)
        order = np.argsort(first)
        for k in order[:_OTHERS_SHOWN]:
            text = f"another {what}, session {sessions[k]}, {counts[k]} messages: not counted here"
            yield Event(motion.time_of(int(others.mono_ns[first[k]])), "restart", text)
        if left := order[_OTHERS_SHOWN:].tolist():
            text = f"{len(left)} more {what}s, {counts[left].sum()} messages: not counted here"
            yield Event(motion.time_of(int(others.mono_ns[first[left[0]]])), "restart", text)


def _ending(motion: Motion, duration: float) -> Iterator[Event]:
    end = float(motion.t[-1])
    if end > duration + motion.period / 2:
        yield Event(
            end, "end", f"end of the motion, which went on after the scene's {duration:g} s"
        )
    elif end >= duration - motion.period / 2:
        yield Event(end, "end", f"end of the scene: {duration:g} s of motion")
    elif motion.commands_after:
        text = f"joint states end {duration - end:.3f} s before the scene does: is the plant gone?"
        yield Event(end, "end", f"{text} {motion.commands_after} commands follow")
    elif motion.states.plant_mode[-1] != MOVING:
        yield Event(end, "end", f"commands end {duration - end:.3f} s before the scene does")
    else:
        yield Event(end, "end", f"the log ends {duration - end:.3f} s before the scene does")
