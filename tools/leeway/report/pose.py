"""Pictures of the arm in space. Figure objects only.

Units are m, base frame of the arm.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from leeway.logs.analysis import Analysis
from leeway.logs.log import Floats
from leeway.logs.solids import HALFSPACE, SPHERE, Obstacle
from leeway.report.figures import BLUE, COLOURS, GREEN, GREY, INK, ORANGE, RED, RHO, STYLES
from leeway.report.solids import draw_arm, draw_obstacle

POSES = 5
OUTLINES_MAX = 4  # influence spheres drawn: more hide the arm
NAMES_MAX = 12  # names of obstacles written: more cannot be read
FEW = 12  # obstacles drawn strongly
MOVED = 0.02  # m: an obstacle that was so far off is drawn where it was, too
NEAR = 1.6  # m from the base: what is beyond must not make the arm tiny
VIEW = {"elev": 26.0, "azim": -64.0}


def scene_picture(a: Analysis) -> Figure:
    """The arm from start (faint) to end (strong), goal, obstacles with their reach, path."""
    figure, axes = _space()
    rows = np.unique(_even_rows(a))
    lower, upper = _box([a])
    _draw_obstacles(axes, a, rows, (lower, upper))
    for k, row in enumerate(rows):
        joints = np.vstack([np.zeros(3), a.points[row]])
        last = k == len(rows) - 1
        strength = 1.0 if last else 0.25 + 0.35 * k / max(len(rows) - 1, 1)
        label = f"arm at {a.t[row]:.2f} s" if k in (0, len(rows) - 1) else None
        colour = INK if last else GREY
        if k in (0, len(rows) - 1):
            draw_arm(axes, a.robot, a.q[row], BLUE if last else GREY, 0.3 * strength, 18 + last)
        axes.plot(
            *joints.T,
            "-o",
            color=colour,
            lw=4 if last else 2.2,
            ms=5,
            alpha=strength,
            label=label,
            zorder=20 + k,
        )
    axes.plot(*_path(a).T, color=BLUE, lw=2, label="path of the tip", zorder=30)
    for k, goal in enumerate(_goals(a)):
        axes.plot(
            *goal[:, None],
            marker="*",
            ms=14,
            color=GREEN,
            ls="",
            label="goal" if k == 0 else None,
            zorder=31,
        )
    _set_box(axes, lower, upper)
    figure.legend(loc="upper center", ncols=8, frameon=False, fontsize=9, columnspacing=1.3)
    return figure


def compare_paths(runs: Sequence[tuple[str, Analysis]]) -> Figure:
    """Paths of the tip of several runs."""
    figure, axes = _space()
    lower, upper = _box([a for _, a in runs])
    for k, (label, a) in enumerate(runs):
        width = 3.2 if k == 0 else 1.8
        axes.plot(
            *_path(a).T,
            color=COLOURS[k % 6],
            ls=STYLES[k % 6],
            lw=width,
            label=label,
            zorder=20 + k,
        )
        axes.plot(
            *a.tip[-1][:, None],
            marker="os^Dvp"[k % 6],
            ms=7,
            color=COLOURS[k % 6],
            mec=INK,
            ls="",
            zorder=35,
        )
    axes.plot(
        *runs[0][1].tip[0][:, None], marker="X", ms=9, color=INK, ls="", label="start", zorder=36
    )
    goals = {tuple(goal): goal for _, a in runs for goal in _goals(a)}
    for k, goal in enumerate(goals.values()):
        name = "goal" if k == 0 else None
        axes.plot(*goal[:, None], marker="*", ms=15, color=GREEN, ls="", label=name, zorder=31)
    first = runs[0][1]
    _draw_at(axes, _obstacles(first), _left(first), (lower, upper))
    axes.plot(
        [0, 0],
        [0, 0],
        [0, float(runs[0][1].points[0, 0, 2])],
        color=GREY,
        lw=6,
        label="base",
        zorder=12,
    )
    _set_box(axes, lower, upper)
    figure.legend(loc="upper center", ncols=8, frameon=False, fontsize=9, columnspacing=1.3)
    return figure


# --- helpers ---


def _space() -> tuple[Figure, Any]:
    figure = Figure(figsize=(7.4, 5.8))
    FigureCanvasAgg(figure)
    axes: Any = figure.add_axes((0.0, 0.035, 1.0, 0.96), projection="3d", computed_zorder=False)
    axes.view_init(**VIEW)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.set_zlabel("z [m]")
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.pane.set_facecolor("#fafafa")
        axis._axinfo["grid"].update(color="#e3e3e3", linewidth=0.6)
    return figure, axes


def _even_rows(a: Analysis) -> list[int]:
    """Return rows of poses, evenly spaced along the way of the joints, not in time."""
    finite = np.flatnonzero(np.isfinite(a.points).all(axis=(1, 2)))
    way = np.r_[0, np.cumsum(np.linalg.norm(np.diff(a.q[finite], axis=0), axis=1))]
    at = np.searchsorted(way, np.linspace(0, way[-1], POSES)[:-1])
    return [*(int(row) for row in finite[np.minimum(at, len(finite) - 1)]), int(finite[-1])]


def _path(a: Analysis) -> Floats:
    rows = np.unique(np.linspace(0, a.ticks - 1, min(a.ticks, 800)).astype(int))
    path: Floats = a.tip[rows]
    return path


def _goals(a: Analysis) -> list[Floats]:
    """Return the different goals, in order."""
    edges = np.flatnonzero(np.any(np.diff(a.goal, axis=0) != 0, axis=1)) + 1
    return [a.goal[row] for row in np.r_[0, edges]]


def _obstacles(a: Analysis) -> list[Obstacle]:
    """Return every obstacle of the run, where it was last."""
    firsts = np.r_[0, np.flatnonzero(np.diff(a.world.index)) + 1]
    last = {o.id: o for row in firsts for o in a.world.worlds[a.world.index[row]]}
    return list(last.values())


def _left(a: Analysis) -> set[int]:
    """Return the ids of the obstacles that are there at the end."""
    return {o.id for o in a.world.worlds[a.world.index[-1]]}


def _nearest_row(a: Analysis) -> int:
    """Return the tick with the smallest distance to an obstacle, the last one without any."""
    return int(np.argmin(np.abs(a.t - a.smallest.t))) if np.isfinite(a.smallest.t) else -1


def _box(runs: list[Analysis]) -> tuple[Floats, Floats]:
    """Return a cube around arm, goals and obstacles near it."""
    clouds = [np.zeros((1, 3))]
    for a in runs:
        clouds += [a.points.reshape(-1, 3), a.goal]
        for o in [*_obstacles(a), *a.world.worlds[a.world.index[_nearest_row(a)]]]:
            if o.shape != HALFSPACE and np.linalg.norm(o.p) < NEAR:
                clouds += [o.core - o.radius, o.core + o.radius]
    cloud = np.vstack(clouds)
    cloud = cloud[np.isfinite(cloud).all(axis=1)]
    cloud = cloud[(np.abs(cloud) < 3).all(axis=1)]
    lower, upper = cloud.min(axis=0), cloud.max(axis=0)
    upper[2] = max(upper[2], lower[2] + 0.9)
    middle, half = (lower + upper) / 2, 1.06 * np.maximum((upper - lower) / 2, [0.4, 0.4, 0.5])
    return middle - half, middle + half


def _set_box(axes: Any, lower: Floats, upper: Floats) -> None:
    for set_limits, low, high in zip(
        (axes.set_xlim, axes.set_ylim, axes.set_zlim), lower, upper, strict=True
    ):
        set_limits(low, high)
    # Seen from the side a flat scene may fill the width; a tall one needs its height.
    size = upper - lower
    tallness = float(size[2] / np.linalg.norm(size))
    axes.set_box_aspect(size, zoom=float(np.clip(1.18 - 0.8 * (tallness - 0.4), 0.85, 1.18)))
    for artist in (*axes.lines, *axes.collections):
        artist.set_clip_on(False)  # the square that 3-D axes clip to is smaller than the picture


def _draw_obstacles(axes: Any, a: Analysis, rows: Any, box: tuple[Floats, Floats]) -> None:
    """Draw the obstacles where they were last; faintly where they were nearest or at a pose."""
    obstacles = _obstacles(a)
    _draw_at(axes, obstacles, _left(a), box)
    last = {o.id: o for o in obstacles}
    nearest = _nearest_row(a)
    for row in (*rows[:-1], nearest):
        for o in a.world.worlds[a.world.index[row]]:
            if np.linalg.norm(np.subtract(o.p, last[o.id].p)) > MOVED and _is_in(o, box):
                draw_obstacle(axes, o, box, RED, 0.3 if row == nearest else 0.12)
    balls = [o for o in obstacles if o.shape == SPHERE][:OUTLINES_MAX]
    for k, o in enumerate(balls if len(obstacles) <= NAMES_MAX else []):
        label = f"reach {RHO} = {a.rho:g} m" if k == 0 else None
        _outline(axes, np.array(o.p), o.radius + a.rho, box, label)


def _draw_at(
    axes: Any, obstacles: list[Obstacle], left: set[int], box: tuple[Floats, Floats]
) -> None:
    """Draw obstacles that are near, with their names when they are few."""
    few = len(obstacles) <= FEW
    for o in obstacles:
        if not _is_in(o, box):
            continue
        if o.shape == SPHERE and o.radius == 0:
            axes.plot(*np.array(o.p)[:, None], marker="o", ms=8, color=RED, mec=INK, zorder=15)
        else:
            draw_obstacle(axes, o, box, RED, 0.6 if few else 0.3)
        if len(obstacles) <= NAMES_MAX:
            name = f"obstacle {o.id}" + ("" if o.id in left else " (removed)")
            x, y, z = np.clip(o.p, box[0], box[1]) if o.shape == HALFSPACE else o.p
            top = z if o.shape == HALFSPACE else o.core[:, 2].max() + o.radius
            axes.text(x, y, top + 0.05, name, color=INK, fontsize=9, ha="center", zorder=40)


def _is_in(o: Obstacle, box: tuple[Floats, Floats]) -> bool:
    """Whether the middle of an obstacle lies in the picture; a plane may always."""
    return o.shape == HALFSPACE or bool(((o.p >= box[0]) & (o.p <= box[1])).all())


def _outline(
    axes: Any, centre: Floats, radius: float, box: tuple[Floats, Floats], label: str | None
) -> None:
    """Draw meridians and parallels of a sphere, only where they are inside of the box."""
    angle = np.linspace(0, 2 * np.pi, 361)
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)])
    count = int(np.clip(np.ceil(radius / 0.1), 5, 24))
    rings = []
    for latitude in np.linspace(-np.pi / 2, np.pi / 2, count + 1)[1:-1]:
        rings.append(np.cos(latitude) * circle + np.array([[0], [0], [np.sin(latitude)]]))
    for turn in np.linspace(0, np.pi, count, endpoint=False):
        across = np.array([np.cos(turn), np.sin(turn), 0.0])
        rings.append(np.outer(across, np.cos(angle)) + np.outer([0, 0, 1.0], np.sin(angle)))
    for ring in rings:
        line = centre[:, None] + radius * ring
        inside = ((line >= box[0][:, None]) & (line <= box[1][:, None])).all(axis=0)
        if inside.any():
            line[:, ~inside] = np.nan
            axes.plot(*line, color=ORANGE, lw=0.7, alpha=0.7, label=label, zorder=10)
            label = None
    if label:
        axes.plot([], [], [], color=ORANGE, lw=0.9, label=f"{label} (not in the picture)")
