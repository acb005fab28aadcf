"""Drives lcm-spy and Leeway's dialog in it: a display without a screen, keys, mouse, what it says.

    with driving(tmp_path) as spy:
        spy.open_dialog("WORLD")
        spy.fill(shape="sphere", id=7, position=(0.4, -0.5, 0.3), size=0.1)
        spy.press("add")
        spy.wait_said("the controller has it")

Rows of spy's table are found by the channels on the bus, so these have to come again and again.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO

import pytest
from helpers import wait_until
from rig import PLANT_PORT, Record, recording, url_of

from leeway.doctor import programs
from leeway.doctor.machine import OK, Machine

SCREEN = "1280x960x24"
START_PATIENCE_S, PATIENCE_S, TRY_S, TRIES = 60.0, 10.0, 4.0, 8
SPY_TITLE, DIALOG_TITLE = "LCM Spy", "Leeway obstacles: "
DIALOG_PLACE = (320, 330)  # beside the rows
# Rows of spy's table: where the first is in the window, how high each is.
ROW_X, ROW_Y, ROW_HEIGHT = 60, 30, 16
VIEWER_ITEM, DIALOG_ITEM = 1, 2  # in the menu of a row
# The underlined letters of the dialog; Enter is as good as adding.
ROWS = {
    "shape": "s",
    "id": "i",
    "position": "p",
    "orientation": "o",
    "size": "z",
    "velocity": "v",
    "lifetime": "l",
}
BUTTONS = {"add": "alt+a", "enter": "Return", "remove": "alt+r", "clear": "alt+c"}


def lacking() -> str:
    """Say what this machine lacks for driving spy; empty when nothing."""
    tools = [name for name in ("Xvfb", "xdotool") if shutil.which(name) is None]
    if tools:
        return f"no {', no '.join(tools)} here: apt-get install xvfb xdotool"
    found = [check(Machine()) for check in (programs.spy_plugin, programs.java)]
    return next((finding.text for finding in found if finding.kind != OK), "")


class Said:
    """The lines that a process writes, read as they come."""

    def __init__(self, stream: IO[str]) -> None:
        self.lines: list[str] = []
        self._thread = threading.Thread(target=self._read, args=(stream,))
        self._thread.start()

    def _read(self, stream: IO[str]) -> None:
        self.lines.extend(line.rstrip("\n") for line in stream)

    def find(self, pattern: str, start: int = 0) -> re.Match[str] | None:
        """Return the first line from a number on that matches a pattern."""
        found = (re.search(pattern, line) for line in self.lines[start:])
        return next((match for match in found if match), None)

    def end(self) -> None:
        """Wait for the end of the stream."""
        self._thread.join()


class Spy:
    """A running lcm-spy on a display of its own."""

    def __init__(self, display: str, process: subprocess.Popen[str], record: Record) -> None:
        self.process = process
        self._display = display
        self.record = record
        assert process.stdout is not None
        self.said = Said(process.stdout)
        self._mark = 0  # lines said before the last action
        self._dialog = ""
        self._keys_of: dict[str, str] = {}  # window -> the one inside it that Java has keys go to
        self._since = 0  # packets before spy heard the bus
        self.main = ""

    def wait_for_start(self) -> None:
        """Wait until the window is there and spy hears the bus."""
        self._wait(lambda: self.said.find(r"Found \d+ plugins"), START_PATIENCE_S, "plugins")
        self._since = len(self.record.packets())
        self._wait(lambda: self.windows(SPY_TITLE), START_PATIENCE_S, "window of spy")
        self.main = self.windows(SPY_TITLE)[0]
        self._note_focus(self.main)

    def _wait(self, condition: Callable[[], object], seconds: float, what: str) -> None:
        """Wait for a condition; when it does not come true tell what spy has said."""

        def true_or_ended() -> bool:
            said = "\n".join(self.said.lines[-20:])
            assert self.process.poll() is None, f"spy has ended while waiting for {what}:\n{said}"
            return bool(condition())

        try:
            wait_until(true_or_ended, seconds, what)
        except AssertionError as error:
            raise AssertionError(
                f"{error}; spy said:\n" + "\n".join(self.said.lines[-20:])
            ) from None

    # --- mouse, keys, windows ---

    def xdotool(self, *words: object) -> str:
        """Run xdotool on spy's display; return what it prints."""
        command = ["xdotool", *map(str, words)]
        environment = {**os.environ, "DISPLAY": self._display}
        done = subprocess.run(
            command,
            env=environment,
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
            check=False,
        )
        # A search that finds nothing fails without a word.
        assert done.returncode == 0 or not done.stderr, f"{' '.join(command)}: {done.stderr}"
        return done.stdout

    def windows(self, title: str) -> list[str]:
        """Return the visible windows whose title starts so, oldest first."""
        found = self.xdotool("search", "--onlyvisible", "--name", f"^{re.escape(title)}").split()
        return sorted(found, key=int)

    def _focused(self) -> str:
        return self.xdotool("getwindowfocus").strip()

    def _note_focus(self, window: str) -> None:
        """Wait until keys go to a new window, which Java sees to by itself."""
        others = {"", "0", "1", *self._keys_of.values()}
        self._wait(lambda: self._focused() not in others, PATIENCE_S, "focus of a new window")
        self._keys_of[window] = self._focused()

    def _focus(self, window: str, x: int, y: int) -> None:
        """Bring a window to the front and have keys go there, if need be by a click on a place.

        Without a window manager Java heeds nothing else, least of all xdotool's windowfocus.
        """
        self.xdotool("windowraise", window)
        if self._focused() != self._keys_of[window]:
            self.xdotool("mousemove", "--window", window, x, y, "click", 1)
            self._wait(lambda: self._focused() == self._keys_of[window], PATIENCE_S, "focus")

    def key(self, *keys: str) -> None:
        """Press keys, one after the other."""
        self.xdotool("key", "--delay", 20, *keys)

    def type(self, text: str) -> None:
        """Replace the text of the field that has the focus."""
        self.key("ctrl+a", "BackSpace")
        if text:
            self.xdotool("type", "--delay", 5, "--", text)

    def screenshot(self, path: Path) -> bool:
        """Keep a picture of the display; false without ImageMagick."""
        if shutil.which("import") is None:
            return False
        command = ["import", "-display", self._display, "-window", "root", str(path)]
        return subprocess.run(command, timeout=PATIENCE_S, check=False).returncode == 0

    # --- spy's table ---

    def rows(self) -> list[str]:
        """Return the channels of the table, from above."""
        return sorted({name for name, _ in self.record.packets()[self._since :]})

    def choose(self, channel: str, item: int, title: str) -> str:
        """Choose an item of a row's menu, counted from 1; return the window that it opens."""
        self._wait(lambda: channel in self.rows(), PATIENCE_S, f"messages of {channel}")
        before = self.windows(title)

        def opened() -> list[str]:
            return [window for window in self.windows(title) if window not in before]

        for _ in range(TRIES):
            self._open_menu(channel)
            self.key(*["Down"] * item, "Return")
            with contextlib.suppress(AssertionError):
                wait_until(lambda: bool(opened()), TRY_S, title)
                break
            self.key("Escape")
        assert opened(), f'no window "{title}" by item {item} of {channel} in {self.rows()}'
        window = opened()[0]
        self._note_focus(window)
        return window

    def _open_menu(self, channel: str) -> None:
        y = ROW_Y + ROW_HEIGHT * self.rows().index(channel)
        self._focus(self.main, ROW_X, y)
        self.xdotool("mousemove", "--window", self.main, ROW_X, y, "click", 3)

    # --- the dialog ---

    def open_dialog(self, channel: str) -> None:
        """Open the dialog from the row of a channel."""
        self._dialog = self.choose(channel, DIALOG_ITEM, DIALOG_TITLE + channel)
        self.xdotool("windowmove", self._dialog, *DIALOG_PLACE)

    def _status_place(self) -> tuple[int, int]:
        """Return where nothing reacts to a click: the status, below all else."""
        shell = self.xdotool("getwindowgeometry", "--shell", self._dialog)
        size = dict(line.split("=") for line in shell.split())
        return int(size["WIDTH"]) // 2, int(size["HEIGHT"]) - 12

    def fill(self, **rows: object) -> None:
        """Fill in rows by their names in ROWS; a sequence goes to the fields of a row in turn."""
        self._focus(self._dialog, *self._status_place())
        for row, given in rows.items():
            self.key(f"alt+{ROWS[row]}")
            if row == "shape":
                self.key(str(given)[0])
                continue
            for i, value in enumerate(given if isinstance(given, (tuple, list)) else [given]):
                if i > 0:
                    self.key("Tab")
                self.type(str(value))

    def press(self, button: str) -> None:
        """Press a button by its name in BUTTONS."""
        self._mark = len(self.said.lines)
        self._focus(self._dialog, *self._status_place())
        self.key(BUTTONS[button])

    def wait_said(self, pattern: str, seconds: float = PATIENCE_S) -> str:
        """Wait for a line since the last button that matches a pattern; return the line."""
        self._wait(lambda: self.said.find(pattern, self._mark), seconds, f'line "{pattern}"')
        found = self.said.find(pattern, self._mark)
        assert found is not None
        return found.string


@contextlib.contextmanager
def _ended(process: subprocess.Popen[str]) -> Iterator[subprocess.Popen[str]]:
    """End a process by its pid when the block ends."""
    try:
        yield process
    finally:
        process.terminate()
        try:
            process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


@contextlib.contextmanager
def display() -> Iterator[str]:
    """Run an X server without a screen; its name for DISPLAY."""
    reading, writing = os.pipe()
    command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", SCREEN, "-nolisten", "tcp"]
    with _ended(
        subprocess.Popen(command, pass_fds=[writing], stderr=subprocess.DEVNULL, text=True)
    ):
        os.close(writing)
        with os.fdopen(reading) as told:
            number = told.readline().strip()
        assert number, "Xvfb does not start"
        yield f":{number}"


@contextlib.contextmanager
def driving(folder: Path, *options: str, port: int = PLANT_PORT) -> Iterator[Spy]:
    """Run `leeway spy` with settings and, if the block fails, a picture in a folder."""
    if reason := lacking():
        pytest.skip(reason)
    command = [sys.executable, "-m", "leeway", "spy", "--lcm-url", url_of(port), *options]
    with recording(port) as record, display() as name:
        environment = {**os.environ, "DISPLAY": name, "XDG_CONFIG_HOME": str(folder)}
        process = subprocess.Popen(
            command,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        with _ended(process):
            spy = Spy(name, process, record)
            try:
                spy.wait_for_start()
                yield spy
            except BaseException:
                spy.screenshot(folder / "spy.png")
                print(f"picture of the failure: {folder / 'spy.png'}")
                raise
        spy.said.end()
