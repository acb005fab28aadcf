"""The programs that Leeway starts or that people start beside it."""

from __future__ import annotations

import importlib
import re
import shutil
import sys
from importlib import metadata
from pathlib import Path

from leeway.doctor.machine import OK, PROBLEM, WARNING, Finding, Machine
from leeway.processes import ProgramMissing, program

OWN = ("leeway-controller", "leeway-simulator")
LCM_TOOLS = ("lcm-logger", "lcm-logplayer", "lcm-gen", "lcm-spy")
OLDEST_LCM = (1, 5)
OLDEST_JAVA = 8
INSTALL_JAVA = "sudo apt-get install default-jre"
SPY_JAR = "leeway-spy.jar"
INSTALL_SPY = "sudo apt-get install default-jdk && ./dev setup"


def programs(machine: Machine) -> Finding:
    """Leeway's programs start, LCM's are there."""
    try:
        paths = {name: program(name) for name in (*OWN, *LCM_TOOLS)}
    except ProgramMissing as error:
        return Finding(PROBLEM, str(error).partition(":")[0], "./dev setup")
    for name in OWN:
        trial = machine.run([str(paths[name]), "--version"])
        if trial.status != 0:
            said = trial.output.splitlines()[-1:] or [f"exit status {trial.status}"]
            return Finding(PROBLEM, f"{name} does not start: {said[0]}", "./dev setup")
    return Finding(OK, f"programs: {', '.join(paths)}")


def _version(text: str) -> tuple[int, ...]:
    """Return the first dotted number in a text."""
    found = re.search(r"\d+(?:\.\d+)+", text)
    return tuple(int(part) for part in found[0].split(".")) if found else ()


def lcm_version(_: Machine) -> Finding:
    """LCM's library of this Python is the one Leeway was built for."""
    try:
        importlib.import_module("lcm")
    except ImportError as error:
        install = "sudo apt-get install --no-install-recommends libglib2.0-0"
        return Finding(PROBLEM, f"LCM does not load: {error}", install)
    found = metadata.version("lcm")
    if _version(found) < OLDEST_LCM:
        text = f"LCM {found} in {sys.prefix}: one malformed packet ends its programs"
        return Finding(PROBLEM, text, "./dev setup")
    return Finding(OK, f"LCM {found} in {sys.prefix}")


def lcm_on_path(machine: Machine) -> Finding:
    """The LCM tools that a shell starts are Leeway's; Debian's 1.3.1 ends at a malformed packet."""
    own = [folder.resolve() for folder in machine.own_folders]
    found = [shutil.which(name, path=machine.path) for name in LCM_TOOLS]
    folders = list(dict.fromkeys(Path(path).parent for path in found if path))
    strange = [folder for folder in folders if folder.resolve() not in own]
    activate = f"source {machine.own_folders[0]}/activate"
    if not folders:
        return Finding(OK, f"LCM tools on the PATH: none; {activate} puts Leeway's there")
    if not strange:
        return Finding(OK, "LCM tools on the PATH: Leeway's")
    version = _tool_version(machine, strange)
    shown = " ".join(["LCM", ".".join(map(str, version)) or "of unknown version"])
    where = f"{shown} in {', '.join(map(str, strange))} comes first on the PATH"
    if version >= OLDEST_LCM:
        return Finding(OK, where)
    return Finding(WARNING, f"{where}: one malformed packet may end it", activate)


def _tool_version(machine: Machine, folders: list[Path]) -> tuple[int, ...]:
    """Return the version of a foreign LCM, asked of its lcm-gen; nothing when it has none."""
    for folder in folders:
        found = machine.run([str(folder / "lcm-gen"), "--version"])
        if found.status == 0:
            return _version(found.output)
    return ()


def java(machine: Machine) -> Finding:
    """A Java with windows for lcm-spy."""
    command = shutil.which("java", path=machine.path)
    if command is None:
        return Finding(WARNING, "no Java: lcm-spy will not start", INSTALL_JAVA)
    said = machine.run([command, "-XshowSettings:properties", "-version"])
    settings = dict(re.findall(r"^\s*(java\.\S+) = (.*)$", said.output, re.M))
    # 1.8 is Java 8.
    parts = [int(part) for part in re.findall(r"\d+", settings.get("java.version", ""))]
    if said.status != 0 or not parts:
        return Finding(WARNING, f"{command} does not start: lcm-spy will not either", INSTALL_JAVA)
    major = parts[1] if parts[0] == 1 and len(parts) > 1 else parts[0]
    if major < OLDEST_JAVA:
        text = f"Java {settings['java.version']} is too old for lcm-spy"
        return Finding(WARNING, text, INSTALL_JAVA)
    home = machine.root / settings.get("java.home", "").lstrip("/")
    if not any(home.glob("lib/**/libawt_xawt.so")):
        text = f"Java {settings['java.version']} is headless: lcm-spy cannot open its window"
        return Finding(WARNING, text, INSTALL_JAVA)
    return Finding(OK, f"Java {settings['java.version']} for lcm-spy")


def spy_plugin(_: Machine) -> Finding:
    """The jar of lcm-spy's plugin, which is built where a JDK is."""
    try:
        program(SPY_JAR)
    except ProgramMissing:
        text = "lcm-spy's plugin was not built, there was no JDK: `leeway spy` will not start"
        return Finding(WARNING, text, INSTALL_SPY)
    return Finding(OK, "lcm-spy's plugin is built")
