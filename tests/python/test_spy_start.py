"""`leeway spy` starts lcm-spy as it should, or says what is missing."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from leeway import spy
from leeway.doctor import programs
from leeway.doctor.machine import Machine
from leeway.processes import ProgramMissing

# A Java that starts, as the doctor asks it; a script in place of lcm-spy tells how it was started.
JAVA = """#!/bin/sh
echo '    java.home = {home}'
echo '    java.version = 17.0.1'
"""
LCM_SPY = """#!/bin/sh
echo "$$ $LCM_DEFAULT_URL|$CLASSPATH|$LEEWAY_NAME|$*"
"""


def script(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)
    return path


@pytest.fixture
def display(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Listen where an X server of number 7 would."""
    monkeypatch.setattr(spy, "X_SOCKETS", str(tmp_path / "X"))
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / "X7"))
        server.listen()
        yield server


@pytest.mark.usefixtures("display")
@pytest.mark.parametrize("name", [":7", ":7.0", "unix:7"])
def test_a_display_that_answers_is_taken(name: str) -> None:
    spy.check_display(name)


@pytest.mark.usefixtures("display")
@pytest.mark.parametrize("name", [":8", ":", "7", "localhost:4000", "localhost:99999999", ":7x"])
def test_a_display_that_does_not_answer_is_refused(name: str) -> None:
    with pytest.raises(spy.SpyMissing, match=f"nothing answers at DISPLAY={name}: .*ssh -X"):
        spy.check_display(name)


def test_no_display_is_told() -> None:
    with pytest.raises(spy.SpyMissing, match="DISPLAY is not set"):
        spy.check_display("")


def test_a_class_path_of_ones_own_stays() -> None:
    given = {"CLASSPATH": "mine.jar", "HOME": "here"}
    made = spy.environment("udpm://239.255.76.67:7668?ttl=0", None, Path("leeway-spy.jar"), given)
    assert made == {
        "LCM_DEFAULT_URL": "udpm://239.255.76.67:7668?ttl=0",
        "CLASSPATH": "leeway-spy.jar:mine.jar",
        "LEEWAY_NAME": "",
        "HOME": "here",
    }
    assert spy.environment("", "ARM1", Path("a.jar"), {})["CLASSPATH"] == "a.jar"


def found(jar: Path | None, lcm_spy: Path) -> Any:
    """Stand in for `program`."""

    def program(name: str) -> Path:
        if name == "lcm-spy":
            return lcm_spy
        if jar is None:
            raise ProgramMissing(f"{name} is not installed")
        return jar

    return program


@pytest.fixture
def equipped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, display: Any, private_network: None
) -> Path:
    """Have all that is needed, in a folder; a test takes something away."""
    home = tmp_path / "jvm"
    script(tmp_path / "bin/java", JAVA.format(home=home))
    script(home / "lib/libawt_xawt.so", "")
    program = found(tmp_path / "leeway-spy.jar", script(tmp_path / "lcm-spy", LCM_SPY))
    monkeypatch.setattr(spy, "program", program)
    monkeypatch.setattr(programs, "program", program)
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}:/usr/bin:/bin")
    monkeypatch.setenv("DISPLAY", ":7")
    monkeypatch.delenv("CLASSPATH", raising=False)
    return tmp_path


def test_the_bus_goes_by_the_variable_and_no_option(equipped: Path) -> None:
    command, environment = spy.prepare("udpm://239.255.76.67:7700?ttl=0", "ARM1")
    said = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    url, classes, robot, options = said.stdout.strip().partition(" ")[2].split("|")
    assert url == "udpm://239.255.76.67:7700?ttl=0"
    assert (classes, robot) == (str(equipped / "leeway-spy.jar"), "ARM1")
    assert options == "--title ARM1"


def test_what_is_missing_is_told_with_the_command_that_brings_it(
    equipped: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (equipped / "jvm/lib/libawt_xawt.so").unlink()
    with pytest.raises(spy.SpyMissing, match=r"headless.*apt-get install default-jre"):
        spy.prepare(None, None)
    (equipped / "bin/java").unlink()
    monkeypatch.setenv("PATH", str(equipped / "bin"))
    with pytest.raises(spy.SpyMissing, match=r"no Java.*apt-get install default-jre"):
        spy.prepare(None, None)
    without = found(None, equipped / "lcm-spy")
    monkeypatch.setattr(programs, "program", without)
    with pytest.raises(
        spy.SpyMissing, match=r"no JDK.*apt-get install default-jdk && \./dev setup"
    ):
        spy.prepare(None, None)


def test_the_doctor_knows_the_plugin(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(programs, "program", found(Path("leeway-spy.jar"), Path("lcm-spy")))
    assert programs.spy_plugin(Machine()).kind == "ok"
    monkeypatch.setattr(programs, "program", found(None, Path("lcm-spy")))
    finding = programs.spy_plugin(Machine())
    assert (finding.kind, finding.fix) == ("warning", programs.INSTALL_SPY)


@pytest.mark.usefixtures("private_network")
def test_the_command_becomes_lcm_spy(tmp_path: Path) -> None:
    # One process from the command to the window: its pid ends the window.
    lcm_spy = script(tmp_path / "lcm-spy", LCM_SPY)
    environment = {"A": "B", "LCM_DEFAULT_URL": "url"}
    code = (
        "import leeway.spy, sys; from leeway.__main__ import main;"
        f"leeway.spy.prepare = lambda *_: ([{str(lcm_spy)!r}], {environment!r});"
        "sys.argv[1:] = ['spy'] + sys.argv[1:]; main()"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (0, f"{process.pid} url|||\n")
    assert "NoClassDefFoundError lines are harmless" in err
    quiet = subprocess.run(
        [sys.executable, "-c", code, "--quiet"], capture_output=True, text=True, check=True
    )
    assert (quiet.stdout, quiet.stderr) == ("", "")


def test_a_wrong_bus_is_told() -> None:
    command = [sys.executable, "-m", "leeway", "spy", "--lcm-url", "memq://"]
    result = subprocess.run(command, capture_output=True, text=True, env=os.environ)
    assert result.returncode == 1
    assert "expected udpm://GROUP:PORT" in result.stderr


def test_the_doctor_lists_it() -> None:
    command = [sys.executable, "-m", "leeway", "doctor", "--json"]
    rows = json.loads(subprocess.run(command, capture_output=True, text=True).stdout)["findings"]
    assert "spy_plugin" in [row["check"] for row in rows]
