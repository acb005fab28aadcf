"""The architecture holds, and each check of it finds what it looks for.

The first half checks this project. The second half plants one breach a case in a folder of its own.
"""

import subprocess
from pathlib import Path

import pytest
import rules

ROOT = Path(__file__).resolve().parents[2]


# --- this project ---


def test_the_sources_are_found() -> None:
    layers = {rules.layer_of(str(path)) for path in rules.source_files(ROOT, {".c"})}
    assert layers >= set(rules.LAYERS)


def test_includes_follow_the_layers() -> None:
    assert rules.broken_layers(ROOT) == []


def test_outside_headers_and_wire_types_stay_home() -> None:
    assert rules.strayed_outsiders(ROOT) == []


def test_languages_stay_home() -> None:
    assert rules.strayed_languages(ROOT) == []


@pytest.mark.parametrize("name", rules.ARCHIVES)
def test_real_time_archives_are_pure(name: str) -> None:
    archive = ROOT / f"build/dev/liblw_{name}.a"
    assert archive.exists(), "build preset dev first: ./dev test does"
    assert rules.banned_symbols(archive) == []


def test_sizes_keep_the_budget() -> None:
    sizes = rules.Sizes(ROOT)
    assert sizes.too_large + rules.too_large_on_the_whole(sizes) == []


def test_no_house_words() -> None:
    if not (ROOT / ".git").exists():
        pytest.skip("not a git clone")
    assert rules.house_words(ROOT) == []


# --- the checks themselves ---


def plant(root: Path, path: str, text: str) -> None:
    """Write one file of a small project."""
    file = root / path
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)


@pytest.mark.parametrize(
    ("path", "header"),
    [
        ("lib/base/clock.c", "arm/arm.h"),
        ("lib/arm/arm.h", "collision/world.h"),
        ("lib/collision/world.c", "scene/scene.h"),
        ("lib/scene/scene.c", "bus/bus.h"),
        ("lib/bus/wire.c", "scene/scene.h"),
        ("lib/program/program.c", "controller/tick.h"),
        ("controller/guard.c", "simulator/plant.h"),
        ("simulator/plant.c", "controller/tick.h"),
        ("simulator/batch.c", "controller/guard.h"),
        ("controller/tick.c", "guard.h"),
        ("controller/tick.c", "../simulator/plant.h"),
        ("lib/extra/extra.c", "base/status.h"),
    ],
)
def test_a_wrong_include_is_found(tmp_path: Path, path: str, header: str) -> None:
    plant(tmp_path, path, f'// comment\n#  include "{header}" // reason\n')
    assert len(rules.broken_layers(tmp_path)) == 1


@pytest.mark.parametrize(
    ("path", "header"),
    [
        ("lib/arm/ik.c", "arm/arm.h"),
        ("lib/bus/wire.c", "collision/world.h"),
        ("controller/live.c", "program/program.h"),
        ("simulator/batch.c", "controller/tick.h"),
        ("tests/unit/test_tick.c", "simulator/plant.h"),
    ],
)
def test_a_right_include_passes(tmp_path: Path, path: str, header: str) -> None:
    plant(tmp_path, path, f'#include "{header}"\n#include <math.h>\n')
    assert rules.broken_layers(tmp_path) == []


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("controller/guard.c", "#include <lcm/lcm.h>\n"),
        ("controller/guard.c", '#include "lcm/lcm.h"\n'),
        ("simulator/main.c", "#include <leeway_goal_t.h>\n"),
        ("controller/tick.h", "/* wire */ struct s { leeway_goal_t goal; };\n"),
        ("tools/native/native.cpp", "int n = leeway_goal_t_encoded_size(nullptr);\n"),
        ("lib/arm/capsule.c", "#include <ccd/ccd.h>\n"),
        ("lib/collision/gjk.c", "#include <ccd/ccd.h>\n"),
        ("lib/base/schema_read.c", "#include <yaml.h>\n"),
        ("controller/track.c", "#include <Eigen/Dense>\n"),
    ],
)
def test_a_strayed_outsider_is_found(tmp_path: Path, path: str, text: str) -> None:
    plant(tmp_path, path, text)
    assert len(rules.strayed_outsiders(tmp_path)) == 1


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("lib/bus/wire.c", "#include <leeway_goal_t.h>\nleeway_goal_t goal;\n"),
        ("lib/collision/custom.c", "#include <ccd/ccd.h>\n"),
        ("lib/base/yaml_tree.h", "#include <yaml.h>\n"),
        ("controller/tick.c", '// obeys leeway_goal_t\nconst char *s = "leeway_goal_t";\n'),
        ("tests/unit/test_wire.c", "#include <leeway_goal_t.h>\nleeway_goal_t goal;\n"),
    ],
)
def test_an_outsider_at_home_passes(tmp_path: Path, path: str, text: str) -> None:
    plant(tmp_path, path, text)
    assert rules.strayed_outsiders(tmp_path) == []


def test_a_strayed_language_is_found(tmp_path: Path) -> None:
    for path in ("controller/a.cpp", "lib/arm/a.hpp", "lib/base/b.py", "scenarios/c.java", "d.py"):
        plant(tmp_path, path, "\n")
    for path in ("tools/native/a.cpp", "lib/arm/e.cpp", "tools/leeway/b.py", "tools/spy/c.java"):
        plant(tmp_path, path, "\n")
    assert len(rules.strayed_languages(tmp_path)) == 5


def archive_of(folder: Path, text: str, *flags: str) -> Path:
    """Static library of one C file."""
    plant(folder, "a.c", text)
    subprocess.run(["gcc", *flags, "-c", "a.c", "-o", "a.o"], cwd=folder, check=True)
    subprocess.run(["ar", "rcs", "liba.a", "a.o"], cwd=folder, check=True)
    return folder / "liba.a"


@pytest.mark.parametrize(
    ("symbol", "header", "code"),
    [
        ("malloc", "stdlib.h", "void *f(void) { return malloc(1); }"),
        ("printf", "stdio.h", 'void f(int i) { printf("%d", i); }'),
        ("puts", "stdio.h", 'void f(void) { puts("x"); }'),
        ("clock_gettime", "time.h", "void f(struct timespec *t) { clock_gettime(0, t); }"),
        ("rand", "stdlib.h", "int f(void) { return rand(); }"),
        ("__assert_fail", "assert.h", "void f(int i) { assert(i); }"),
        (
            "pthread_mutex_lock",
            "pthread.h",
            "void f(pthread_mutex_t *m) { pthread_mutex_lock(m); }",
        ),
        ("usleep", "unistd.h", "void f(void) { usleep(1); }"),
    ],
)
def test_a_banned_symbol_is_found(tmp_path: Path, symbol: str, header: str, code: str) -> None:
    archive = archive_of(tmp_path, f"#include <{header}>\n{code}\n")
    assert rules.banned_symbols(archive) == [f"liba.a: {symbol}"]


def test_a_fortified_symbol_is_found(tmp_path: Path) -> None:
    text = '#include <stdio.h>\nvoid f(int i) { printf("%d", i); }\n'
    archive = archive_of(tmp_path, text, "-O2", "-U_FORTIFY_SOURCE", "-D_FORTIFY_SOURCE=2")
    assert rules.banned_symbols(archive) == ["liba.a: __printf_chk"]


@pytest.mark.parametrize("symbol", ["_Znwm", "_ZdlPv", "__cxa_throw", "realloc@GLIBC_2.2.5"])
def test_a_name_is_banned_in_any_dress(symbol: str) -> None:
    assert rules.BANNED.fullmatch(rules.plain_symbol(symbol))


def test_a_pure_archive_passes(tmp_path: Path) -> None:
    text = "#include <math.h>\ndouble free_way(double x) { return sqrt(x) + sin(x); }"
    assert rules.banned_symbols(archive_of(tmp_path, text)) == []


def function(lines: int = 3, branches: int = 0, parameters: int = 0) -> str:
    """C function of a given size."""
    names = ", ".join(f"int p{i}" for i in range(parameters)) or "void"
    body = ["if (x) x--;"] * branches
    body += ["x++;"] * (lines - 2 - branches)
    return "\n".join([f"void f({names}) {{", *body, "}"]) + "\n"


@pytest.mark.parametrize(
    ("text", "finding"),
    [
        ("\n" * 451, "451 lines, at most 450"),
        (function(lines=81), "lines 81, at most 80"),
        (function(lines=40, branches=15), "complexity 16, at most 15"),
        (function(parameters=7), "parameters 7, at most 6"),
    ],
)
def test_a_large_piece_is_found(tmp_path: Path, text: str, finding: str) -> None:
    plant(tmp_path, "lib/base/a.c", text)
    assert [found.split(": ")[-1] for found in rules.Sizes(tmp_path).too_large] == [finding]


def test_the_largest_allowed_pieces_pass(tmp_path: Path) -> None:
    pieces = [function(lines=80), function(lines=40, branches=14), function(parameters=6)]
    plant(tmp_path, "lib/base/a.c", "".join(pieces))
    plant(tmp_path, "lib/base/b.c", "\n" * 450)
    assert rules.Sizes(tmp_path).too_large == []


def test_a_large_whole_is_found(tmp_path: Path) -> None:
    plant(tmp_path, "lib/base/a.c", function(lines=36) + "\n" * 170)
    found = rules.too_large_on_the_whole(rules.Sizes(tmp_path))
    assert [f.split(":")[0] for f in found] == [
        "median file",
        "median function",
        "90 % of functions",
    ]


@pytest.mark.parametrize(
    "text",
    [
        "see /ho" + "me/someone/notes",
        "path = '/wo" + "rk/main'",
        "https://py" + "pi.org/simple",
        "// TO" + "DO: later",
        "x = 1  # FIX" + "ME",
    ],
)
def test_a_house_word_is_found(tmp_path: Path, text: str) -> None:
    subprocess.run(["git", "init", "-q"], cwd=tmp_path, check=True)
    plant(tmp_path, "docs/page.md", f"first line\n{text}\n")
    plant(tmp_path, "docs/fine.md", "lib/home/x, a/Users/b and todo are fine\n")
    subprocess.run(["git", "add", "."], cwd=tmp_path, check=True)
    assert len(rules.house_words(tmp_path)) == 1
