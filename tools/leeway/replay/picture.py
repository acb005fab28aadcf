"""Picture of a what-if: recorded and other commands over time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from leeway.logs.log import Floats
from leeway.replay.whatif import WhatIf
from leeway.report.figures import COLOURS, GREY, PALE, WIDTH, reduce_minmax


def write_picture(w: WhatIf, folder: Path) -> Path:
    """Write a PNG into a folder, made when it is missing; return its path."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"what-if-{w.session}.png"
    draw(w).savefig(path, dpi=150)
    return path


def draw(w: WhatIf) -> Figure:
    """Commanded joint speeds, recorded and other, and below them what changed."""
    figure = Figure(figsize=(WIDTH, 6.0), layout="constrained")
    FigureCanvasAgg(figure)
    speeds, changes = figure.subplots(2, 1, sharex=True, height_ratios=[3, 2])
    _dress(speeds, f"Open loop: {', '.join(w.sets)}", "q̇ [rad/s]", pad=28)
    _dress(changes, "Other minus recorded", "Δq̇ [rad/s]", pad=8)
    changes.set_xlabel("time of motion [s]")
    # The motion of the newest plant, from the last tick before it on.
    begin = int(np.flatnonzero(np.diff(w.t, prepend=w.t[:1]) < 0)[-1:].sum())
    moving = slice(begin + max(0, int(np.count_nonzero(w.t[begin:] == 0)) - 1), None)
    for j, colour in enumerate(COLOURS):
        recorded, other = w.qd[moving, j], w.other_qd[moving, j]
        _line(speeds, w.t[moving], recorded, color=colour, lw=2.4, alpha=0.35)
        _line(speeds, w.t[moving], other, color=colour, lw=1.1, label=f"joint {j + 1}")
        _line(changes, w.t[moving], other - recorded, color=colour, lw=1.1)
    speeds.plot([], [], color=GREY, lw=2.4, alpha=0.5, label="recorded")
    speeds.legend(loc="lower left", bbox_to_anchor=(-0.01, 1.0), ncols=7, frameon=False, fontsize=9)
    return figure


def _line(axes: Axes, t: Floats, y: Floats, **look: object) -> None:
    axes.plot(*reduce_minmax(t, y), solid_joinstyle="round", **look)  # type: ignore[arg-type]


def _dress(axes: Axes, title: str, unit: str, pad: float) -> None:
    axes.set_title(title, loc="left", fontsize=11, fontweight="bold", pad=pad)
    axes.set_ylabel(unit)
    axes.grid(color=PALE, lw=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.margins(x=0.01)
