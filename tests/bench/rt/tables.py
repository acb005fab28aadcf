"""Results as tables for people."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rich.console import Console
from rich.table import Table

from rt.results import ROUND_TRIP_PERCENTILES, WAKE_PERCENTILES
from rt.slices import CONTENDERS, LINKS, PROGRAMS

# No table is wider; a narrower terminal wraps the lines itself.
WIDTH = 132

Condition = dict[str, Any]
Cell = Callable[[Condition], object]


def show(document: dict[str, Any]) -> None:
    """Print all tables, then what they rest on."""
    console = Console(width=WIDTH)
    conditions = document["conditions"]
    for title, table in (
        ("Wake-up after the deadline, ratio to cyclictest (1 = as good)", wake_table(conditions)),
        ("Round trip, ratio to bare UDP multicast (1 = as good)", round_trip_table(conditions)),
        ("Ticks", tick_table(conditions)),
        ("Circumstances", circumstance_table(conditions)),
    ):
        console.print(f"\n{title}", style="bold")
        console.print(table)
    console.print()
    for line in foot_notes(document):
        console.print(line, markup=False, highlight=False, soft_wrap=True)


def _table(conditions: list[Condition], *columns: tuple[str, Cell]) -> Table:
    """One row a condition; a column is a heading and a function of the condition."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for heading in ("rate", "load", *(heading for heading, _ in columns)):
        table.add_column(heading, justify="right", no_wrap=True)
    for c in conditions:
        cells = [str(cell(c)) for _, cell in columns]
        table.add_row(f"{c['rate_hz']:g} Hz", c["load"], *cells)
    return table


def ratio_cell(value: dict[str, Any]) -> str:
    """Pooled ratio, quartiles over the slices; ~ when it rests on few samples."""
    if value["pooled"] is None:
        return "-"
    mark = "~" if value["few_samples"] else ""
    spread = "" if value["q1"] is None else f" [{value['q1']:.2f} {value['q3']:.2f}]"
    return f"{mark}{value['pooled']:.2f}{spread}"


def _ratio(kind: str, who: str, percentile: str) -> Cell:
    return lambda c: ratio_cell(c[f"{kind}_ratio"][who][percentile])


def _pooled(who: str, percentile: str) -> Cell:
    return lambda c: ratio_cell(c["wake_ratio"][who][percentile] | {"q1": None})


def _pair(kind: str, ours: str, theirs: str, percentile: str = "p99") -> Cell:
    """Return a percentile of both, us."""
    return lambda c: f"{c[kind][ours][percentile]:.0f} / {c[kind][theirs][percentile]:.0f}"


def wake_table(conditions: list[Condition]) -> Table:
    """Percentiles of the wake-up against cyclictest's."""
    columns: list[tuple[str, Cell]] = []
    for p in WAKE_PERCENTILES:
        columns += [
            (p, _ratio("wake", "both", p)),
            ("controller", _pooled("controller", p)),
            ("plant", _pooled("plant", p)),
            (f"{p} us", _pair("wake_us", "both", "cyclictest", p)),
        ]
    return _table(conditions, *columns)


def round_trip_table(conditions: list[Condition]) -> Table:
    """Every link of lib/bus against bare UDP."""
    columns: list[tuple[str, Cell]] = []
    for link in LINKS[1:]:
        columns += [(f"{link} {p}", _ratio("round_trip", link, p)) for p in ROUND_TRIP_PERCENTILES]
        columns.append((f"{link} p99 us", _pair("round_trip_us", link, LINKS[0])))
    return _table(conditions, *columns, (f"lost {'+'.join(LINKS)}", _lost))


def _lost(condition: Condition) -> str:
    trips = [condition["round_trips"][link] for link in LINKS]
    lost = " + ".join(str(trip["lost"]) for trip in trips)
    return f"{lost} of {min(trip['sent'] for trip in trips)}"


def _both(name: str) -> Cell:
    """Return a count of controller and plant."""

    def cell(condition: Condition) -> str:
        values = [condition["programs"][who][name] for who in PROGRAMS]
        return " + ".join("?" if value is None else str(value) for value in values)

    return cell


def _stale(condition: Condition) -> str:
    """Share of the ticks of each that had nothing fresh from the other side."""
    programs = [condition["programs"][who] for who in PROGRAMS]
    return " + ".join(f"{100 * p['stale_ticks'] / p['ticks']:.3f}" for p in programs)


def tick_table(conditions: list[Condition]) -> Table:
    """Counts of controller + plant, and cyclictest's late samples beside ours."""
    return _table(
        conditions,
        ("ticks", _both("ticks")),
        ("stale %", _stale),
        ("skipped", _both("skipped")),
        ("period late", _both("late")),
        ("cyclictest", lambda c: f"{c['cyclictest']['late']} of {c['cyclictest']['samples']}"),
        ("allocations", _both("allocations")),
        ("minor faults", _both("minor_faults")),
        ("major", _both("major_faults")),
        ("unsent", _both("unsent")),
    )


def _flood(condition: Condition) -> str:
    return " / ".join(f"{hz / 1e3:.0f}" for hz in condition["flood_hz"].values()) or "-"


def circumstance_table(conditions: list[Condition]) -> Table:
    """What the system granted and what the flood achieved."""
    return _table(
        conditions,
        ("controller granted", lambda c: c["programs"]["controller"]["realtime"]),
        ("plant granted", lambda c: c["programs"]["plant"]["realtime"]),
        ("receivers", lambda c: c["receivers"]),
        (f"flood, 1000/s: {' / '.join(CONTENDERS)}", _flood),
    )


def foot_notes(document: dict[str, Any]) -> list[str]:
    """Return what a reader has to know about the tables."""
    machine, options = document["machine"], document["options"]
    trips = document["conditions"][0]["round_trips"]["udp"]
    virtual = ", virtual" if machine["virtual"] else ""
    return [
        "ratios: pooled over all slices [quartiles of the slices' own]; "
        "~ fewer than ten samples above the percentile",
        "a + b: controller + plant; stale: ticks without a message since the tick before; "
        "period late: woke a period or more late",
        f"round trip: {trips['bytes_there']} bytes there, {trips['bytes_back']} back, every link",
        f"slices of {options['slice_s']:g} s, {options['alternations']} alternations, "
        f"seed {options['seed']}; cyclictest {machine['cyclictest']}",
        f"load: stress-ng {machine['stress-ng']} {options['stress']}, "
        f"flood of {options['flood_hz']} messages/s asked",
        f"{machine['cpu']}, {machine['cpus']} CPUs{virtual}; {machine['kernel']}; "
        f"{machine['preemption']}",
    ]
