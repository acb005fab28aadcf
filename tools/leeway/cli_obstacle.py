"""Commands `leeway obstacle`: put obstacles on the bus as a sensor would, and see what is there."""

import enum
import json
import math
import secrets
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from leeway.options import EXIT_USAGE, Common, command, fail

if TYPE_CHECKING:
    from leeway.logs.solids import Obstacle
    from leeway.obstacles import Draft

NEW_IDS = 1000, 1_000_000  # those drawn for obstacles without one
Send = Callable[[str, Callable[[Any], Any], Common], None]
Triple = tuple[float, float, float]
Words = tuple[str, str, str]


class Kind(str, enum.Enum):
    """What an obstacle may be; the order is that of obstacle_t.shape."""

    SPHERE = "sphere"
    CAPSULE = "capsule"
    BOX = "box"
    HULL = "hull"
    PLANE = "plane"


# The options that each shape has of those that not all have.
OPTIONS = {
    Kind.SPHERE: {"radius"},
    Kind.CAPSULE: {"radius", "length"},
    Kind.BOX: {"radius", "size"},
    Kind.HULL: {"radius", "vertices"},
    Kind.PLANE: {"normal"},
}

AtOption = Annotated[Triple, typer.Option("--at", metavar="X Y Z", help="m, base frame.")]
IdArgument = Annotated[int, typer.Argument(metavar="ID", min=1, max=(1 << 31) - 1)]


@dataclass(frozen=True)
class Size:
    """Options that say how large an obstacle is."""

    radius: Annotated[
        float | None, typer.Option(help="m; rounding of a box or hull. A sphere of 0 is a point.")
    ] = None
    length: Annotated[float | None, typer.Option(help="m, of a capsule's axis, along z.")] = None
    size: Annotated[Triple | None, typer.Option(metavar="X Y Z", help="m, edges of a box.")] = None
    vertices: Annotated[
        str | None,
        typer.Option(metavar="POINTS", help='m, of a hull: "x,y,z x,y,z ...", or a file.'),
    ] = None
    normal: Annotated[
        Triple | None, typer.Option(metavar="X Y Z", help="Out of a plane's solid side; up.")
    ] = None


@dataclass(frozen=True)
class Motion:
    """Options that say how an obstacle stands and moves."""

    rpy: Annotated[
        Words | None, typer.Option(metavar="R P Y", help="Turns about x, y, z: 0.5 or 30deg.")
    ] = None
    velocity: Annotated[
        Triple, typer.Option(metavar="X Y Z", help="m/s; it moves on by itself for 0.5 s.")
    ] = (0.0, 0.0, 0.0)
    omega: Annotated[Triple, typer.Option(metavar="X Y Z", help="rad/s, about its origin.")] = (
        0.0,
        0.0,
        0.0,
    )
    valid_for: Annotated[
        str | None, typer.Option("--for", metavar="TIME", help="It expires: 5s, 500ms, 2min.")
    ] = None


def register(app: typer.Typer, send: Send) -> None:
    """Add the group of commands; `send` sends a message until it is echoed."""
    group = typer.Typer(help="Put obstacles on the bus, as a sensor would.", no_args_is_help=True)
    app.add_typer(group, name="obstacle")
    example = "leeway obstacle add box --at 0.4 0 0.3 --size 0.1 0.1 0.2 --rpy 0 0 45deg --for 5s"

    @command(group, "add", example)
    def add(
        at: AtOption,
        shape: Annotated[Kind, typer.Argument(help="What it is.")] = Kind.SPHERE,
        number: Annotated[
            int | None, typer.Option("--id", help="Default: a free number is drawn.")
        ] = None,
        *,
        size: Size,
        motion: Motion,
        common: Common,
    ) -> None:
        """Add an obstacle, or replace the one with that id."""
        chosen = number if number is not None else NEW_IDS[0] + secrets.randbelow(NEW_IDS[1])
        _tell(_draft(chosen, shape, at, size, motion), "", send, common)

    @command(group, "move", "leeway obstacle move 7 --at 0.5 -0.5 0.3 --velocity 0 0.1 0")
    def move(
        number: IdArgument,
        at: AtOption,
        radius: Annotated[float | None, typer.Option(help="m; default: as it is.")] = None,
        *,
        motion: Motion,
        common: Common,
    ) -> None:
        """Put an obstacle elsewhere; its shape stays, and its turn unless --rpy says another.

        It stands still there, for ever, unless --velocity and --for say otherwise.
        """
        _tell(_moved(_known(number, common), at, radius, motion), " moved", send, common)

    @command(group, "remove", "leeway obstacle remove 7")
    def remove(number: IdArgument, *, common: Common) -> None:
        """Remove an obstacle. One that a sensor still reports comes back with its next message."""
        from leeway import bus

        gone = [(number, (0.0, 0.0, 0.0), 0.0)]
        what = f"removal of obstacle {number}"
        send(what, lambda b: bus.send_obstacles(b, common.name, bus.REMOVE, gone), common)

    @command(group, "clear", "leeway obstacle clear")
    def clear(*, common: Common) -> None:
        """Remove all obstacles of all senders. Those that a running sensor reports come back."""
        from leeway import bus

        what = "removal of all obstacles"
        send(what, lambda b: bus.send_obstacles(b, common.name, bus.CLEAR, []), common)

    @command(group, "list", "leeway obstacle list")
    def show(*, common: Common) -> None:
        """Show what the controller knows of: shape, place, velocity, who said so, how old it is."""
        _show(common)


# --- words to obstacles ---


def _check_options(shape: Kind, size: Size, motion: Motion) -> None:
    """Fail where options do not fit the shape or one another."""
    given = {name for name, value in vars(size).items() if value is not None}
    unfit = sorted(given - OPTIONS[shape])
    if unfit:
        fail(f"a {shape.value} has no --{unfit[0]}", EXIT_USAGE)
    for name, of in (("size", Kind.BOX), ("vertices", Kind.HULL), ("length", Kind.CAPSULE)):
        if shape is of and name not in given:
            fail(f"a {shape.value} needs --{name}", EXIT_USAGE)
    if motion.rpy is not None and size.normal is not None:
        fail("--normal or --rpy, not both", EXIT_USAGE)


def _draft(number: int, shape: Kind, at: Triple, size: Size, motion: Motion) -> "Draft":
    from leeway.obstacles import Draft, Refused, from_normal, vertices

    _check_options(shape, size, motion)
    try:
        draft = Draft(number, list(Kind).index(shape), at, radius=size.radius or 0.0)
        if size.size is not None:
            draft.size = tuple(edge / 2 for edge in size.size)
        if size.length is not None:
            draft.size = (size.length / 2, 0.0, 0.0)
        if size.vertices is not None:
            draft.vertices = vertices(size.vertices)
        if size.normal is not None:
            draft.quat = from_normal(size.normal)
        _set_motion(draft, motion)
    except (Refused, OSError) as error:
        fail(str(error), EXIT_USAGE)
    return draft


def _set_motion(draft: "Draft", motion: Motion) -> None:
    from leeway.obstacles import angle, duration_ms, from_rpy

    draft.v, draft.omega = motion.velocity, motion.omega
    if motion.rpy is not None:
        roll, pitch, yaw = map(angle, motion.rpy)
        draft.quat = from_rpy(roll, pitch, yaw)
    if motion.valid_for is not None:
        draft.valid_for_ms = duration_ms(motion.valid_for)


def _known(number: int, common: Common) -> "Obstacle":
    """Return what the controller knows of an id."""
    found, _ = _list(common)
    if found is None:
        fail(
            f"obstacle {number}: no controller tells what it is, in lockstep none does: is "
            "leeway-controller running in real time on this bus (same --lcm-url, same --name)? "
            f"Or give it anew: leeway obstacle add SHAPE --id {number} ..."
        )
    known = {o.id: o for o in found}
    if number not in known:
        there = ", ".join(map(str, sorted(known)[:20])) or "none"
        fail(f"obstacle {number}: the controller knows of no such; there are: {there}")
    return known[number]


def _moved(old: "Obstacle", at: Triple, radius: float | None, motion: Motion) -> "Draft":
    from leeway.obstacles import Draft, Refused

    draft = Draft(old.id, old.shape, at, old.quat, old.radius, old.size)
    if radius is not None:
        draft.radius = radius
    try:
        _set_motion(draft, motion)
    except Refused as error:
        fail(str(error), EXIT_USAGE)
    return draft


def _tell(draft: "Draft", moved: str, send: Send, common: Common) -> None:
    """Check an obstacle and send it."""
    from leeway import bus
    from leeway.logs.solids import in_words
    from leeway.obstacles import Refused, clock_ns

    def say(own: Any) -> Any:
        now = clock_ns(own, common.name) if draft.is_timed else 0
        return bus.send_change(own, common.name, draft.message(now)) if now is not None else None

    try:
        draft.message(1)
    except Refused as error:
        fail(str(error), EXIT_USAGE)
    what = in_words(draft.shape, draft.p, draft.radius, draft.size)
    send(f"obstacle {draft.number}{moved}, {what}", say, common)


# --- what is there ---


def _list(common: Common) -> "tuple[list[Obstacle] | None, int]":
    """Return the obstacles that the controller tells, None when it tells none; and its time."""
    from leeway import bus
    from leeway.obstacles import Listing

    try:
        listing = Listing(bus.open_bus(bus.resolve_url(common.url)), common.name)
    except bus.BusError as error:
        fail(str(error))
    return listing.obstacles(), listing.now_ns


def _show(common: Common) -> None:
    from rich.console import Console
    from rich.table import Table

    from leeway.obstacles import age_s, to_json, to_rpy

    found, now_ns = _list(common)
    if found is None:
        fail(
            "no controller tells its obstacles: is leeway-controller running in real time on this "
            "bus (same --lcm-url, same --name), and has it heard of any?"
        )
    if common.as_json:
        print(json.dumps({"obstacles": [to_json(o, now_ns) for o in found]}, indent=2))
        return
    table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 2, 0, 0))
    for title in ("id", "what and where", "turned", "m/s", "age", "expires in", "from"):
        table.add_column(title)
    for o in found:
        turn = tuple(round(math.degrees(a), 1) for a in to_rpy(o.quat))
        age = age_s(o, now_ns)
        left = (o.expires_ns - now_ns) / 1e9
        table.add_row(
            str(o.id),
            o.words,
            "" if not any(turn) else " ".join(f"{a:g}" for a in turn) + " deg",
            " ".join(f"{v:g}" for v in o.v) if any(o.v) else "",
            "" if age is None else f"{age:.1f} s",
            f"{left:.1f} s" if o.expires_ns else "",
            f"..{o.session % 10000:04}",
        )
    if not common.quiet:
        Console().print(table if found else "no obstacles")
