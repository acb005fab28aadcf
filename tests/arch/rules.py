"""The rules of the house as functions: each takes a folder and returns what breaks the rule.

A finding is one line, "where: what". An empty list means that the rule holds.
"""

import os
import re
import statistics
import subprocess
from collections.abc import Iterable, Iterator
from pathlib import Path

import lizard

Findings = list[str]

# --- files ---

NOT_SOURCE = {"build", "runs", "__pycache__", "data"}
C_SUFFIXES = {".c", ".h", ".cpp", ".hpp"}
CODE_SUFFIXES = C_SUFFIXES | {".py", ".java"}


def source_files(root: Path, suffixes: Iterable[str] = CODE_SUFFIXES) -> Iterator[Path]:
    """Paths, from `root` on, of the files with one of `suffixes`, in order."""
    for folder, folders, names in os.walk(root):
        folders[:] = sorted(f for f in folders if f not in NOT_SOURCE and not f.startswith("."))
        for name in sorted(names):
            if Path(name).suffix in suffixes:
                yield (Path(folder) / name).relative_to(root)


# --- layers ---

# What each folder may include besides itself.
LAYERS = {
    "lib/base": [],
    "lib/arm": ["lib/base"],
    "lib/collision": ["lib/base", "lib/arm"],
    "lib/scene": ["lib/base", "lib/arm", "lib/collision"],
    "lib/bus": ["lib/base", "lib/arm", "lib/collision"],
    "lib/program": ["lib/base", "lib/arm", "lib/collision", "lib/scene", "lib/bus"],
}
LIBRARIES = list(LAYERS)
LAYERS |= {"controller": LIBRARIES, "simulator": LIBRARIES}
# The in-process runner calls the controller's tick.
LAYER_EXCEPTIONS = {("simulator/batch", "controller/tick.h")}

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.M)
COMMENT_OR_STRING = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', re.S)


def includes(text: str) -> Iterator[tuple[int, str, str]]:
    """Line, quote (< or ") and name of each include of a C text."""
    for found in INCLUDE.finditer(text):
        yield text.count("\n", 0, found.start(1)) + 1, found[1], found[2]


def layer_of(path: str) -> str:
    """Layer that a file belongs to, by its path in the project or by its name in an include."""
    folder = path.rpartition("/")[0].removeprefix("lib/")
    return folder if folder in LAYERS else f"lib/{folder}"


def broken_layers(root: Path) -> Findings:
    """Includes that run against the layers, and folders that have none."""
    findings = []
    for path in source_files(root, C_SUFFIXES):
        if path.parts[0] not in {"lib", "controller", "simulator"}:
            continue
        layer = layer_of(str(path))
        if layer not in LAYERS:
            findings.append(f"{path}: its folder has no place among the layers")
            continue
        for line, quote, name in includes((root / path).read_text()):
            allowed = (
                quote == "<"
                or layer_of(name) in [layer, *LAYERS[layer]]
                or (str(path.with_suffix("")), name) in LAYER_EXCEPTIONS
            )
            if not allowed:
                findings.append(f"{path}:{line}: {layer} must not include {name}")
    return findings


# --- who may touch what is not ours ---

# Include -> the files that may have it.
OUTSIDE_INCLUDES = {
    r"(lcm/.*|leeway_\w+_t\.h)": r"lib/bus/.*",
    r"ccd/.*": r"lib/collision/custom\.[ch]",
    r"yaml\.h": r"lib/base/yaml_tree\.[ch]",
    r"Eigen/.*": r"lib/arm/.*\.cpp",
}
WIRE_TYPE = re.compile(r"\b_*leeway_\w+_t(?:_\w+)?\b")


def blank(found: re.Match[str]) -> str:
    """Nothing but the line ends of what was found."""
    return "\n" * found[0].count("\n")


def strayed_outsiders(root: Path) -> Findings:
    """Outside headers and wire types in a file that should not know them; tests may know all."""
    findings = []
    for path in source_files(root, C_SUFFIXES):
        if path.parts[0] == "tests":
            continue
        text = (root / path).read_text()
        for line, _, name in includes(text):
            for pattern, home in OUTSIDE_INCLUDES.items():
                if re.fullmatch(pattern, name) and not re.fullmatch(home, str(path)):
                    findings.append(f"{path}:{line}: {name} belongs to {home}")
        if path.parts[:2] == ("lib", "bus"):
            continue
        for line, code in enumerate(COMMENT_OR_STRING.sub(blank, text).split("\n"), start=1):
            if "#" not in code and (used := WIRE_TYPE.search(code)):
                findings.append(f"{path}:{line}: wire type {used[0]} outside lib/bus")
    return findings


# Suffix -> where such files may be.
LANGUAGE_HOMES = {
    ".cpp": r"(tools/native|lib/arm|tests)/.*",
    ".hpp": r"(tools/native|tests)/.*",
    ".py": r"(tools|tests)/.*",
    ".java": r"(tools|tests)/.*",
}


def strayed_languages(root: Path) -> Findings:
    """Sources in a language that their folder does not use."""
    return [
        f"{path}: no {path.suffix} here"
        for path in source_files(root)
        if not re.fullmatch(LANGUAGE_HOMES.get(path.suffix, ".*"), str(path))
    ]


# --- symbols of the real-time path ---

# Allocation, input and output, clocks, randomness, locks, waiting, ends of the process, C++ memory.
BANNED = re.compile(
    r"""
    malloc|calloc|realloc|reallocarray|free|aligned_alloc|memalign|posix_memalign|strn?dup
    |v?(f|d|s|sn|as)?printf|f?puts|f?putc|putchar|perror
    |fopen|fclose|fread|fwrite|fflush|open|close|read|write
    |clock|clock_gettime|gettimeofday|time|timespec_get
    |s?rand|rand_r|s?random|drand48|getrandom
    |pthread_(mutex|cond|rwlock|spin)_\w+|sem_(timed)?wait
    |(clock_)?nanosleep|u?sleep|poll|select
    |_?exit|_Exit|quick_exit|abort|assert_fail|cxa_throw
    |_Z(nw|na|dl|da)\w+
    """,
    re.X,
)
ARCHIVES = ("base", "arm", "collision", "gate", "tick", "plant")


def plain_symbol(symbol: str) -> str:
    """Name of a symbol without its version, leading __ and the _chk of the fortified variants."""
    return symbol.partition("@")[0].removeprefix("__").removesuffix("_chk")


def banned_symbols(archive: Path) -> Findings:
    """Undefined symbols of an archive that a real-time path must not have."""
    command = ["nm", "-u", "--format=posix", str(archive)]
    listing = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    fields = [line.split() for line in listing.splitlines()]
    symbols = sorted({f[0] for f in fields if f[1:2] == ["U"]})
    return [f"{archive.name}: {s}" for s in symbols if BANNED.fullmatch(plain_symbol(s))]


# --- size ---

MAX_FILE, MAX_FUNCTION, MAX_COMPLEXITY, MAX_PARAMETERS = 450, 80, 15, 6
MEDIAN_FILE, MEDIAN_FUNCTION, P90_FUNCTION = 200, 15, 35


class Sizes:
    """Lines of the files and functions under a folder, and what exceeds a limit of one piece."""

    def __init__(self, root: Path) -> None:
        self.files: list[int] = []
        self.functions: list[int] = []
        self.too_large: Findings = []
        for path in source_files(root):
            self._measure(root, path)

    def _measure(self, root: Path, path: Path) -> None:
        lines = (root / path).read_bytes().count(b"\n")
        self.files.append(lines)
        if lines > MAX_FILE:
            self.too_large.append(f"{path}: {lines} lines, at most {MAX_FILE}")
        for f in lizard.analyze_file(str(root / path)).function_list:
            self.functions.append(f.length)
            for what, value, limit in (
                ("lines", f.length, MAX_FUNCTION),
                ("complexity", f.cyclomatic_complexity, MAX_COMPLEXITY),
                ("parameters", len(f.parameters), MAX_PARAMETERS),
            ):
                if value > limit:
                    where = f"{path}:{f.start_line}: {f.name}"
                    self.too_large.append(f"{where}: {what} {value}, at most {limit}")


def too_large_on_the_whole(sizes: Sizes) -> Findings:
    """Medians and the 90 % point that are over the budget."""
    functions = sorted(sizes.functions)
    measured = (
        ("median file", statistics.median_low(sizes.files), MEDIAN_FILE),
        ("median function", statistics.median_low(functions), MEDIAN_FUNCTION),
        ("90 % of functions", functions[int(0.9 * (len(functions) - 1))], P90_FUNCTION),
    )
    return [f"{what}: {n} lines, at most {limit}" for what, n, limit in measured if n > limit]


# --- words that have no place in the repository ---

# A letter in brackets keeps each pattern from finding itself.
HOUSE_WORDS = {
    "absolute path": r"(^|[^A-Za-z0-9_.~-])/(h[o]me|w[o]rk|r[o]ot|Us[e]rs)/[A-Za-z0-9_.-]",
    "registry host": r"py[p]i\.org|pythonh[o]sted|deb\.deb[i]an|arch[i]ve\.ubuntu|cr[a]tes\.io"
    r"|npm[j]s|pr[o]xy\.golang|mav[e]n\.org",
    "left undone": r"\b(TO[D]O|FI[X]ME|X[X]X|HA[C]K)\b",
}


def house_words(root: Path) -> Findings:
    """Paths of one machine, names of package registries, unfinished work in tracked files."""
    findings = []
    for what, pattern in HOUSE_WORDS.items():
        grep = subprocess.run(
            ["git", "-c", "safe.directory=*", "grep", "-nIE", pattern, "--", ":!tests/data"],
            cwd=root,
            capture_output=True,
            text=True,
        )
        # 0 found something, 1 found nothing; anything else is git's own trouble.
        if grep.returncode > 1:
            raise RuntimeError(grep.stderr)
        findings += [f"{what}: {line}" for line in grep.stdout.splitlines()]
    return findings
