"""Pictures of a run. Figure objects only, no pyplot: nothing is shared between threads.

Units on the axes are SI; angles rad.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from leeway.logs.analysis import FLAGS, MOVING_POINTS, Analysis
from leeway.logs.events import Event
from leeway.logs.log import Floats

# Okabe and Ito's palette, which colour-blind readers can tell apart; line styles tell it too.
BLUE, ORANGE, GREEN, RED, PURPLE, SKY = (
    "#0072B2",
    "#E69F00",
    "#009E73",
    "#D55E00",
    "#CC79A7",
    "#56B4E9",
)
COLOURS = (BLUE, ORANGE, GREEN, RED, PURPLE, SKY)
STYLES: tuple[Any, ...] = (
    "-",
    (0, (6, 2)),
    (0, (8, 2, 2, 2)),
    (0, (2, 1.2)),
    (0, (4, 1.5, 1, 1.5, 1, 1.5)),
    (0, (10, 3)),
)
RHO = "\N{GREEK SMALL LETTER RHO}"
INK, GREY, PALE = "#222222", "#6b6b6b", "#d9d9d9"
COLUMNS = 1000  # of a time plot: more points than twice this are reduced
WIDTH, HEIGHT = 9.0, 3.5  # inch
EVENT_MARKS_MAX = 40
PROGRAM_TIMES = {"wake_late_us": "wake-up late", "exec_us": "execution", "age_us": "age of input"}
DRAWN_MAX = 1e6  # larger numbers come from damaged logs: gaps in the pictures


def reduce_minmax(t: Floats, y: Floats, columns: int = COLUMNS) -> tuple[Floats, Floats]:
    """Keep the smallest and the largest value of each column of a plot, so that spikes survive.

    Parameters
    ----------
    t : (n,) s
        Not decreasing.
    y : (n,)
        NaN marks gaps.
    columns
        Width of the plot; up to twice as many points come back, in order.

    Returns
    -------
    t, y : (k,)
        Samples of the signal, unchanged where n <= 2 * columns.
    """
    if len(t) <= 2 * columns:
        return t, y
    starts = np.unique(np.searchsorted(t, np.linspace(t[0], t[-1], columns, endpoint=False)))
    keep = [0, len(t) - 1]
    low, high = np.where(np.isnan(y), np.inf, y), np.where(np.isnan(y), -np.inf, y)
    for start, end in zip(starts, np.r_[starts[1:], len(t)], strict=True):
        keep += [start + int(np.argmin(low[start:end])), start + int(np.argmax(high[start:end]))]
    rows = np.unique(keep)
    return t[rows], y[rows]


# --- signals over time ---


def joint_positions(a: Analysis) -> Figure:
    """q(t), one line a joint."""
    figure, axes = _time_axes("Joint positions", "q [rad]")
    _joint_lines(axes, a.t, a.q)
    return _finish(figure, axes, a, columns=6)


def joint_speeds(a: Analysis) -> Figure:
    """Commanded joint speeds; the law's wish thin behind them, limits as lines."""
    figure, axes = _time_axes("Commanded joint speeds", "q̇ [rad/s]")
    if not np.array_equal(a.qd, a.qd_law, equal_nan=True):
        for j in range(6):
            axes.plot(*reduce_minmax(a.t, a.qd_law[:, j]), color=COLOURS[j], lw=0.8, alpha=0.45)
        axes.plot([], [], color=GREY, lw=0.8, alpha=0.6, label="wish")
    _joint_lines(axes, a.t, a.qd, width=1.2)
    low, high = _span(a.qd)
    limit = np.array(a.scene["limits"]["velocity"])
    near = np.unique(limit[limit < 2.5 * max(-low, high)])  # one far above would flatten the curves
    if len(near):
        _level(axes, [*-near, *near], "limit")
        low, high = min(low, -near[-1]), max(high, near[-1])
    margin = 0.06 * max(high - low, 1e-3)
    axes.set_ylim(low - margin, high + margin)
    return _finish(figure, axes, a, columns=8)


def deviation(a: Analysis) -> Figure:
    """Distance of the tip to the goal in force."""
    figure, axes = _time_axes("Distance of the tip to its goal", "|e| [m]")
    _line(axes, a.t, a.deviation, 0, "deviation", 1.6)
    axes.annotate(
        f"{a.final_deviation:.4f} m",
        (a.t[-1], a.final_deviation),
        xytext=(-4, 8),
        textcoords="offset points",
        ha="right",
        color=BLUE,
    )
    axes.set_ylim(bottom=0)
    return _finish(figure, axes, a, columns=1)


def distances(a: Analysis) -> Figure:
    """Clearance of the arm and distance of every moving origin, with the reach rho."""
    figure, axes = _time_axes("Distance of arm and frame origins to obstacles", "d [m]")
    shown = a.distances[:, MOVING_POINTS]
    if not np.isfinite(shown).any():
        axes.text(
            0.5, 0.5, "no obstacle in this run", transform=axes.transAxes, ha="center", color=GREY
        )
        return _finish(figure, axes, a, columns=0)
    whole = a.scene["law"]["control_points"] != "joints"
    for k in range(5):
        name = f"o{k + 2}" + (" (tip)" if k == 4 else "")
        _line(axes, a.t, shown[:, k], k, name, width=0.9 if whole else 1.5)
    if whole:
        axes.plot(a.t, a.clearance, color=INK, lw=2.2, label="whole arm")
    low, high = _span(np.column_stack([shown, a.clearance]))
    if a.rho < high + 0.6 * (high - min(low, a.rho)):
        _level(axes, (a.rho,), f"{RHO} = {a.rho:g} m")
    else:
        axes.plot([], [], " ", label=f"{RHO} = {a.rho:g} m is above")
    if low < 0.15 * high:
        axes.axhline(0, color=RED, lw=1)
    axes.plot(a.smallest.t, a.smallest.distance, "o", ms=6, mfc="none", mec=INK, label="smallest")
    return _finish(figure, axes, a, columns=8)


def limit_use(a: Analysis) -> Figure:
    """Share of every limit used over time; below it what shaped the commands."""
    active = [name for name in FLAGS if a.flag_shares[name] > 0]
    figure = Figure(figsize=(WIDTH, HEIGHT + 0.25 * len(active)), layout="constrained")
    FigureCanvasAgg(figure)
    if active:
        axes, lanes = figure.subplots(2, 1, sharex=True, height_ratios=[10, len(active) + 0.6])
        _lanes(lanes, a, active)
    else:
        axes = lanes = figure.subplots()
    _dress(axes, "Use of the limits, nearest joint", "share of the limit [%]")
    lanes.set_xlabel("time of motion [s]")
    off = [use.title for use in a.limits if not use.on]
    for k, use in enumerate(use for use in a.limits if use.on):
        _line(axes, use.series_t, 100 * use.series, k, use.title)
    _level(axes, (100,), "limit")
    if off:
        axes.text(
            0.01,
            0.9,
            "off: " + ", ".join(off),
            transform=axes.transAxes,
            va="top",
            color=GREY,
            fontsize=9,
        )
    axes.set_ylim(
        0, max(108.0, 105 * min(DRAWN_MAX, max((u.share for u in a.limits if u.on), default=1)))
    )
    return _finish(figure, axes, a, columns=6)


def timing(a: Analysis) -> Figure | None:
    """Histograms of wake-up lateness and of execution time; None in lockstep: no deadlines."""
    if not a.timing:
        return None
    figure = Figure(figsize=(WIDTH, 3.2), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, 2)
    for axes, values, title, key, colour in (
        (panels[0], a.wake_us, "Lateness of the wake-up", "wake_late_us", BLUE),
        (panels[1], a.exec_us, "Wake-up until the command is sent", "exec_us", ORANGE),
    ):
        _dress(axes, title, "ticks")
        axes.set_xlabel("µs (logarithmic)")
        positive = np.maximum(values, 0.5) if len(values) else np.ones(1)
        edges = np.geomspace(positive.min() * 0.9, positive.max() * 1.1, 60)
        axes.hist(positive, bins=list(edges), color=colour, edgecolor="white", lw=0.3)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_ylim(bottom=0.7)
        _log_ticks(axes.xaxis, float(edges[0]), float(edges[-1]))
        stats = a.timing.get(key, {})
        for name, style in (("p50", ":"), ("p99", "--"), ("max", "-")):
            if name in stats:
                axes.axvline(
                    max(stats[name], 0.5),
                    color=INK,
                    ls=style,
                    lw=1.2,
                    label=f"{name} {stats[name]:.0f} µs",
                )
        if stats:
            axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=3, frameon=False, fontsize=9)
        axes.set_title(title, loc="left", pad=26, fontsize=11, fontweight="bold")
    return figure


def program_times(a: Analysis) -> Figure | None:
    """p99 of the last second over time, a panel a program; None without STATUS, and in lockstep."""
    if not a.programs or a.mode == "lockstep":
        return None
    figure = Figure(figsize=(WIDTH, HEIGHT), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, len(a.programs), sharey=True, squeeze=False)[0]
    for axes, program in zip(panels, a.programs, strict=True):
        _dress(axes, f"Times of the {program.name}, p99 of a second", "")
        axes.set_xlabel("time of motion [s]")
        axes.set_yscale("log")
        inside = (program.t >= a.t[0]) & (program.t <= a.t[-1])
        for k, (key, label) in enumerate(PROGRAM_TIMES.items()):
            _line(axes, program.t[inside], program.p99_us[key][inside], k, label)
        _finish(figure, axes, a, columns=3)
    low, high = panels[0].get_ylim()
    panels[0].set_ylim(low, 2 * high)  # room for the numbers of the events
    panels[0].set_ylabel("µs (logarithmic)")
    _log_ticks(panels[0].yaxis, low, high)
    return figure


# --- several runs ---


def compare(runs: Sequence[tuple[str, Analysis]], what: str) -> Figure:
    """Overlay `deviation` or `distance` (smallest clearance) of several runs."""
    titles = {
        "deviation": ("Distance of the tip to its goal", "|e| [m]"),
        "distance": ("Smallest clearance of the arm", "d [m]"),
    }
    figure, axes = _time_axes(*titles[what])
    for k, (label, a) in enumerate(runs):
        values = a.deviation if what == "deviation" else a.clearance
        _line(axes, a.t, values, k, f"{label} ({RHO} = {a.rho:g} m)", width=2.6 if k == 0 else 1.5)
    if what == "deviation":
        axes.set_ylim(bottom=0)
    _legend(axes, 4)
    return figure


# --- helpers ---


def _time_axes(title: str, unit: str) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(WIDTH, HEIGHT), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    _dress(axes, title, unit)
    axes.set_xlabel("time of motion [s]")
    return figure, axes


def _dress(axes: Axes, title: str, unit: str) -> None:
    axes.set_title(title, loc="left", fontsize=11, fontweight="bold", pad=28)
    axes.set_ylabel(unit)
    axes.grid(color=PALE, lw=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.margins(x=0.01)


def _line(axes: Axes, t: Floats, y: Floats, k: int, label: str, width: float = 1.5) -> None:
    drawn = np.where(np.abs(y) < DRAWN_MAX, y, np.nan)
    look: dict[str, Any] = {"color": COLOURS[k % 6], "ls": STYLES[k % 6], "lw": width}
    axes.plot(*reduce_minmax(t, drawn), label=label, solid_joinstyle="round", **look)


def _joint_lines(axes: Axes, t: Floats, values: Floats, width: float = 1.5) -> None:
    for j in range(6):
        _line(axes, t, values[:, j], j, f"joint {j + 1}", width)


def _level(axes: Axes, values: Sequence[float], label: str) -> None:
    for k, value in enumerate(values):
        axes.axhline(value, color=INK, lw=1.1, ls=(0, (1, 1.5)), label=label if k == 0 else None)


def _span(values: Floats) -> tuple[float, float]:
    finite = values[np.abs(values) < DRAWN_MAX]
    return (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)


def _legend(axes: Axes, columns: int) -> None:
    if columns and axes.get_legend_handles_labels()[1]:
        legend = axes.legend(
            loc="lower left",
            bbox_to_anchor=(-0.01, 1.0),
            ncols=columns,
            frameon=False,
            fontsize=9,
            columnspacing=1.1,
            handlelength=2.2,
            borderaxespad=0.2,
        )
        legend.set_in_layout(False)  # it has room above the axes: it must not narrow them


def _finish(figure: Figure, axes: Axes, a: Analysis, columns: int) -> Figure:
    """Mark the events by their numbers in the table of events, and add the legend."""
    marked = marked_events(a)
    top = axes.get_xaxis_transform()
    last = -np.inf
    for number, event in marked[:EVENT_MARKS_MAX]:
        axes.axvline(event.t, color=GREY, lw=0.9, ls=(0, (4, 3)), zorder=0.5)
        if event.t - last > 0.018 * max(a.duration, 1e-9):
            axes.text(
                event.t,
                0.985,
                str(number),
                transform=top,
                ha="center",
                va="top",
                fontsize=8,
                color=INK,
                bbox={"boxstyle": "round,pad=0.2", "fc": "white", "ec": GREY, "lw": 0.7},
            )
            last = event.t
    _legend(axes, columns)
    return figure


def marked_events(a: Analysis) -> list[tuple[int, Event]]:
    """Return the events drawn in the time plots, with their numbers in the table of events."""
    numbered = enumerate(a.events, start=1)
    return [
        (k, e)
        for k, e in numbered
        if a.t[0] < e.t <= a.t[-1] and not (e.kind == "end" and e.t == a.t[-1])
    ]


def _lanes(axes: Axes, a: Analysis, active: list[str]) -> None:
    """Draw when each flag was set, each span at least as wide as can be seen."""
    least = 0.004 * max(a.duration, 1e-9)
    for k, name in enumerate(active):
        edges = np.diff(np.r_[0, (a.flags & FLAGS[name]) != 0, 0].astype(int))
        first, last = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
        spans = [(a.t[i], max(a.t[j] - a.t[i], least)) for i, j in zip(first, last, strict=True)]
        axes.broken_barh(spans, (k + 0.15, 0.7), color=COLOURS[k % 6])
    axes.set_ylim(0, len(active))
    axes.set_yticks(
        np.arange(len(active)) + 0.5, [name.replace("_", " ") for name in active], fontsize=9
    )
    axes.tick_params(axis="y", length=0)
    axes.spines[["top", "right"]].set_visible(False)


def _log_ticks(axis: Axis, low: float, high: float) -> None:
    """Label a logarithmic axis with plain numbers: 1, 2, 5 of each decade, or 1 alone of many."""
    digits = (1, 2, 5) if high < 60 * low else (1,)
    decades = np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
    ticks = [m * 10**d for d in decades for m in digits if low <= m * 10**d <= high]
    axis.set_ticks(ticks, labels=[f"{v:g}" for v in ticks])
    axis.set_minor_locator(NullLocator())
