"""One slice of each contender: start it, let it warm up, measure, end it."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from leeway.processes import program
from leeway.summary import scenario
from rt.histogram import BINS, Histogram, from_cyclictest, from_json
from rt.jobs import Job, JobFailed
from rt.machine import receivers

PRIORITY = 80
WARM_UP_S = 0.5  # of our programs and of the ping-pong; cyclictest has none
PATIENCE_S = 10.0
LCM_PORT = 7667
PROGRAMS = {"controller": "leeway-controller", "plant": "leeway-simulator"}
HISTOGRAMS = ("wake_late_us", "exec_us", "age_us")
# Of the ping-pong; the first is what the others are compared to.
LINKS = ("udp", "lcm", "own")
# Case C1: with its constant attraction the arm never comes to rest.
SCENE = "c1"


@dataclass(frozen=True)
class Plan:
    """What all slices of a session have in common."""

    seconds: int
    pingpong: Path
    folder: Path  # for files that live as long as a slice


@dataclass(frozen=True)
class Slice:
    """Result of one slice: histograms and counts by name, and its time, ns of CLOCK_MONOTONIC."""

    span: tuple[int, int]
    histograms: dict[str, Histogram]
    counts: dict[str, Any] = field(default_factory=dict)


def _is_ready(job: Job) -> bool:
    return "ready" in job.said()


def measure_leeway(plan: Plan, rate_hz: float) -> Slice:
    """Controller and simulated arm, live, joined by the bus."""
    files = {who: plan.folder / f"{who}.json" for who in PROGRAMS}
    for file in files.values():
        file.unlink(missing_ok=True)
    sets = [f"--set={key}" for key in (f"rate_hz={rate_hz:g}", "plant.rate_hz=0")]
    # The plant, started last, is ended first: it takes its leave, and nobody counts its silence.
    with ExitStack() as stack:
        jobs = [
            stack.enter_context(
                Job(program(name), scenario(SCENE), *sets, f"--histogram={files[who]}")
            )
            for who, name in PROGRAMS.items()
        ]
        for job in jobs:
            job.wait_for(partial(_is_ready, job), PATIENCE_S, "ready")
        time.sleep(WARM_UP_S)
        start = time.monotonic_ns()
        heard = receivers(LCM_PORT)
        time.sleep(plan.seconds)
        end = time.monotonic_ns()
        for job in jobs:
            job.check_running()
    return _read_programs(files, jobs, (start, end), heard)


def _read_programs(
    files: dict[str, Path], jobs: list[Job], span: tuple[int, int], heard: int
) -> Slice:
    """Read the statistics that the programs wrote when they ended."""
    histograms: dict[str, Histogram] = {}
    counts: dict[str, Any] = {"receivers": heard}
    for (who, file), job in zip(files.items(), jobs, strict=True):
        if not file.exists():
            raise JobFailed(f"{job.name} wrote no statistics: {job.said()}")
        said = json.loads(file.read_text())
        for name in HISTOGRAMS:
            histograms[f"{who} {name}"] = from_json(said.pop(name))
        if said["ticks"] == 0:
            raise JobFailed(f"{job.name} counted no tick: {job.said()}")
        counts[who] = said
    return Slice(span, histograms, counts)


def measure_cyclictest(plan: Plan, rate_hz: float) -> Slice:
    """Two threads that do nothing but wake up: as many as Leeway has real-time loops."""
    interval_us = round(1e6 / rate_hz)
    options = f"-m -p{PRIORITY} -t2 -i {interval_us} -d0 -h {BINS} -D {plan.seconds} -q"
    start = time.monotonic_ns()
    with Job("cyclictest", *options.split()) as job:
        text = job.finish(plan.seconds + PATIENCE_S)
    return Slice((start, time.monotonic_ns()), {"wake_late_us": from_cyclictest(text)})


def measure_pingpong(link: str, plan: Plan, rate_hz: float) -> Slice:
    """Round trips between two processes."""
    start = time.monotonic_ns()
    with Job(plan.pingpong, link, f"{rate_hz:g}", str(plan.seconds)) as job:
        said = json.loads(job.finish(plan.seconds + WARM_UP_S + 2 * PATIENCE_S))
    histogram = from_json(said.pop("round_trip_us"))
    return Slice((start, time.monotonic_ns()), {"round_trip_us": histogram}, said)


CONTENDERS: dict[str, Callable[[Plan, float], Slice]] = {
    "leeway": measure_leeway,
    "cyclictest": measure_cyclictest,
    **{link: partial(measure_pingpong, link) for link in LINKS},
}
