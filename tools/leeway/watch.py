"""`leeway status`: hears STATUS and PLANT_STATUS, and shows them side by side."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from typing import Any

from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from leeway import bus as bus_tools
from leeway.status import Percentiles, Status, status_of, wire

CHANNELS = {"STATUS": "controller", "PLANT_STATUS": "simulator"}
LISTEN_S = 1.5  # patience of a single look
ENOUGH_S = 0.5  # of it, when both programs were heard: a third one would have spoken
REFRESH_S = 0.2
SILENT_S = 0.5  # a program sends 20 times a second
FORGET_S = 10.0
SENDERS_MAX = 6  # side by side
RATE_MESSAGES = 21  # a second
HINT = (
    "is one running on this bus (same --lcm-url, same --name)? "
    "Start leeway-simulator SCENE and leeway-controller SCENE, or leeway run SCENE"
)


class Sender:
    """A program that was heard: its newest status, and its rate."""

    def __init__(self, program: str) -> None:
        self.program = program
        self.heard = 0.0
        self.count = 0
        self._ticks: deque[tuple[int, int]] = deque(maxlen=RATE_MESSAGES)

    def take(self, message: Any, now: float) -> None:
        """Take a message of this sender."""
        self.status: Status = status_of(message)
        self.heard = now
        self.count += 1
        self._ticks.append((message.h.mono_ns, message.ticks))

    @property
    def measured_hz(self) -> float | None:
        """Ticks a second, by the program's own clock; None before the second message."""
        (first_ns, first), (last_ns, last) = self._ticks[0], self._ticks[-1]
        return (last - first) * 1e9 / (last_ns - first_ns) if last_ns > first_ns else None

    def to_json(self) -> dict[str, Any]:
        """Return all fields as plain values."""
        own = {"program": f"leeway-{self.program}", "measured_hz": self.measured_hz}
        return {**own, **self.status.to_json()}


class Ear:
    """Listens to the status channels of a robot."""

    def __init__(self, url: str, name: str | None) -> None:
        """Open the bus.

        Raises
        ------
        bus.BusError
            There is no usable bus.
        """
        self.unreadable = 0
        self._senders: dict[tuple[str, int], Sender] = {}
        self._bus = bus_tools.open_bus(url)
        for plain, program in CHANNELS.items():
            channel = bus_tools.channel(plain, name)
            self._bus.subscribe(channel, self._handler(program))

    def _handler(self, program: str) -> Callable[[str, bytes], None]:
        def on_status(_: str, data: bytes) -> None:
            message = bus_tools.decode(wire.status_t, data)
            if message is None:
                self.unreadable += 1
                return
            key = (program, message.h.session)
            self._senders.setdefault(key, Sender(program)).take(message, time.monotonic())

        return on_status

    @property
    def senders(self) -> list[Sender]:
        """The programs heard lately, controllers first; the newest when there are too many."""
        now = time.monotonic()
        newest = sorted(self._senders.items(), key=lambda entry: entry[1].heard)[-SENDERS_MAX:]
        self._senders = {k: s for k, s in newest if now - s.heard < FORGET_S}
        programs = list(CHANNELS.values())
        return sorted(self._senders.values(), key=lambda s: programs.index(s.program))

    def listen(self, seconds: float) -> None:
        """Handle what comes within a time."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self._bus.handle(left)

    def look(self) -> list[Sender]:
        """Listen until both programs were heard, or for 1.5 s; return who was heard."""
        end = time.monotonic() + LISTEN_S
        self.listen(ENOUGH_S)
        while (left := end - time.monotonic()) > 0 and not self._both():
            self._bus.handle(left)
        return self.senders

    def _both(self) -> bool:
        twice = {sender.program for sender in self.senders if sender.count > 1}
        return len(twice) == len(CHANNELS)


# --- what people see ---


def _plain(names: list[str], style: str = "") -> Text:
    return Text(", ".join(names).replace("_", " ") or "none", style if names else "")


def _state(sender: Sender) -> Text:
    silent = time.monotonic() - sender.heard
    if silent > SILENT_S:
        return Text(f"silent for {silent:.0f} s, was {sender.status.state}", "red")
    return Text(sender.status.state)


def _rate(sender: Sender) -> Text:
    measured = sender.measured_hz
    found = f"{measured:.1f}" if measured is not None else "?"
    return Text(f"{found} of {sender.status.rate_hz:g} Hz")


def _realtime(sender: Sender) -> Text:
    granted = sender.status.realtime
    return _plain(granted, "" if "fifo" in granted else "yellow")


def _count(number: int) -> Text:
    return Text(str(number), "yellow" if number else "")


def _spread(values: Percentiles) -> Text:
    return Text(" / ".join(f"{v:.0f}" for v in (values.p50, values.p99, values.p999, values.max)))


def _refused(sender: Sender) -> Text:
    named = [f"{name} {count}" for name, count in sender.status.refused.items()]
    return Text(", ".join(named).replace("_", " ") or "none")


def _allocations(sender: Sender) -> Text:
    count = sender.status.allocations
    return Text("not counted") if count is None else _count(count)


def _clearance(sender: Sender) -> Text:
    clearance = sender.status.clearance
    return Text("-" if clearance is None else f"{clearance:.4f} m")


def _goal(sender: Sender) -> Text:
    found = sender.status
    if sender.program != "controller":
        return Text("-")
    stuck_s = (found.mono_ns - found.stuck_since_ns) / 1e9
    word = f", stuck for {stuck_s:.0f} s" if found.stuck_since_ns else ""
    return Text(f"{found.deviation:.4f} m away{word}", "bold red" if word else "")


def _messages(sender: Sender) -> Text:
    found = sender.status
    text = f"{found.taken}, {found.missed} missed, {found.unsent} unsent"
    return Text(text, "yellow" if found.missed or found.unsent else "")


def _page_faults(sender: Sender) -> Text:
    minor, major = sender.status.minor_faults, sender.status.major_faults
    return Text(f"{minor} minor, {major} major", "yellow" if minor or major else "")


# Few enough, and short enough, for a terminal of 80 columns and 24 lines.
ROWS: dict[str, Callable[[Sender], Text]] = {
    "state": _state,
    "faults": lambda s: _plain(s.status.faults, "bold red"),
    "faults ever": lambda s: _plain(s.status.faults_ever, "yellow"),
    "real time": _realtime,
    "rate": _rate,
    "ticks": lambda s: Text(str(s.status.ticks)),
    "  skipped": lambda s: _count(s.status.skipped),
    "  on old input": lambda s: _count(s.status.stale_ticks),
    "messages": _messages,
    "  refused": _refused,
    "takeovers": lambda s: _count(s.status.takeovers),
    "p50/p99/p99.9/max": lambda _: Text("us", "bold"),
    "  wake-up late": lambda s: _spread(s.status.wake_late_us),
    "  execution": lambda s: _spread(s.status.exec_us),
    "  age of input": lambda s: _spread(s.status.age_us),
    "page faults": _page_faults,
    "allocations": _allocations,
    "clearance": _clearance,
    "goal": _goal,
}


def table(senders: list[Sender]) -> Table:
    """Return a column for each program."""
    shown = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 2, 0, 0))
    shown.add_column("", no_wrap=True)
    programs = [sender.program for sender in senders]
    for sender in senders:
        alone = programs.count(sender.program) == 1
        shown.add_column(sender.program + ("" if alone else f" ..{sender.status.session % 10000}"))
    for title, cell in ROWS.items():
        shown.add_row(title, *(cell(sender) for sender in senders))
    return shown


def silence(ear: Ear) -> str:
    """Return what to say when no program was heard."""
    if ear.unreadable:
        return (
            f"{ear.unreadable} status messages of another version were heard: "
            "build the programs and this tool from the same sources (./dev setup)"
        )
    return f"no controller and no simulator was heard; {HINT}"


def watch(ear: Ear) -> None:
    """Show the programs in place until Ctrl-C."""
    with Live(console=Console(), auto_refresh=False) as live:
        while True:
            ear.listen(REFRESH_S)
            senders = ear.senders
            live.update(table(senders) if senders else Text(silence(ear)), refresh=True)
