"""Child processes that end with their parent, in a stated order, and say why they ended."""

from __future__ import annotations

import functools
import shutil
import signal
import subprocess
import tempfile
from pathlib import Path

from leeway import _native

STOP_PATIENCE_S = 5.0


class ProgramMissing(Exception):
    """A program of Leeway or LCM is not installed where it should be."""


def program(name: str) -> Path:
    """Return the path of a program of Leeway (leeway-*) or LCM (lcm-*)."""
    installed = Path(_native.__file__).parent
    path = (
        installed / "bin" / name if name.startswith("leeway-") else installed.parent / "bin" / name
    )
    if not path.exists():
        raise ProgramMissing(f"{name} is not installed at {path}: run ./dev setup")
    return path


@functools.cache
def _may_be_fifo() -> bool:
    """Whether the system grants a real-time priority."""
    trial = ["chrt", "--fifo", "1", "true"]
    return (
        shutil.which("chrt") is not None
        and subprocess.run(trial, capture_output=True, check=False).returncode == 0
    )


class Child:
    """A running program, in its own session: Ctrl-C in the terminal reaches the parent alone."""

    def __init__(self, name: str, *args: str, ahead: bool = False) -> None:
        """Start a program; `ahead` of normal processes where the system grants it."""
        self.name = name
        self.stderr = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the child
        # The kernel ends the child when this process dies; the real program keeps this pid.
        guard = ["chrt", "--fifo", "1"] if ahead and _may_be_fifo() else []
        guard += ["setpriv", "--pdeathsig", "TERM"] if shutil.which("setpriv") else []
        self.process = subprocess.Popen(
            [*guard, str(program(name)), *args],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=self.stderr,
            start_new_session=True,
        )

    def status(self) -> int | None:
        """Return the exit status, None while it runs."""
        return self.process.poll()

    def stop(self) -> int:
        """Ask it to end, wait, kill it when it does not; return the exit status."""
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(STOP_PATIENCE_S)
            except subprocess.TimeoutExpired:
                self.process.kill()
        return self.process.wait()

    def said(self) -> str:
        """Return what it wrote to stderr."""
        self.stderr.seek(0)
        return self.stderr.read().decode(errors="replace").strip()

    def ending(self) -> str:
        """Say how it ended, for people."""
        status = self.process.wait()
        if status < 0:
            return f"{self.name} was ended by {signal.Signals(-status).name}"
        return f"{self.name} ended with exit status {status}"
