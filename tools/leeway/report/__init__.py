"""One HTML page about one or several runs: self-contained, opens from disk, asks no host.

Beside the page lies a PNG twin of every picture.
"""

from __future__ import annotations

import base64
import io
import json
import re
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from matplotlib.figure import Figure

from leeway.logs.analysis import Analysis
from leeway.logs.solids import HALFSPACE, Obstacle
from leeway.report import figures, pose
from leeway.report.solids import polygon_in

PAGE = "report.html"
FRAMES_MAX, FRAMES_MIN = 400, 50
SOLIDS_MAX = 20000  # in all frames of the 3-D view: more make the page slow
PLANE_HALF = 1.2  # m: planes are shown this far around the base
PNG_DPI = 160
DIGITS = 4  # of positions in the 3-D view: a tenth of a millimetre


@dataclass(frozen=True)
class Picture:
    """A figure in the page."""

    file: str  # name of its PNG twin
    alt: str
    svg: str  # data URL


@dataclass(frozen=True)
class Section:
    """What the template shows of one run."""

    label: str
    slug: str
    a: Analysis
    marked: set[int]  # numbers of the events that the plots mark
    pictures: dict[str, Picture]
    parameters: list[tuple[str, str]]
    view: dict[str, Any]


@np.errstate(over="ignore", invalid="ignore")  # damaged numbers are drawn as gaps
def write_report(
    analyses: Sequence[Analysis], out_dir: Path, progress: Callable[[str], None] | None = None
) -> Path:
    """Write the page and the PNG twins of its pictures.

    Parameters
    ----------
    analyses
        At least one run; several are compared first, then shown one by one.
    out_dir
        Folder, made when it is missing. Files of the same names are replaced.
    progress
        Called with a few words before each picture.

    Returns
    -------
    Path
        The page, report.html in `out_dir`.

    Raises
    ------
    ValueError
        No runs.
    OSError
        The folder cannot be written.
    """
    if not analyses:
        raise ValueError("expected at least one run, found none")
    out_dir = Path(out_dir)
    out_dir.mkdir(parents=True, exist_ok=True)
    # Everything or nothing: an interrupted report leaves the folder as it was.
    with tempfile.TemporaryDirectory(prefix=".", dir=out_dir) as scratch:
        _write(analyses, Path(scratch), progress or (lambda _: None))
        for path in sorted(Path(scratch).iterdir()):
            path.replace(out_dir / path.name)
    return out_dir / PAGE


def _write(analyses: Sequence[Analysis], folder: Path, say: Callable[[str], None]) -> None:
    """Write all files of a report into a folder."""
    runs = list(zip(_labels(analyses), analyses, strict=True))
    slugs = _slugs([label for label, _ in runs])
    sections = [
        _section(label, slug, a, _Writer(folder, slug, say))
        for (label, a), slug in zip(runs, slugs, strict=True)
    ]
    comparison = _comparison(runs, _Writer(folder, "compare", say)) if len(runs) > 1 else {}
    say("page")
    (folder / PAGE).write_text(_render(sections, comparison), encoding="utf-8")


# --- pictures ---


@dataclass(frozen=True)
class _Writer:
    """Writes the PNG twin of a figure and returns the figure as SVG for the page."""

    folder: Path
    slug: str
    say: Callable[[str], None]

    def __call__(self, name: str, alt: str, figure: Figure) -> Picture:
        self.say(f"{self.slug} {name}")
        file = f"{self.slug}_{name}.png"
        figure.savefig(self.folder / file, dpi=PNG_DPI)
        figure.set_layout_engine("none")  # it stays as laid out: the second drawing is faster
        buffer = io.BytesIO()
        figure.savefig(buffer, format="svg", dpi=PNG_DPI, metadata={"Date": None})
        url = "data:image/svg+xml;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")
        return Picture(file, alt, url)


def _section(label: str, slug: str, a: Analysis, write: _Writer) -> Section:
    final = f"{a.final_deviation:.4f} m"
    pictures = {
        "pose": write(
            "pose", f"{label}: the arm from start to end, goal, obstacles", pose.scene_picture(a)
        ),
        "q": write("q", f"{label}: joint positions over time", figures.joint_positions(a)),
        "qd": write("qd", f"{label}: commanded joint speeds over time", figures.joint_speeds(a)),
        "deviation": write(
            "deviation", f"{label}: deviation over time, {final} at the end", figures.deviation(a)
        ),
        "distance": write(
            "distance", f"{label}: distance to obstacles over time", figures.distances(a)
        ),
        "limits": write(
            "limits", f"{label}: share of the limits used over time", figures.limit_use(a)
        ),
    }
    timing = figures.timing(a)
    if timing is not None:
        pictures["timing"] = write(
            "timing", f"{label}: histograms of wake lateness and execution", timing
        )
    programs = figures.program_times(a)
    if programs is not None:
        pictures["programs"] = write(
            "programs", f"{label}: lateness, execution and age of input over time", programs
        )
    marked = {number for number, _ in figures.marked_events(a)}
    return Section(label, slug, a, marked, pictures, list(_flat(a.scene)), view_data(a))


def _comparison(runs: list[tuple[str, Analysis]], write: _Writer) -> dict[str, Picture]:
    return {
        "deviation": write(
            "deviation", "deviation over time of all runs", figures.compare(runs, "deviation")
        ),
        "distance": write(
            "distance", "smallest distance over time of all runs", figures.compare(runs, "distance")
        ),
        "tip": write("tip", "paths of the tip of all runs", pose.compare_paths(runs)),
    }


# --- data ---


def view_data(a: Analysis) -> dict[str, Any]:
    """Return what the 3-D view moves: at most 400 frames, with the last tick among them.

    A solid is [id, number of its form, x, y, z]. A form has core points c, from there, which a ball
    of radius r sweeps; planes have corners. Solids that look alike share one, in all frames.

    Returns
    -------
    dict
        t (k) s, arm (k, 18) m, world (k) and goal (k) indices, worlds, forms, goals, rho.
    """
    most = max((len(world) for world in a.world.worlds), default=0)
    frames = int(np.clip(SOLIDS_MAX // max(most, 1), FRAMES_MIN, FRAMES_MAX))
    rows = np.unique(np.linspace(0, a.ticks - 1, min(a.ticks, frames)).round().astype(int))
    rows = rows[np.isfinite(a.points[rows]).all(axis=(1, 2))]
    goals, goal_index = np.unique(a.goal[rows], axis=0, return_inverse=True)
    shown, world_index = np.unique(a.world.index[rows], return_inverse=True)
    forms: dict[str, int] = {}
    worlds = [[_solid(o, forms) for o in a.world.worlds[k]] for k in shown]
    return {
        "t": _rounded(a.t[rows]),
        "arm": [_rounded(points.ravel()) for points in a.points[rows]],
        "world": world_index.ravel().tolist(),
        "worlds": worlds,
        "forms": [json.loads(form) for form in forms],
        "goal": goal_index.ravel().tolist(),
        "goals": [_rounded(goal) for goal in goals],
        "rho": a.rho,
    }


def _solid(o: Obstacle, forms: dict[str, int]) -> list[float]:
    """Return what the 3-D view draws of an obstacle; a form not seen before joins the others."""
    plane = o.shape == HALFSPACE
    half = np.full(3, PLANE_HALF)
    core = polygon_in(o, -half, half) if plane else o.core
    points = [_rounded(point) for point in core - np.array(o.p)]
    form = {"r": round(o.radius, DIGITS), "c": points} | ({"plane": True} if plane else {})
    number = forms.setdefault(json.dumps(form), len(forms))
    return [o.id, number, *_rounded(np.array(o.p))]


def _rounded(values: np.ndarray[Any, np.dtype[np.float64]]) -> list[float]:
    return [round(float(v), DIGITS) + 0.0 for v in values]  # no -0.0


def _flat(value: Any, key: str = "") -> Iterator[tuple[str, str]]:
    """Yield the keys of a scene with their values as text, as in limits.velocity."""
    if isinstance(value, dict):
        for name, item in value.items():
            yield from _flat(item, f"{key}.{name}" if key else name)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for number, item in enumerate(value, start=1):
            yield f"{key}[{number}]", ", ".join(f"{k} {v}" for k, v in _flat(item))
    else:
        yield key, _text(value)


def _text(value: Any) -> str:
    if isinstance(value, list):
        items = [_text(v) for v in value]
        same = len(items) > 1 and len(set(items)) == 1
        return f"{items[0]}, each" if same else ", ".join(items) or "none"
    if isinstance(value, float):
        return "off" if np.isinf(value) else f"{value:.6g}"
    return str(value)


def _labels(analyses: Sequence[Analysis]) -> list[str]:
    """Return names that tell the runs apart: scene, else with mode, else with the log's name."""
    for name in (
        lambda a: a.label,
        lambda a: f"{a.label} ({a.mode})",
        lambda a: f"{a.label} ({a.path.stem})",
    ):
        labels = [name(a) for a in analyses]
        if len(set(labels)) == len(labels):
            return labels
    return [f"{number}: {a.label}" for number, a in enumerate(analyses, start=1)]


def _slugs(labels: list[str]) -> list[str]:
    """Return names for files: no two alike, none of them `compare`."""
    taken = {"compare"}
    slugs = []
    for label in labels:
        base = re.sub(r"[^A-Za-z0-9]+", "-", label).strip("-").lower() or "run"
        slug = next(
            s for s in (base, *(f"{base}-{k}" for k in range(2, len(labels) + 3))) if s not in taken
        )
        taken.add(slug)
        slugs.append(slug)
    return slugs


def _render(sections: list[Section], comparison: dict[str, Picture]) -> str:
    folder = Path(__file__).parent / "templates"
    environment = Environment(
        loader=FileSystemLoader(folder),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["number"] = _number
    environment.filters["names"] = _names
    title = "Leeway: " + ", ".join(section.label for section in sections)
    views = {section.slug: section.view for section in sections}
    return environment.get_template("report.html.j2").render(
        title=title,
        sections=sections,
        comparison=comparison,
        views=json.dumps(views, separators=(",", ":")),
    )


def _names(names: list[str]) -> str:
    return ", ".join(names).replace("_", " ") or "none"


def _number(value: float, digits: int = 4, missing: str = "\N{EN DASH}") -> str:
    return f"{value:.{digits}f}" if np.isfinite(value) else missing
