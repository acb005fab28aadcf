"""Child processes of the bench: none outlives it, whichever way it ends."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType

STOP_PATIENCE_S = 10.0


class JobFailed(Exception):
    """A child ended when or how it should not have."""


class Job:
    """A running program in a session of its own: Ctrl-C in the terminal reaches the bench alone."""

    def __init__(self, *command: str | Path) -> None:
        """Start it; the kernel ends it when the bench dies."""
        self.name = Path(command[0]).name
        self.out = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the job
        self.err = tempfile.TemporaryFile()  # noqa: SIM115
        guard = ["setpriv", "--pdeathsig", "TERM"] if shutil.which("setpriv") else []
        self.process = subprocess.Popen(
            [*guard, *map(str, command)],
            stdin=subprocess.DEVNULL,
            stdout=self.out,
            stderr=self.err,
            start_new_session=True,
        )

    def __enter__(self) -> Job:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()

    def ask_to_stop(self) -> None:
        """Ask it to end, without waiting for that."""
        if self.process.poll() is None:
            self.process.terminate()

    def stop(self) -> int:
        """End it, with its children when it does not end by itself; return the exit status."""
        self.ask_to_stop()
        try:
            return self.process.wait(STOP_PATIENCE_S)
        except subprocess.TimeoutExpired:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self.process.pid, signal.SIGKILL)
            return self.process.wait()

    def finish(self, patience_s: float) -> str:
        """Wait until it ends by itself; return what it printed."""
        try:
            status = self.process.wait(patience_s)
        except subprocess.TimeoutExpired:
            raise JobFailed(f"{self.name} did not end within {patience_s:g} s") from None
        if status != 0:
            raise JobFailed(f"{self.name} ended with exit status {status}: {self.said()}")
        return self.printed()

    def wait_for(self, condition: Callable[[], bool], patience_s: float, what: str) -> None:
        """Wait for a condition while it runs."""
        end = time.monotonic() + patience_s
        while not condition():
            self.check_running()
            if time.monotonic() > end:
                raise JobFailed(f"{self.name}: no {what} within {patience_s:g} s: {self.said()}")
            time.sleep(0.02)

    def check_running(self) -> None:
        """Raise when it ended."""
        status = self.process.poll()
        if status is not None:
            raise JobFailed(f"{self.name} ended with exit status {status}: {self.said()}")

    def printed(self) -> str:
        """Return what it wrote to stdout so far."""
        return _read(self.out.fileno())

    def said(self) -> str:
        """Return what it wrote to stderr so far."""
        return _read(self.err.fileno()).strip()


def _read(file: int) -> str:
    """Read a file from its start without moving the position at which the child writes."""
    return os.pread(file, os.fstat(file).st_size, 0).decode(errors="replace")
