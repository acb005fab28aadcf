"""What happened in a run, as a list for people.

Units are s of motion and m.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from leeway.logs.log import Floats, Ints, Log, Messages, Statuses
from leeway.logs.motion import ENDED, HOLD, MOVING, STOPPING, Motion
from leeway.logs.programs import statuses_of
from leeway.logs.world import World, WorldLine
from leeway.status import fault_names

STOPPED, STALE, NOT_FINITE, FOREIGN, CONTACT = 8, 16, 32, 128, 1024
ASIDE = 4  # law_outcome
BEFORE, DURING, AFTER = range(3)  # the motion
_OTHERS_SHOWN = 10  # other sessions of controllers or of plants that are events of their own
FAULT_S = 1.0  # a status tells the faults of the second before it
MERGE_S = 0.5  # moves of an obstacle that follow one another this closely are one event


@dataclass
class Event:
    """One thing that happened."""

    t: float  # s of motion; below 0 or beyond the end for what happened outside of it
    kind: str  # start, obstacle, goal, stop, stuck, contact, stale, foreign, fault, plant, ...
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
    sources = {motion.plant: "the plant"} | {s.session: s.program for s in log.scenes}
    events = list(_beginning(motion, goal))
    events += _obstacle_events(motion.t, line, sources)
    events += _goal_events(log, motion, goal)
    events += _flag_events(motion)
    events += _stuck_events(motion)
    events += _plant_events(motion)
    for program, statuses in statuses_of(log, motion).items():
        events += _fault_events(program, statuses, motion)
        events += _takeovers(program, statuses, motion)
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


def _beginning(motion: Motion, goal: Floats) -> Iterator[Event]:
    """Yield what kind of log it is when it is no recorder's, and how the motion starts."""
    start, heard = float(motion.t[0]), motion.heard
    if motion.post_mortem:
        begin = motion.times_of(motion.before.mono_ns[:1]).min(initial=start)
        text = "post-mortem log: what the controller was given and commanded around a fault"
        yield Event(float(begin), "log", text)
    what = "motion starts: first command obeyed"
    if not motion.obeyed:
        what = "first command that asks for motion; the plant obeyed none"
    elif heard.command_session[0] == motion.controller and heard.plant_mode[0] != HOLD:
        what = f"the log starts in mid-motion, at tick {motion.commands.tick[0]} of the controller"
    yield Event(start, "start", f"{what}, goal {_point(goal[0])}")


def _point(p: Floats | tuple[float, float, float]) -> str:
    return "(" + ", ".join(f"{float(v):g}" for v in np.round(p, 4)) + ") m"


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
            yield number, f"{verb}: {new[number].words}, from {source}", False
        elif replace(old[number], session=0) != replace(new[number], session=0):
            yield number, f"changed: now {new[number].words}", True


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
    """Yield what braked the arm during the motion; also before or after it where that is news."""
    parts = (motion.before, motion.commands, motion.after)
    flags: Ints = np.concatenate([part.flags for part in parts])
    t = np.concatenate(
        [motion.times_of(motion.before.mono_ns), motion.t, motion.times_of(motion.after.mono_ns)]
    )
    where = np.repeat(np.arange(3), [len(part) for part in parts])
    alone = () if motion.ended else (AFTER,)
    kinds = {
        STOPPED: ("stop", "stop request obeyed: braked to rest", (DURING,)),
        STALE: ("stale", "no fresh joint state: braked", (DURING, *alone)),
        NOT_FINITE: ("stale", "a value was no number: braked", (DURING,)),
        FOREIGN: ("foreign", "another controller commands the plant", (BEFORE, DURING, AFTER)),
        CONTACT: ("contact", "a link is inside an obstacle: braked", (DURING,)),
    }
    for bit, (kind, text, told) in kinds.items():
        for first, last in _spans((flags & bit != 0) & np.isin(where, told)):
            start, end = float(t[first]), float(t[last])
            yield Event(start, kind, f"{text}, {last - first + 1} ticks until {end:.3f} s")


def _stuck_events(motion: Motion) -> Iterator[Event]:
    """Yield when the tip was stuck, and when a way out was tried."""
    c = motion.commands
    for first, last in _spans(c.stuck_since_ns != 0):
        start, end = float(motion.t[first]), float(motion.t[last])
        far = f"{float(c.deviation[first]):.3f} m from the goal"
        yield Event(start, "stuck", f"the tip is stuck {far} until {end:.3f} s")
    turned = np.any(np.diff(c.circulation, axis=0) != 0, axis=1)
    for row in np.flatnonzero(turned) + 1:
        axis = ", ".join(f"{float(v):g}" for v in np.round(c.circulation[row], 3))
        text = (
            f"way out: circulation about ({axis})"
            if c.circulation[row].any()
            else "the circulation ends"
        )
        yield Event(float(motion.t[row]), "stuck", text)
    for first, last in _spans(c.law_outcome == ASIDE):
        start, end = float(motion.t[first]), float(motion.t[last])
        yield Event(start, "stuck", f"way out: the joints move aside until {end:.3f} s")


# --- processes ---


def _plant_events(motion: Motion) -> Iterator[Event]:
    """Yield when commands ceased for the plant, and when it obeyed again."""
    mode = motion.states.plant_mode
    for first, last in _spans(mode == STOPPING):
        at_end = last == len(mode) - 1 or mode[last + 1] == ENDED
        again = "" if at_end else f"; commands again at {float(motion.plant_t[last + 1]):.3f} s"
        yield Event(
            float(motion.plant_t[first]),
            "plant",
            f"commands ceased: the plant ramps to rest{again}",
        )
    left = motion.heard.tick[motion.heard.plant_mode == ENDED]
    if len(left):
        yield Event(int(left[0]) * motion.plant_period, "plant", "the plant ended in good order")


def _fault_events(program: str, statuses: Statuses, motion: Motion) -> Iterator[Event]:
    """Yield each fault of a program when it appears, with the time of the last message with it.

    A message tells faults of the second before it, so spans closer than that are one.
    """
    t = motion.times_of(statuses.mono_ns)
    for bit in (1 << place for place in range(32)):
        for first, last in _joined(_spans(statuses.faults & bit != 0), t):
            (name,) = fault_names(bit)
            until = "to its last message" if last == len(t) - 1 else f"until {t[last]:.3f} s"
            yield Event(float(t[first]), "fault", f"{program}: {name} {until}")


def _joined(spans: list[tuple[int, int]], t: Floats) -> list[tuple[int, int]]:
    """Return spans of rows, those as one that follow one another within a second."""
    joined: list[tuple[int, int]] = []
    for first, last in spans:
        if joined and t[first] - t[joined[-1][1]] <= FAULT_S:
            first = joined.pop()[0]
        joined.append((first, last))
    return joined


def _takeovers(program: str, statuses: Statuses, motion: Motion) -> Iterator[Event]:
    """Yield when another session took the place of the other side's program."""
    other = {"controller": "plant", "simulator": "controller"}[program]
    for row in np.flatnonzero(np.diff(statuses.takeovers) > 0) + 1:
        text = f"{program}: another {other} took over, session {statuses.peer_session[row]}"
        yield Event(motion.time_of(int(statuses.mono_ns[row])), "restart", text)


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
    elif len(motion.after) and motion.ended:
        yield Event(end, "end", f"joint states end {duration - end:.3f} s before the scene does")
    elif len(motion.after):
        text = f"joint states end {duration - end:.3f} s before the scene does: is the plant gone?"
        yield Event(end, "end", f"{text} {len(motion.after)} commands follow")
    elif motion.states.plant_mode[-1] != MOVING:
        yield Event(end, "end", f"commands end {duration - end:.3f} s before the scene does")
    else:
        yield Event(end, "end", f"the log ends {duration - end:.3f} s before the scene does")
