"""A log's messages sent once more, byte by byte, at the pace at which they were recorded.

Times are s; log time starts with 0 at the first event.
"""

from __future__ import annotations

import re
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from leeway.connection import Connection
from leeway.logs.framing import open_events
from leeway.logs.log import Floats, Ints
from leeway.replay.keys import Keys

SELF_TEST = "LCM_SELF_TEST"
LATE_S = 0.25  # behind by more, the process did not run: go on from there instead of hurrying
SPEEDS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
SEEK_S = 5.0
SHOW_S = 0.1  # between two looks of the progress line
LOOK_S = 0.02  # between two looks at the keyboard while messages are due
LISTEN_S = 0.3
ARM_CHANNEL = re.compile(r"(.+_)?JOINT_(STATE|COMMAND)")


@dataclass(frozen=True)
class Recording:
    """Where the messages of a log are; arrays have one entry a message to be sent."""

    path: Path
    t: Floats  # (n,) s, not decreasing
    start: Ints  # (n,) byte where its data begin
    size: Ints  # (n,) bytes
    channel: Ints  # (n,) index in channels
    channels: list[str]
    duration: float  # s, of the whole log
    truncated_bytes: int

    def __len__(self) -> int:
        return len(self.t)

    def at(self, seconds: float) -> int:
        """Return the first message at or behind a time."""
        return int(np.searchsorted(self.t, seconds))


def open_recording(path: Path, channels: str | None = None) -> Recording:
    """Find the messages of a log.

    Parameters
    ----------
    channels
        Regular expression that a channel's whole name must match; None takes all but
        LCM_SELF_TEST.

    Raises
    ------
    LogError
        The file cannot be read or is no LCM log.
    re.error
        The expression is none.
    """
    pattern = re.compile(rf"(?!{SELF_TEST}$).*" if channels is None else channels)
    index: dict[str, int] = {}
    chosen: dict[str, bool] = {}
    rows: list[tuple[int, int, int, int]] = []
    first = last = None
    with open_events(path) as events:
        for start, utime, channel, data in events:
            first = utime if first is None else first
            last = utime if last is None else max(last, utime)
            if channel not in chosen:
                chosen[channel] = pattern.fullmatch(channel) is not None
            if chosen[channel]:
                number = index.setdefault(channel, len(index))
                rows.append((utime, start, len(data), number))
        left = events.left
    table = np.array(rows, dtype=np.int64).reshape(-1, 4)
    begin, end = first or 0, last or 0
    # The logger's clock may be set back in a recording; time goes on.
    t = (np.maximum.accumulate(table[:, 0]) - begin) * 1e-6
    return Recording(
        path=path,
        t=np.maximum(t, 0.0),
        start=table[:, 1],
        size=table[:, 2],
        channel=table[:, 3],
        channels=list(index),
        duration=(end - begin) * 1e-6,
        truncated_bytes=left,
    )


class Transport:
    """Where in the log playing is: pace, pause and seeking. Pure: the time now is passed in."""

    def __init__(self, duration: float, position: float, speed: float, now: float) -> None:
        self.duration = duration
        self.speed = speed
        self.paused = False
        self._anchor = (now, position)  # time and the log time that belonged to it

    def position(self, now: float) -> float:
        """Return the log time."""
        then, position = self._anchor
        return position if self.paused else position + (now - then) * self.speed

    def due(self, t: float, now: float) -> float:
        """Return in how many seconds a message of log time t is due; 0 or less is now."""
        return (t - self.position(now)) / self.speed

    def forgive(self, t: float, now: float) -> None:
        """Set the clock back where a message is much too late: it is due now, not long ago."""
        if not self.paused and self.due(t, now) < -LATE_S:
            self._anchor = (now, t)

    def toggle_pause(self, now: float) -> None:
        """Pause, or go on where it was paused."""
        self._anchor = (now, self.position(now))
        self.paused = not self.paused

    def seek(self, seconds: float, now: float) -> float:
        """Jump forward or back; return the new log time."""
        target = min(max(self.position(now) + seconds, 0.0), self.duration)
        self._anchor = (now, target)
        return target

    def change_speed(self, steps: int, now: float) -> None:
        """Play faster or slower by steps of 1, 2, 5, 10."""
        self._anchor = (now, self.position(now))
        for _ in range(abs(steps)):
            others = [s for s in SPEEDS if (s > self.speed if steps > 0 else s < self.speed)]
            self.speed = (min(others) if steps > 0 else max(others)) if others else self.speed


@dataclass
class Player:
    """Sends the messages of a recording when they are due."""

    recording: Recording
    transport: Transport
    publish: Callable[[str, bytes], None]

    def __post_init__(self) -> None:
        self.sent: Counter[str] = Counter()
        self._file = self.recording.path.open("rb")
        self._row = 0

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    @property
    def ended(self) -> bool:
        """Whether the last message was sent."""
        return self._row >= len(self.recording)

    def send_due(self, now: float) -> float:
        """Send the message that is due, if one is; return in how many s the next is."""
        if self.transport.paused or self.ended:
            return float("inf")
        t = float(self.recording.t[self._row])
        self.transport.forgive(t, now)
        wait = self.transport.due(t, now)
        if wait > 0:
            return wait
        self._send(self._row)
        self._row += 1
        return 0.0

    def seek(self, seconds: float, now: float) -> None:
        """Jump forward or back."""
        self._row = self.recording.at(self.transport.seek(seconds, now))

    def _send(self, row: int) -> None:
        r = self.recording
        channel = r.channels[int(r.channel[row])]
        self._file.seek(int(r.start[row]))
        self.publish(channel, self._file.read(int(r.size[row])))
        self.sent[channel] += 1


def press(player: Player, key: str, now: float) -> bool:
    """Obey a key: space, arrows, + and -, q. Return whether to go on."""
    transport = player.transport
    if key == " ":
        transport.toggle_pause(now)
    elif key in ("left", "right"):
        player.seek(SEEK_S if key == "right" else -SEEK_S, now)
    elif key in ("+", "=", "-"):
        transport.change_speed(-1 if key == "-" else 1, now)
    return key not in ("q", "Q")


def play(player: Player, keys: Keys, show: Callable[[float], None]) -> None:
    """Play to the end, or until q is pressed.

    Parameters
    ----------
    show
        Called with the time about ten times a second.
    """
    shown = looked = -SHOW_S
    while not player.ended:
        now = time.monotonic()
        if now - shown >= SHOW_S:
            show(now)
            shown = now
        wait = player.send_due(now)
        if wait <= 0 and now - looked < LOOK_S:
            continue
        looked = now
        key = keys.wait(min(wait, SHOW_S))
        if key is not None and not press(player, key, time.monotonic()):
            return


def company(bus: Connection, recording: Recording) -> str | None:
    """Listen for a moment; return a channel of an arm that somebody publishes already."""
    heard: list[str] = []
    for channel in recording.channels:
        if ARM_CHANNEL.fullmatch(channel):
            bus.subscribe(channel, lambda found, _: heard.append(found))
    end = time.monotonic() + LISTEN_S
    while not heard and (left := end - time.monotonic()) > 0:
        bus.handle(left)
    return heard[0] if heard else None
