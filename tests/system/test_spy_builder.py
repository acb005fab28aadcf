"""The messages of the dialog in lcm-spy, made in a Java without windows."""

from __future__ import annotations

import contextlib
import math
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from leeway_lcm import leeway as wire

from leeway.doctor.programs import SPY_JAR
from leeway.processes import ProgramMissing, program

PATIENCE_S = 60
SESSION, UTIME, MONO = 5, 7, 11  # of SpyBuilder.java
SHAPES = ("sphere", "capsule", "box", "plane", "hull")


class Builder:
    """The builder in a process of its own: a line is asked, a line is answered."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self.seqs = {"OBSTACLES": 0, "HULL": 0}

    def ask(self, *words: str) -> str:
        """Return the answer to one line."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write("\t".join(words) + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline()
        assert answer, "the builder has ended"
        return answer.rstrip("\n")

    def build(self, do: str, shape: str, **texts: str) -> tuple[str, bytes]:
        """Return channel and bytes of a message that is sent."""
        answer = self.ask(do, shape, *(f"{name}={text}" for name, text in texts.items()))
        assert answer.startswith("sent "), answer
        _, channel, data = answer.split()
        self.seqs[channel] += 1
        return channel, bytes.fromhex(data)

    def refuse(self, do: str, shape: str, **texts: str) -> str:
        """Return why nothing is sent."""
        answer = self.ask(do, shape, *(f"{name}={text}" for name, text in texts.items()))
        assert answer.startswith("error "), answer
        return answer.removeprefix("error ")

    def header(self, channel: str) -> Any:
        """Return the header that the newest message of a channel must have."""
        h = wire.header_t()
        h.utime, h.mono_ns, h.session, h.seq = UTIME, MONO, SESSION, self.seqs[channel]
        return h


@pytest.fixture(scope="module")
def builder(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Builder]:
    """Compile and start SpyBuilder.java with the jar that is installed."""
    if shutil.which("javac") is None:
        pytest.skip("no JDK here: apt-get install default-jdk")
    try:
        jar = program(SPY_JAR)
    except ProgramMissing as error:
        pytest.skip(str(error))
    folder = tmp_path_factory.mktemp("classes")
    lcm_jar = program("lcm-spy").parent.parent / "share" / "java" / "lcm.jar"
    source = root / "tests" / "system" / "SpyBuilder.java"
    classes = f"{jar}:{lcm_jar}:{folder}"
    subprocess.run(["javac", "-cp", classes, "-d", folder, source], check=True, timeout=PATIENCE_S)
    process = subprocess.Popen(
        ["java", "-Djava.awt.headless=true", "-cp", classes, "leeway.spy.SpyBuilder"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    with contextlib.closing(process.stdin):  # type: ignore[type-var]
        yield Builder(process)
    assert process.wait(PATIENCE_S) == 0


def obstacle(**values: Any) -> Any:
    """Return an obstacle that is not turned, with some values."""
    o = wire.obstacle_t()
    o.quat = [1, 0, 0, 0]
    for name, value in values.items():
        setattr(o, name, value)
    return o


PLACE = {"ID": "7", "X": " 0.4 ", "Y": "-.5", "Z": "3e-1"}
AT = {"id": 7, "p": [0.4, -0.5, 0.3]}
TYPE = wire.obstacle_t
# Shape, texts, obstacle, ms.
GOOD: list[tuple[str, dict[str, str], Any, int]] = [
    ("sphere", {}, obstacle(id=1, p=[1, 1, 0.4], radius=0.1), 0),  # what stands there at first
    ("sphere", {**PLACE, "RADIUS": "0.077"}, obstacle(**AT, radius=0.077), 0),
    (
        "capsule",
        {**PLACE, "RADIUS": "0.05", "HALF_LENGTH": "0"},
        obstacle(**AT, shape=TYPE.CAPSULE, radius=0.05),
        0,
    ),
    (
        "box",
        {**PLACE, "HALF_X": "0.1", "HALF_Y": "0.2", "HALF_Z": "100", "ROUNDING": "0.01"},
        obstacle(**AT, shape=TYPE.BOX, size=[0.1, 0.2, 100], radius=0.01),
        0,
    ),
    ("plane", {**PLACE, "RADIUS": "?"}, obstacle(**AT, shape=TYPE.HALFSPACE), 0),
    (
        "sphere",
        {"ID": "2147483647", "VX": "1", "VY": "-2.5", "VZ": "+100.", "LIFETIME": "0.0015"},
        obstacle(id=2147483647, p=[1, 1, 0.4], radius=0.1, v=[1, -2.5, 100]),
        2,
    ),
    ("sphere", {"LIFETIME": "2147483"}, obstacle(id=1, p=[1, 1, 0.4], radius=0.1), 2147483000),
]


@pytest.mark.parametrize(("shape", "texts", "expected", "valid_for_ms"), GOOD)
def test_the_bytes_are_those_of_python(
    builder: Builder, shape: str, texts: dict[str, str], expected: Any, valid_for_ms: int
) -> None:
    channel, data = builder.build("add", shape, **texts)
    message = wire.obstacles_t()
    message.h, message.time_ns, message.valid_for_ms = builder.header(channel), MONO, valid_for_ms
    message.op, message.n, message.o[0] = message.UPSERT, 1, expected
    assert (channel, data) == ("OBSTACLES", message.encode())


def test_a_hull_has_a_message_of_its_own(builder: Builder) -> None:
    vertices = "0 0 0, 0.2 0 -1e-1; 0  0 1 "
    channel, data = builder.build("add", "hull", **PLACE, VERTICES=vertices, ROUNDING="0.02")
    message = wire.hull_t()
    message.h, message.time_ns = builder.header(channel), MONO
    message.o = obstacle(**AT, shape=TYPE.HULL, radius=0.02)
    message.n = 3
    message.vertex[:3] = [[0, 0, 0], [0.2, 0, -0.1], [0, 0, 1]]
    assert (channel, data) == ("HULL", message.encode())


def test_removing_and_clearing(builder: Builder) -> None:
    # Fields that do not count may hold anything.
    for do, op, entries in (
        ("remove", wire.obstacles_t.REMOVE, [obstacle(id=9)]),
        ("clear", wire.obstacles_t.CLEAR, []),
    ):
        channel, data = builder.build(do, "box", ID="9" if entries else "x", X="?", LIFETIME="-1")
        message = wire.obstacles_t()
        message.h, message.time_ns = builder.header(channel), MONO
        message.op, message.n = op, len(entries)
        message.o[: len(entries)] = entries
        assert data == message.encode(), do


def rotation(quat: Any) -> list[list[float]]:
    """Return the matrix of a unit quaternion."""
    w, x, y, z = quat
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


def fixed_axes(roll: float, pitch: float, yaw: float) -> list[list[float]]:
    """Return Rz(yaw) Ry(pitch) Rx(roll), written out."""
    (cr, cp, cy) = (math.cos(math.radians(a)) for a in (roll, pitch, yaw))
    (sr, sp, sy) = (math.sin(math.radians(a)) for a in (roll, pitch, yaw))
    return [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]


@pytest.mark.parametrize("turn", [(90, 0, 0), (0, 90, 0), (0, 0, -90), (30, -70, 200), (360, 1, 2)])
def test_roll_pitch_and_yaw_turn_about_fixed_axes(builder: Builder, turn: Any) -> None:
    texts = dict(zip(("ROLL", "PITCH", "YAW"), map(str, turn), strict=True))
    quat = wire.obstacles_t.decode(builder.build("add", "box", **texts)[1]).o[0].quat
    assert math.hypot(*quat) == pytest.approx(1, abs=1e-15)
    for row, expected in zip(rotation(quat), fixed_axes(*turn), strict=True):
        assert row == pytest.approx(expected, abs=1e-15)


NUMBERS = {  # field: its shape, its name for people, numbers that it does not take
    **{name: ("box", name.lower(), ["-100.1", "101"]) for name in ("X", "Y", "Z")},
    **{name: ("plane", name.lower(), ["-361", "360.5"]) for name in ("ROLL", "PITCH", "YAW")},
    "RADIUS": ("sphere", "radius", ["0", "-0.1", "100.5"]),
    "HALF_LENGTH": ("capsule", "half length", ["-0.1", "101"]),
    **{f"HALF_{a}": ("box", f"half {a.lower()}", ["0", "-1", "101"]) for a in "XYZ"},
    "ROUNDING": ("hull", "rounding", ["-0.1", "101"]),
    **{name: ("sphere", name.lower(), ["-100.1", "101"]) for name in ("VX", "VY", "VZ")},
    "LIFETIME": ("sphere", "lifetime", ["-1", "0.0004", "2147484"]),
    "ID": ("sphere", "id", ["0", "-1", "1.5", "2147483648", "+1", "1e3"]),
}
WORDS = ["", " ", "abc", "NaN", "inf", "Infinity", "1e999", "0,5", "1d", "0x1p3", "1 2"]


@pytest.mark.parametrize("field", NUMBERS)
def test_nonsense_names_its_field_and_sends_nothing(builder: Builder, field: str) -> None:
    shape, name, outside = NUMBERS[field]
    for text in WORDS + outside:
        reason = builder.refuse("add", shape, **{field: text})
        assert reason.startswith(f"{name}: expected "), (text, reason)
        assert text.strip() in reason
    # Nothing that was refused has used up a number.
    channel, data = builder.build("add", shape)
    kind = wire.hull_t if channel == "HULL" else wire.obstacles_t
    assert kind.decode(data).h.seq == builder.seqs[channel]


@pytest.mark.parametrize(
    "text",
    ["", "1 2", "1 2 3 4", "0 0 0,", ",0 0 0", "0 0 nan", "0 0 101", ", ".join(["0 0 0"] * 65)],
)
def test_vertices_that_are_none(builder: Builder, text: str) -> None:
    assert builder.refuse("add", "hull", VERTICES=text).startswith("vertices: expected ")
    builder.build("add", "hull", VERTICES=", ".join(["0 0 0"] * 64))


def test_an_id_that_is_none_removes_nothing(builder: Builder) -> None:
    assert builder.refuse("remove", "box", ID="0").startswith("id: ")


def test_all_types_are_in_the_jar_with_the_fingerprints_of_c(builder: Builder, root: Path) -> None:
    printed = subprocess.run(
        [root / "build/dev/tests/print_fingerprints"], capture_output=True, text=True, check=True
    )
    of_c = dict(line.split() for line in printed.stdout.splitlines())
    assert set(of_c) == {file.stem for file in (root / "lcmtypes").glob("*.lcm")}
    assert {name: builder.ask("type", name) for name in of_c} == of_c


def recall(builder: Builder, file: Path) -> tuple[str, dict[str, str]]:
    shape, *texts = builder.ask("recall", str(file)).split("\t")
    return shape, dict(text.split("=", 1) for text in texts)


def test_what_was_sent_last_is_remembered(builder: Builder, tmp_path: Path) -> None:
    file = tmp_path / "new" / "leeway" / "spy.properties"
    assert recall(builder, file)[0] == "sphere"
    texts = {"ID": "7", "X": " 0.4", "VERTICES": "0 0 0, 1 1 1", "HALF_X": "0.3"}
    builder.ask("keep", str(file), "hull", *(f"{name}={text}" for name, text in texts.items()))
    shape, kept = recall(builder, file)
    assert shape == "hull"
    assert kept.items() >= texts.items()
    assert [path.name for path in file.parent.iterdir()] == ["spy.properties"]


def test_a_strange_file_changes_no_more_than_it_names(builder: Builder, tmp_path: Path) -> None:
    file = tmp_path / "spy.properties"
    file.write_text("shape=banana\nx=abc\nno_such_field=1\n")
    shape, kept = recall(builder, file)
    assert (shape, kept["X"], kept["ID"]) == ("sphere", "abc", "1")
    assert builder.refuse("add", shape, **kept).startswith("x: ")
