"""Single keys from a terminal, which is as before afterwards, however the block ends."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import sys
import termios
import time
import tty
from collections.abc import Iterator
from types import FrameType

ARROWS = {b"\x1b[C": "right", b"\x1b[D": "left", b"\x1bOC": "right", b"\x1bOD": "left"}
ESCAPE_S = 0.05  # the bytes of an arrow come within this time


class Ended(Exception):
    """A signal asked the program to end."""

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.number = number


class Keys:
    """Waiting, with an eye on the keyboard where there is one."""

    def __init__(self, terminal: int | None) -> None:
        self._terminal = terminal

    def wait(self, seconds: float) -> str | None:
        """Wait; return a key as soon as one is pressed."""
        if self._terminal is None:
            time.sleep(max(0.0, seconds))
            return None
        ready, _, _ = select.select([self._terminal], [], [], max(0.0, seconds))
        return self._read(self._terminal) if ready else None

    def _read(self, terminal: int) -> str | None:
        data = os.read(terminal, 1)
        if not data:  # the terminal is gone
            self._terminal = None
            return "q"
        while data[:1] == b"\x1b" and len(data) < 3:
            if not select.select([terminal], [], [], ESCAPE_S)[0]:
                return None
            data += os.read(terminal, 1)
        return ARROWS.get(data) if data[:1] == b"\x1b" else data.decode("ascii", "replace")


@contextlib.contextmanager
def keyboard() -> Iterator[Keys]:
    """Read keys as they are pressed while the block runs.

    Raises
    ------
    Ended
        In the block, at SIGINT, SIGTERM or SIGHUP.
    """
    terminal = _terminal()
    before = termios.tcgetattr(terminal) if terminal is not None else None

    def end(number: int, _: FrameType | None) -> None:
        raise Ended(number)

    def go_on(_: int, __: FrameType | None) -> None:
        if _terminal() is not None:
            tty.setcbreak(sys.stdin.fileno())

    # A parent that started this in the background, or under nohup, has some of them ignored.
    stops = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    numbers = [number for number in stops if signal.getsignal(number) != signal.SIG_IGN]
    old = {number: signal.signal(number, end) for number in numbers}
    old[signal.SIGCONT] = signal.signal(signal.SIGCONT, go_on)
    try:
        if terminal is not None:
            tty.setcbreak(terminal)
        yield Keys(terminal)
    finally:
        for number in (*numbers, signal.SIGTTOU):  # nothing may come between this and the end
            old.setdefault(number, signal.signal(number, signal.SIG_IGN))
        if terminal is not None and before is not None:
            termios.tcsetattr(terminal, termios.TCSADRAIN, before)
        for number, handler in old.items():
            signal.signal(number, handler)


def _terminal() -> int | None:
    """Return the terminal whose keys are this program's: not in the background, not on a pipe."""
    if sys.stdin is None or not sys.stdin.isatty():
        return None
    terminal = sys.stdin.fileno()
    return terminal if os.tcgetpgrp(terminal) == os.getpgrp() else None
