"""The load: stress-ng on every CPU, and a flood of LCM messages on the same bus."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

from rt.jobs import Job

FLOOD_HZ = 100_000
STRESS = "--cpu 2 --vm 1 --vm-bytes 256M --io 1"
STRESS_WORKERS = 4
START_PATIENCE_S = 10.0


class Load:
    """Stress-ng and the flood while they run."""

    def __init__(self, stress: Job, flood: Job) -> None:
        self.stress, self.flood = stress, flood

    def check(self) -> None:
        """Raise when either of them ended."""
        self.stress.check_running()
        self.flood.check_running()

    def flood_hz(self, spans: list[tuple[int, int]]) -> float:
        """Return the messages per second really sent during spans of CLOCK_MONOTONIC, ns."""
        return flood_rate(self.flood.printed(), spans)


def flood_rate(lines: str, spans: list[tuple[int, int]]) -> float:
    """Read the flood's own account: lines of time, ns, and messages sent until then."""
    whole = lines[: lines.rfind("\n") + 1]
    time_ns, sent = np.array([line.split() for line in whole.splitlines()], np.int64).T
    # Differences first: a monotonic clock in ns outgrows a double's 53 bits.
    start = time_ns[0]
    edges = np.array(spans) - start
    counts = np.interp(edges, time_ns - start, sent)
    return float((counts[:, 1] - counts[:, 0]).sum() / (edges[:, 1] - edges[:, 0]).sum() * 1e9)


def workers_of(job: Job) -> int:
    """Count the children of a job."""
    pid = job.process.pid
    return len(Path(f"/proc/{pid}/task/{pid}/children").read_text().split())


def _ahead() -> list[str]:
    """Return what lets the flood keep its rate beside stress-ng, where the system grants it."""
    trial = ["nice", "-n", "-20", "true"]
    granted = shutil.which("nice") and subprocess.run(trial, capture_output=True, check=False)
    return trial[:-1] if granted and granted.returncode == 0 and not granted.stderr else []


@contextmanager
def running_load(flood_program: Path) -> Iterator[Load]:
    """Load the machine; return when everything runs."""
    with ExitStack() as stack:
        stress = stack.enter_context(Job("stress-ng", *STRESS.split(), "--quiet"))
        flood = stack.enter_context(Job(*_ahead(), flood_program, str(FLOOD_HZ)))
        stress.wait_for(
            lambda: workers_of(stress) >= STRESS_WORKERS, START_PATIENCE_S, "stress-ng worker"
        )
        flood.wait_for(lambda: flood.printed().count("\n") > 1, START_PATIENCE_S, "flood")
        yield Load(stress, flood)
