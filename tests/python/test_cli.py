"""What all commands share: a quiet end at Ctrl-C while they start, and names of logs."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from leeway import run
from leeway.cli import app

# --- Ctrl-C before a command is at work ---

INTERRUPTED_IMPORT = """
import os, signal, sys
class Interrupter:
    def find_spec(self, name, path=None, target=None):
        if name == {name!r}:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Interrupter())
sys.argv = ["leeway", *{args!r}]
from leeway.__main__ import main
main()
"""


@pytest.mark.parametrize(
    ("name", "args"),
    [
        ("typer", ["keys"]),
        ("leeway.cli", ["keys"]),
        ("leeway._native", ["keys"]),
        ("lcm", ["stop"]),
        ("numpy", ["info", "no.lcm"]),
        ("leeway.doctor", ["doctor"]),
    ],
)
def test_ctrl_c_while_modules_load_ends_without_words(name: str, args: list[str]) -> None:
    program = INTERRUPTED_IMPORT.format(name=name, args=args)
    result = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=30, check=False
    )
    assert (result.returncode, result.stdout, result.stderr) == (130, "", "")


@pytest.mark.parametrize("command", [["keys"], ["keys", "--json"], ["obstacle", "--help"]])
def test_a_full_disk_gets_one_message(command: list[str]) -> None:
    with Path("/dev/full").open("w") as full:
        result = subprocess.run(
            [sys.executable, "-m", "leeway", *command],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            timeout=30,
            check=False,
        )
    assert (result.returncode, result.stderr.count("\n")) == (1, 1)
    assert result.stderr.startswith("leeway: cannot write: No space left")


INTERRUPTED_COMMAND = """
import os, signal, sys, time
from leeway import doctor
def examine(_):
    try:
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(20)
    finally:
        print("tidied up")
doctor.examine = examine
sys.argv = ["leeway", "doctor"]
from leeway.__main__ import main
main()
"""


def test_a_command_at_work_tidies_up_at_ctrl_c() -> None:
    result = subprocess.run(
        [sys.executable, "-c", INTERRUPTED_COMMAND],
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    assert (result.returncode, result.stdout, result.stderr) == (130, "tidied up\n", "")


def test_ctrl_c_stays_ignored_where_the_parent_ignores_it() -> None:
    program = INTERRUPTED_IMPORT.format(name="typer", args=["keys"])
    result = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        timeout=30,
        check=False,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN),
    )
    assert result.returncode == 0


# --- names of logs ---


def test_logs_of_one_second_have_names_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(run.time, "strftime", lambda _: "now")
    taken = [run.take_log_name("c1") for _ in range(3)]
    assert [str(path) for path in taken] == [f"runs/c1-now{end}.lcm" for end in ("", "-2", "-3")]
    taken[0].write_bytes(b"recorded")
    for path in taken:
        run.drop_empty(path)
    assert [path.exists() for path in taken] == [True, False, False]


def test_a_run_that_records_nothing_leaves_no_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, root: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    scene = str(root / "scenarios" / "c1.yaml")
    refused = CliRunner().invoke(app, ["run", scene, "--lcm-url", "nonsense"])
    assert refused.exit_code == 1
    assert list((tmp_path / "runs").iterdir()) == []
    (tmp_path / "runs").rmdir()
    (tmp_path / "runs").touch()
    unwritable = CliRunner().invoke(app, ["run", scene])
    assert unwritable.exit_code == 1
    assert "runs: cannot write a log there" in unwritable.stderr
