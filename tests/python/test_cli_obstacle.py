"""`leeway obstacle`: wrong words, and an obstacle that nobody tells; no bus is needed."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from leeway import bus, cli_obstacle
from leeway.cli import app

WRONG = {
    "capsule --length nan": "a length from 0 to 200 (m), found nan",
    "capsule --length -2": "a length from 0 to 200 (m), found -2",
    "capsule --length 300": "a length from 0 to 200 (m), found 300",
    "box --size 1 1 300": "three edges > 0, to 200 (m)",
    "--id 0": "an id from 1 to 2147483647, found 0",
    "--id 99999999999": "an id from 1 to 2147483647, found 99999999999",
    "--for 99999999999min": "from 1 ms to 35791 min",
}


@pytest.fixture(autouse=True)
def no_bus(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_: str) -> None:
        raise AssertionError("the bus was opened")

    monkeypatch.setattr(bus, "open_bus", refuse)


@pytest.mark.parametrize("words", WRONG)
def test_a_wrong_number_is_named_with_what_was_expected(words: str) -> None:
    arguments = ["obstacle", "add", *words.split(), "--at", "1", "1", "1"]
    result = CliRunner().invoke(app, arguments)
    assert (result.exit_code, result.stdout) == (2, "")
    assert WRONG[words] in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_file_that_is_no_text_has_no_points(tmp_path: Path) -> None:
    file = tmp_path / "scan.stl"
    file.write_bytes(b"\x80\xff\x00\x01")
    arguments = ["obstacle", "add", "hull", "--at", "1", "1", "1", "--vertices", str(file)]
    result = CliRunner().invoke(app, arguments)
    assert (result.exit_code, result.stdout) == (2, "")
    assert "expected a text of points x,y,z" in result.stderr


@pytest.mark.parametrize("radius", [[], ["--radius", "0.1"]])
def test_what_nobody_tells_is_not_moved(radius: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    # Its shape is not known: a box would become a ball, one without --radius a point.
    monkeypatch.setattr(cli_obstacle, "_list", lambda _: (None, 0))
    arguments = ["obstacle", "move", "7", "--at", "1", "1", "1", *radius]
    result = CliRunner().invoke(app, arguments)
    assert (result.exit_code, result.stdout) == (1, "")
    assert "no controller tells what it is" in result.stderr
    assert "leeway obstacle add SHAPE --id 7" in result.stderr
