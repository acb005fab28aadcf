"""What people see in a terminal: tables, progress on a terminal only, and where the scenes are."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
from rich.table import Table

from leeway import _native


def scenario(name: str) -> Path:
    """Return a scene that comes with Leeway: the checkout's own, else the installed copy."""
    checkout = Path(__file__).resolve().parents[2] / "scenarios" / f"{name}.yaml"
    return (
        checkout
        if checkout.exists()
        else Path(_native.__file__).parent / "scenarios" / f"{name}.yaml"
    )


@contextmanager
def progress_bar(label: str, duration_s: float, quiet: bool) -> Iterator[Callable[[float], None]]:
    """Show seconds of motion on a terminal; nothing on a pipe."""
    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.1f} of {task.total:g} s"),
    )
    with Progress(
        *columns, console=console, disable=quiet or not console.is_terminal, transient=True
    ) as bar:
        task = bar.add_task(label, total=duration_s)
        yield lambda seconds: bar.update(task, completed=min(seconds, duration_s))


@contextmanager
def count_bar(label: str, total: int, quiet: bool) -> Iterator[Callable[[int], None]]:
    """Show how many of something are done on a terminal; nothing on a pipe."""
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    with Progress(
        *columns, console=console, disable=quiet or not console.is_terminal, transient=True
    ) as bar:
        task = bar.add_task(label, total=total)
        yield lambda done: bar.update(task, completed=done)


@contextmanager
def status_line(label: str, quiet: bool) -> Iterator[Callable[[str], None]]:
    """Show what is being done on a terminal; nothing on a pipe."""
    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield lambda _: None
        return
    with console.status(label) as status:
        yield lambda text: status.update(f"{label}: {text}")


def print_table(analyses: list[Any]) -> None:
    """Print a row for each run."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for heading in (
        "case",
        "rho [m]",
        "final deviation [m]",
        "smallest clearance [m]",
        "ticks",
        "late ticks",
    ):
        table.add_column(heading, justify="left" if heading == "case" else "right")
    for a in analyses:
        distance = "-" if math.isnan(a.smallest_distance) else f"{a.smallest_distance:.4f}"
        table.add_row(
            a.label,
            f"{a.rho:g}",
            f"{a.final_deviation:.4f}",
            distance,
            str(a.ticks),
            str(a.late_ticks),
        )
    Console().print(table)


def print_info(analysis: Any) -> None:
    """Print all numbers of a run, then its events."""
    console = Console(highlight=False)
    for key, value in analysis.to_json().items():
        if key not in ("events", "scene", "limits", "programs"):
            console.print(f"{key:24} {_short(value)}", soft_wrap=True, markup=False)
    console.print("limits", style="bold")
    for use in analysis.limits:
        text = f"{use.share:.1%} used, joint {use.joint} at {use.t:.3f} s" if use.on else "off"
        console.print(f"  {use.key:22} {text}", soft_wrap=True, markup=False)
    _print_programs(console, analysis)
    console.print("events", style="bold")
    for event in analysis.events:
        console.print(
            f"  {event.t:8.3f} s  {event.kind:12} {event.text}", soft_wrap=True, markup=False
        )


def _print_programs(console: Console, analysis: Any) -> None:
    """Print two lines for each program: its counts, and its worst times."""
    console.print("programs", style="bold")
    if not analysis.programs:
        console.print(f"  {analysis.why_no_programs}")
    for program in analysis.programs:
        last = program.last
        names = {"real time": last.realtime, "faults ever": last.faults_ever}
        counts = {
            "ticks": last.ticks,
            "skipped": last.skipped,
            "on old input": last.stale_ticks,
            "unsent": last.unsent,
            "missed": last.missed,
            "refused": last.refused,
            "takeovers": last.takeovers,
            "page faults": last.minor_faults + last.major_faults,
            "allocations": "not counted" if last.allocations is None else last.allocations,
        }
        worst = ", ".join(
            f"{key.removesuffix('_us')} {values.p50:.0f} / {values.p99:.0f} / {values.p999:.0f} / "
            f"{values.max:.0f}"
            for key, values in program.worst.items()
        )
        lines = (
            f"{last.state}, {last.rate_hz:g} Hz, {_short(names)}",
            _short(counts),
            f"worst p50 / p99 / p99.9 / max of a second in us: {worst}",
        )
        for k, line in enumerate(lines):
            name = program.name if k == 0 else ""
            console.print(f"  {name:22} {line}", soft_wrap=True, markup=False)


def _short(value: Any) -> str:
    """Write a value in one line, floats with six digits."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, dict):
        return ", ".join(f"{k} {_short(v)}" for k, v in value.items()) or "none"
    if isinstance(value, list):
        return ", ".join(_short(v) for v in value) or "none"
    return str(value)
