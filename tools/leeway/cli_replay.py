"""The command `leeway replay`: logs verified, changed, played."""

import json
import re
import sys
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from leeway.options import EXIT_FAILED, EXIT_LOSS, EXIT_USAGE, Common, command, fail

EXIT_OF = {"equal": 0, "differs": EXIT_FAILED, "incomplete": EXIT_LOSS}


@dataclass(frozen=True)
class Playing:
    """Options of --play."""

    play: Annotated[
        bool, typer.Option("--play", help="Send the messages once more, as recorded.")
    ] = False
    speed: Annotated[
        float, typer.Option(min=0.01, max=1000, help="With --play: times as fast.")
    ] = 1.0
    seek: Annotated[float, typer.Option(min=0, help="With --play: begin there, s.")] = 0.0
    channels: Annotated[
        str | None,
        typer.Option(metavar="REGEX", help="With --play: channels; default all but LCM_SELF_TEST."),
    ] = None
    force: Annotated[
        bool, typer.Option("--force", help="With --play: even beside a running arm.")
    ] = False


def replay(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="LCM log, as runs/c1.lcm.")],
    verify: Annotated[
        bool, typer.Option("--verify", help="Compute every command again; compare all bits.")
    ] = False,
    sets: Annotated[
        list[str] | None,
        typer.Option(
            "--set", "-s", metavar="KEY=VALUE", help="What if: commands with another scene."
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="With --set: folder for a picture.")
    ] = None,
    *,
    playing: Playing,
    common: Common,
) -> None:
    """Verify a log bit by bit, ask what if, or play it on the bus.

    Status of --verify: 0 every command is equal, 1 some differ, 3 equal as far as the log tells.
    """
    if [verify, bool(sets), playing.play].count(True) != 1:
        fail("replay: say what for: --verify, --play, or --set KEY=VALUE", EXIT_USAGE)
    if out is not None and not sets:
        fail("replay: --out goes with --set", EXIT_USAGE)
    if verify:
        _verify(log, common)
    elif playing.play:
        _play(log, playing, common)
    else:
        _what_if(log, sets or [], out, common)


def register(app: typer.Typer) -> None:
    """Add the command."""
    command(app, "replay", "leeway replay runs/c1.lcm --verify")(replay)


def _print(lines: Iterable[str], document: Any, common: Common) -> None:
    if common.as_json:
        print(json.dumps(document, indent=2))
    elif not common.quiet:
        print("\n".join(lines))


def _tables(path: Path, common: Common) -> Any:
    """Read a log that has commands."""
    from leeway.logs.log import LogError, read_tables

    log = read_tables(path, common.name)
    if not len(log.tables["JOINT_COMMAND"]):
        raise LogError(f"{path}: no JOINT_COMMAND in it: record while leeway-controller runs")
    return log


def _verify(path: Path, common: Common) -> None:
    from leeway.logs.log import LogError
    from leeway.replay.text import verification_lines
    from leeway.replay.verify import verify
    from leeway.summary import count_bar

    try:
        log = _tables(path, common)
        with count_bar("verify", len(log.tables["JOINT_COMMAND"]), common.silent) as advance:
            result = verify(log, advance)
    except LogError as error:
        fail(str(error))
    _print(verification_lines(result), result.to_json(), common)
    if result.result != "equal":
        raise typer.Exit(EXIT_OF[result.result])


def _what_if(path: Path, sets: list[str], out: Path | None, common: Common) -> None:
    from leeway.logs.log import LogError
    from leeway.replay.text import what_if_lines
    from leeway.replay.verify import sessions
    from leeway.replay.whatif import what_if
    from leeway.summary import count_bar

    try:
        log = _tables(path, common)
        with count_bar("what if", len(log.tables["JOINT_COMMAND"]), common.silent) as advance:
            results = [what_if(log, session, sets, advance) for session in sessions(log)]
    except LogError as error:
        fail(str(error))
    except ValueError as error:
        fail(str(error), EXIT_USAGE)
    pictures = [_picture(w, out) for w in results] if out is not None else []
    lines = [line for w in results for line in what_if_lines(w)]
    lines += [f"picture  {picture}" for picture in pictures]
    document = {
        "path": str(path),
        "controllers": [w.to_json() for w in results],
        "pictures": [str(p) for p in pictures],
    }
    _print(lines, document, common)


def _picture(w: Any, out: Path) -> Path:
    from leeway.replay.picture import write_picture

    try:
        return write_picture(w, out)
    except OSError as error:
        fail(f"{out}: cannot write the picture: {error.strerror}")


def _play(path: Path, options: Playing, common: Common) -> None:
    from leeway import bus
    from leeway.logs.log import LogError
    from leeway.replay.play import company, open_recording

    try:
        recording = open_recording(path, options.channels)
    except LogError as error:
        fail(str(error))
    except re.error as error:
        fail(f"--channels: not a regular expression: {error}", EXIT_USAGE)
    if not len(recording):
        fail(f"{path}: no message on such a channel in it")
    try:
        url = bus.resolve_url(common.url)
        heard = None if options.force else company(bus.open_bus(url), recording)
        if heard:
            fail(
                f"{heard} is published on this bus already, and a second one would mix with it: "
                "stop the other, play on another --lcm-url port, leave the arm's channels out "
                "(--channels 'OBSTACLES|GOAL|STOP'), or insist with --force"
            )
        _play_on(bus.open_bus(url), recording, options, common)
    except bus.BusError as error:
        fail(str(error))


def _play_on(lcm_bus: Any, recording: Any, options: Playing, common: Common) -> None:
    """Play with keys and a progress line where there is a terminal."""
    from leeway.replay.keys import Ended, keyboard
    from leeway.replay.play import Player, Transport, play
    from leeway.replay.text import show_position

    begin = time.monotonic()
    transport = Transport(recording.duration, 0.0, options.speed, begin)
    player = Player(recording, transport, lcm_bus.publish)
    player.seek(options.seek, begin)
    visible = sys.stderr.isatty() and not common.silent
    status = 0
    try:
        with keyboard() as keys:
            play(player, keys, lambda now: show_position(player, now) if visible else None)
    except Ended as ended:
        status = 128 + ended.number
    finally:
        player.close()
        if visible:
            print("\r\033[K", end="", file=sys.stderr)
    seconds = time.monotonic() - begin
    document = {"path": str(recording.path), "sent": dict(player.sent), "wall_s": seconds}
    sent = ", ".join(f"{channel} {count}" for channel, count in player.sent.items()) or "nothing"
    _print([f"sent in {seconds:.1f} s: {sent}"], document, common)
    if status == 0 and recording.truncated_bytes:
        cut = f"{recording.truncated_bytes} bytes after the last whole event were left out"
        fail(f"{recording.path}: cut in the middle: {cut}", EXIT_LOSS)
    if status:
        raise typer.Exit(status)
