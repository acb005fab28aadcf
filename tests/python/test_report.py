"""Pictures and page: spikes survive, nothing is fetched, everything is there."""

from __future__ import annotations

import base64
import json
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from log_maker import CONTROLLER, SOURCE, Run, obstacles, scene, see
from typer.testing import CliRunner

from leeway.cli import app
from leeway.logs.analysis import Analysis, analyse
from leeway.logs.log import read_log
from leeway.report import write_report
from leeway.report.figures import (
    deviation,
    joint_positions,
    marked_events,
    program_times,
    reduce_minmax,
    timing,
)

PICTURES = {"pose", "q", "qd", "deviation", "distance", "limits", "timing"}


def analysed(folder: Path, run: Run | None = None, **scene_fields: str) -> Analysis:
    run = run or Run()
    run.before[1] = ("SCENE", scene(CONTROLLER, **scene_fields))
    return analyse(read_log(run.write(folder)))


def page_data(html: str) -> dict[str, Any]:
    found = re.search(r'<script type="application/json" id="views">(.*?)</script>', html, re.DOTALL)
    assert found
    views: dict[str, Any] = json.loads(found[1])
    return views


# --- reduction ---


@settings(max_examples=50, deadline=None)
@given(n=st.integers(2001, 60_000), at=st.floats(0, 1), up=st.booleans())
def test_a_spike_of_one_tick_survives(n: int, at: float, up: bool) -> None:
    t = np.linspace(0, 8, n)
    y = np.sin(t)
    row = int(at * (n - 1))
    y[row] = 50.0 if up else -50.0
    few_t, few_y = reduce_minmax(t, y, columns=500)
    assert len(few_t) <= 2 * 500 + 2
    assert few_y[few_t == t[row]].tolist() == [y[row]]
    assert (np.diff(few_t) > 0).all()
    assert (few_t[0], few_t[-1]) == (t[0], t[-1])
    assert np.isin(few_y, y).all()


def test_short_signals_and_gaps_are_left_alone() -> None:
    t, y = np.arange(100.0), np.arange(100.0)
    assert reduce_minmax(t, y)[1] is y
    t = np.arange(10_000.0)
    y = np.where((t > 3000) & (t < 6000), np.nan, 1.0)
    few_t, few_y = reduce_minmax(t, y, columns=100)
    assert np.isnan(few_y[(few_t > 3100) & (few_t < 5900)]).all()
    assert (few_y[few_t < 2900] == 1).all()
    y = np.where(t % 3 == 0, np.nan, 1.0)
    y[5000] = 0.5
    few_t, few_y = reduce_minmax(t, y, columns=100)
    assert few_y[few_t == 5000].tolist() == [0.5]
    assert np.isfinite(few_y[1:-1]).all()


def test_the_spike_reaches_the_picture(tmp_path: Path) -> None:
    a = analysed(tmp_path)
    n = 40_000
    long = np.full(n, 0.5)
    long[12_345] = 3.0
    figure = deviation(replace(a, t=np.linspace(0, 8, n), deviation=long, events=[]))
    line = figure.axes[0].lines[0]
    assert max(line.get_ydata()) == 3.0
    assert len(line.get_ydata()) < 2100
    assert figure.axes[0].get_ylim()[1] > 3


# --- pictures ---


def test_events_are_marked_where_they_happen(tmp_path: Path) -> None:
    run = Run()
    run.inserted[20] = [("OBSTACLES", obstacles(SOURCE, 1, 0, [(9, (0.5, 0.5, 0.5), 0.1)]))]
    for command in run.commands[20:]:
        command.world_session, command.world_seq = SOURCE, 1
    a = analysed(tmp_path, run)
    assert [(number, event.kind) for number, event in marked_events(a)] == [(3, "obstacle")]
    axes = joint_positions(a).axes[0]
    assert [line.get_xdata()[0] for line in axes.lines if len(line.get_xdata()) == 2] == [
        pytest.approx(0.16)
    ]
    assert [text.get_text() for text in axes.texts] == ["3"]


def test_every_axis_has_a_unit_and_legends_stay_off_the_data(tmp_path: Path) -> None:
    axes = joint_positions(analysed(tmp_path)).axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time of motion [s]", "q [rad]")
    legend = axes.get_legend()
    assert legend is not None
    axes.figure.draw_without_rendering()
    assert legend.get_window_extent().y0 >= axes.get_window_extent().y1 - 1


def test_lockstep_has_no_timing_picture(tmp_path: Path) -> None:
    assert timing(analysed(tmp_path, mode="lockstep")) is None
    assert timing(analysed(tmp_path)) is not None


def test_times_of_the_programs_are_drawn_from_status(tmp_path: Path) -> None:
    run = Run()
    told = run.tell(STATUS={24: 2})
    told["STATUS"][5].wake_late_ns = [20_000, 777_000, 900_000, 900_000]
    told["PLANT_STATUS"][0].age_ns = [0] * 4  # nothing was expected yet
    a = analysed(tmp_path, run)
    figure = program_times(a)
    assert figure is not None
    controller, simulator = figure.axes
    lines = {str(line.get_label()): line for line in controller.lines}
    assert lines["wake-up late"].get_ydata().tolist() == [40.0] * 5 + [777.0] + [40.0] * 3
    assert np.isnan(simulator.lines[2].get_ydata()[0])
    assert controller.get_ylim()[1] > 4000
    number = next(k for k, e in enumerate(a.events, start=1) if e.kind == "fault")
    assert [text.get_text() for text in controller.texts] == [str(number)]
    assert program_times(analysed(tmp_path)) is None
    assert program_times(analysed(tmp_path, run, mode="lockstep")) is None


# --- page ---


class _Links(HTMLParser):
    """Collects what a page refers to, and its unclosed elements."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.links += [
            value or "" for name, value in attrs if name in ("src", "href", "srcset", "data")
        ]
        if tag not in ("meta", "img", "input", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_page_is_self_contained_and_whole(tmp_path: Path) -> None:
    said: list[str] = []
    a = analysed(tmp_path)
    page = write_report([a], tmp_path / "out" / "deep", said.append)
    assert page == tmp_path / "out" / "deep" / "report.html"
    html = page.read_text(encoding="utf-8")
    links = _Links()
    links.feed(html)
    assert links.open == []
    assert all(link.startswith(("data:image/svg+xml;base64,", "#")) for link in links.links)
    assert not re.search(r"fetch\(|import\(|XMLHttpRequest|@import|url\(", html)
    svgs = [
        base64.b64decode(link.split(",")[1]) for link in links.links if link.startswith("data:")
    ]
    assert len(svgs) == len(PICTURES)
    for svg in svgs:
        assert not re.search(rb'(href|src)="(?!#|data:)', svg)
    assert {path.name for path in page.parent.glob("*.png")} == {
        f"test_{name}.png" for name in PICTURES
    }
    assert {f"test {name}" for name in PICTURES} <= set(said)
    assert str(tmp_path) not in html
    assert f"{a.final_deviation:.4f}" in html
    assert "end of the scene" in html


def test_programs_have_a_row_each_in_the_page_and_in_info(tmp_path: Path) -> None:
    run = Run()
    last = run.tell()["STATUS"][-1]
    last.faults_ever, last.refused[last.OTHER_PLANT], last.skipped = last.PEER_TIMEOUT, 47, 31
    a = analysed(tmp_path, run)
    html = write_report([a], tmp_path / "out").read_text(encoding="utf-8")
    table = html[html.index("<h3>Programs") : html.index("<h3>Limits")]
    assert table.count("<tr>") == 3
    for words in ("<td>controller<", "<td>simulator<", "peer timeout", "47 other plant", "31 skip"):
        assert words in table
    assert (tmp_path / "out" / "test_programs.png").exists()
    assert 'alt="test: lateness, execution and age of input over time"' in html
    shown = CliRunner().invoke(app, ["info", str(a.path)]).stdout
    assert "controller             running, 125 Hz, real time fifo, locked" in shown
    assert "faults ever peer_timeout" in shown
    assert "skipped 31" in shown
    assert "refused other_plant 47" in shown
    assert "wake_late 20 / 40 / 60 / 80" in shown


@pytest.mark.parametrize(
    ("mode", "why"),
    [
        ("realtime", "no STATUS of them in this log"),
        ("lockstep", "in lockstep the programs tell no STATUS"),
    ],
)
def test_programs_that_told_nothing_are_no_table(tmp_path: Path, mode: str, why: str) -> None:
    a = analysed(tmp_path, mode=mode)
    assert why in write_report([a], tmp_path / "out").read_text(encoding="utf-8")
    assert why in CliRunner().invoke(app, ["info", str(a.path)]).stdout


def test_names_from_a_log_cannot_become_markup(tmp_path: Path) -> None:
    a = analysed(tmp_path, file="runs/<script>alert(1)<|script>.yaml", build="</script><b>")
    html = write_report([a], tmp_path / "out").read_text(encoding="utf-8")
    assert "<script>alert" not in html
    assert "<b>" not in html
    assert len(page_data(html)) == 1


def test_view_holds_at_most_400_frames_and_the_last_tick(tmp_path: Path) -> None:
    run = Run(ticks=951, speed=0.1)
    run.inserted[700] = [("OBSTACLES", obstacles(SOURCE, 1, 0, [(9, (0.5, 0.5, 0.5), 0.1)]))]
    for command in run.commands[700:]:
        command.world_session, command.world_seq = SOURCE, 1
    a = analysed(tmp_path, run)
    view = page_data(write_report([a], tmp_path / "out").read_text(encoding="utf-8"))["test"]
    assert len(view["t"]) == len(view["arm"]) == len(view["world"]) == len(view["goal"]) == 400
    assert (view["t"][0], view["t"][-1]) == (0, 7.6)
    assert view["arm"][-1] == pytest.approx(a.points[-1].ravel(), abs=1e-4)
    assert [len(view["worlds"][k]) for k in (view["world"][0], view["world"][-1])] == [1, 2]
    assert view["goals"][view["goal"][0]] == [0.5, -0.6, 0.5]


def test_a_crowd_that_trembles_weighs_little_and_stands_where_it_was_told(tmp_path: Path) -> None:
    # 128 boxes, told anew 40 times, each time elsewhere, as a sensor with noise tells them.
    run, random = Run(ticks=81), np.random.default_rng(5)
    told = 0
    for row in range(1, 81, 2):
        for first in range(100, 228, 32):
            told += 1
            at = [(n, (*random.uniform(0.4, 1.2, 3),), 0.0) for n in range(first, first + 32)]
            message = obstacles(SOURCE, told, 0, at)
            for slot in message.o:
                slot.shape, slot.size = slot.BOX, [0.05, 0.02, 0.03]
                slot.quat = [np.cos(slot.id), np.sin(slot.id), 0, 0]
            run.inserted.setdefault(row, []).append(("OBSTACLES", message))
        see(run, slice(row, None), SOURCE, told)
    a = analysed(tmp_path, run)
    page = write_report([a], tmp_path / "out")
    assert page.stat().st_size < 1_500_000
    view = page_data(page.read_text(encoding="utf-8"))["test"]
    forms, shown = view["forms"], view["worlds"][view["world"][-1]]
    assert len(forms) == 129
    for o, (number, form, *p) in zip(a.world.worlds[-1], shown, strict=True):
        assert number == o.id
        assert np.array(forms[form]["c"]) + p == pytest.approx(o.core, abs=1.1e-4)


def test_several_runs_are_compared_and_told_apart(tmp_path: Path) -> None:
    one = analysed(tmp_path)
    two = replace(one, path=tmp_path / "other.lcm", scene=one.scene)
    page = write_report([one, two], tmp_path / "out")
    html = page.read_text(encoding="utf-8")
    names = {path.name for path in page.parent.glob("*.png")}
    assert {"compare_deviation.png", "compare_distance.png", "compare_tip.png"} <= names
    assert {"test-run_q.png", "test-other_q.png"} <= names
    assert list(page_data(html)) == ["test-run", "test-other"]
    assert html.count("<tr>\n  <td><a href=") == 2


def test_runs_without_obstacle_or_with_a_single_tick_have_a_page(tmp_path: Path) -> None:
    empty, short = Run(ticks=5), Run(ticks=2)
    empty.before[2] = ("OBSTACLES", obstacles(11, 1, 2, []))
    short.commands.pop()
    for number, run in enumerate((empty, short)):
        page = write_report([analysed(tmp_path, run)], tmp_path / str(number))
        assert page.stat().st_size > 10_000


def test_no_runs_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="at least one run"):
        write_report([], tmp_path)


def test_reports_can_be_written_by_threads(tmp_path: Path) -> None:
    a = analysed(tmp_path)
    with ThreadPoolExecutor(2) as pool:
        pages = list(pool.map(lambda k: write_report([a], tmp_path / str(k)), range(2)))
    assert all(len(page.read_bytes()) > 100_000 for page in pages)
