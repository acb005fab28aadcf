"""Ctrl-C before a command is at work: an end without words. Imports nothing of weight."""

from __future__ import annotations

import os
import signal
from types import FrameType

EXIT_INTERRUPTED = 130


def _end(_: int, __: FrameType | None) -> None:
    # Nothing is open or running yet; an exception would show where the imports stand.
    os._exit(EXIT_INTERRUPTED)


def end_quietly() -> None:
    """From here on Ctrl-C ends this process at once, unless its parent chose to ignore it."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _end)


def raise_again() -> None:
    """From here on Ctrl-C is Python's exception again, so that commands can tidy up."""
    if signal.getsignal(signal.SIGINT) is _end:
        signal.signal(signal.SIGINT, signal.default_int_handler)
