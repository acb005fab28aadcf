"""What users get wrong: one clear message, the right exit status, nothing half-written."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from helpers import leeway

from leeway.processes import program

SCENE = "scenarios/c1.yaml"


def _assert_refused(result, status, *words):
    assert result.returncode == status, (result.returncode, result.stderr)
    assert "Traceback" not in result.stderr
    assert len(result.stderr.strip().splitlines()) <= 3, result.stderr
    assert result.stdout == ""
    for word in words:
        assert word in result.stderr, result.stderr


def _edited(root, tmp_path, old, new):
    text = (root / SCENE).read_text()
    assert old in text
    path = tmp_path / "scene.yaml"
    path.write_text(text.replace(old, new))
    return path


EDITS = [
    ("unknown key", "  eta: 3", "  eeta: 3", ["scene.yaml:26", "law.eeta", "unknown key", "eta"]),
    ("missing key", "robot: ur5\n", "", ["robot", "missing key", "ur5"]),
    (
        "text for a number",
        "k_a: 1",
        "k_a: fast",
        ["scene.yaml:25", "law.k_a", "a number > 0", '"fast"'],
    ),
    ("NaN", "eta: 3", "eta: .nan", ["law.eta", ".nan"]),
    ("negative rho", "rho_rep: 0.5", "rho_rep: -0.5", ["law.rho_rep", "> 0", "-0.5"]),
    ("rho = 0", "rho_rep: 0.5", "rho_rep: 0", ["law.rho_rep", "> 0"]),
    ("eta = 0", "eta: 3", "eta: 0", ["law.eta", "> 0"]),
    ("k_a = 0", "k_a: 1", "k_a: 0", ["law.k_a", "> 0"]),
    (
        "5 joints",
        "q0: [0, 0, 0, 0, 0, 0]",
        "q0: [0, 0, 0, 0, 0]",
        ["q0", "6 numbers", "a list of 5"],
    ),
    (
        "q0 outside its range",
        "limits:\n",
        "limits:\n  position_max: [6, 6, 6, 6, 6, -0.1]\n",
        ["q0: joint 6", "-0.1"],
    ),
    ("no YAML", "robot: ur5", "robot: [ur5", ["scene.yaml:", "not YAML"]),
]


@pytest.mark.parametrize(("old", "new", "words"), [e[1:] for e in EDITS], ids=[e[0] for e in EDITS])
def test_scenes(root, tmp_path, old, new, words):
    path = _edited(root, tmp_path, old, new)
    log = tmp_path / "run.lcm"
    _assert_refused(leeway("run", path, "--log", log), 2, *words)
    assert not log.exists()
    for name in ("leeway-controller", "leeway-simulator"):
        result = subprocess.run(
            [program(name), path], capture_output=True, text=True, timeout=10, check=False
        )
        _assert_refused(result, 2, *words)


def test_unreadable_scene(tmp_path):
    _assert_refused(leeway("run", tmp_path / "none.yaml"), 2, "none.yaml", "No such file")
    _assert_refused(leeway("run", tmp_path), 2, "directory")


def test_overrides_are_checked_like_the_file(root, tmp_path):
    log = tmp_path / "run.lcm"
    for override, word in (
        ("law.gama=2", "unknown key"),
        ("law.gamma=3", "<= 2"),
        ("law", "KEY=VALUE"),
    ):
        result = leeway("run", root / SCENE, "--log", log, "--set", override)
        _assert_refused(result, 2, f"--set {override}", word)
    assert not log.exists()


def test_existing_log_is_not_overwritten(root, tmp_path):
    log = tmp_path / "run.lcm"
    log.write_text("precious")
    _assert_refused(leeway("run", root / SCENE, "--log", log), 2, "exists", "--force")
    assert log.read_text() == "precious"


@pytest.mark.usefixtures("private_network")
def test_bus_urls(root, tmp_path):
    log = tmp_path / "run.lcm"
    subprocess.run(["ip", "route", "del", "224.0.0.0/4"], check=True)
    _assert_refused(
        leeway("run", root / SCENE, "--log", log), 1, "no multicast route", "ip route add"
    )
    _assert_refused(leeway("goal", "0", "0", "0"), 1, "no multicast route")
    result = leeway("run", root / SCENE, "--log", log, "--lcm-url", "tcp://here")
    _assert_refused(result, 1, "expected udpm://")
    assert not log.exists()
    for name in ("leeway-controller", "leeway-simulator"):
        command = [program(name), root / SCENE]
        result = subprocess.run(command, capture_output=True, text=True, timeout=10, check=False)
        assert result.returncode == 1
        assert "no multicast route" in result.stderr.splitlines()[-1]


@pytest.mark.usefixtures("private_network")
def test_nobody_answers():
    _assert_refused(leeway("obstacle", "add", "--at", 0, 0, 1), 1, "no controller answered")
    _assert_refused(leeway("goal", "nan", "0", "0"), 2, "expected three numbers")
    _assert_refused(leeway("obstacle", "add", "--at", 0, 0, 1, "--radius", -1), 2, "radius")


@pytest.fixture(scope="module")
def log(tmp_path_factory) -> Path:
    """Log of a short lockstep run, made once."""
    folder = tmp_path_factory.mktemp("log")
    root = Path(__file__).resolve().parents[2]
    path = folder / "good.lcm"
    command = [root / "tools" / "netns", sys.executable, "-m", "leeway", "run", root / SCENE]
    result = subprocess.run(
        [*map(str, command), "--lockstep", "--log", str(path), "--set=duration_s=1"],
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    if result.returncode == 77:
        pytest.skip(result.stderr)
    assert result.returncode == 0, result.stderr
    return path


def test_cut_log_is_reported_to_its_last_whole_event(log, tmp_path):
    cut = tmp_path / "cut.lcm"
    cut.write_bytes(log.read_bytes()[:-100])
    for command in (["info", cut], ["report", cut, "-o", tmp_path / "report"]):
        result = leeway(*command)
        assert result.returncode == 3, result.stderr
        assert "cut in the middle" in result.stderr
        assert "Traceback" not in result.stderr
        assert result.stdout
    assert (tmp_path / "report" / "report.html").exists()


def test_files_that_are_no_log(root, log, tmp_path):
    empty = tmp_path / "empty.lcm"
    empty.write_bytes(b"")
    out = tmp_path / "report"
    for path in (empty, root / SCENE, tmp_path / "none.lcm", tmp_path):
        _assert_refused(leeway("report", path, "-o", out), 1, path.name)
        _assert_refused(leeway("info", path), 1, path.name)
    assert not out.exists()


def test_report_folder_that_cannot_be_written(log, tmp_path):
    blocked = tmp_path / "file"
    shutil.copy(log, blocked)
    _assert_refused(leeway("report", log, "-o", blocked), 1, "cannot write")


def test_help_has_an_example():
    for command in (
        [],
        ["run"],
        ["report"],
        ["info"],
        ["goal"],
        ["stop"],
        ["obstacle", "add"],
        ["demo"],
        ["bench"],
    ):
        result = leeway(*command, "--help")
        assert result.returncode == 0
        assert command == [] or "Example: leeway" in result.stdout


@pytest.mark.parametrize("name", ["a+b", "a(b", "", "x" * 31, "Ärm"])
def test_robot_names_are_no_patterns(root, tmp_path, name):
    result = leeway("run", root / SCENE, "--log", tmp_path / "run.lcm", "--name", name)
    assert result.returncode == 2
    assert "1 to 30 letters" in " ".join(result.stderr.split())
    command = [program("leeway-controller"), root / SCENE, "--name", name]
    result = subprocess.run(command, capture_output=True, text=True, timeout=10, check=False)
    assert result.returncode == 2
    assert "1 to 30 letters" in result.stderr


@pytest.mark.usefixtures("private_network")
def test_logs_that_cannot_be_written(root, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("precious")
    for log in (blocked / "run.lcm", tmp_path):
        result = leeway("run", root / SCENE, "--log", log, "--force")
        _assert_refused(result, 1, "cannot write the log")
    assert blocked.read_text() == "precious"
