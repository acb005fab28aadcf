"""What all commands of `leeway` share: options, exit statuses, and how they are registered."""

import functools
import inspect
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass, is_dataclass
from typing import Annotated, Any, NoReturn

import typer

from leeway import interrupt
from leeway.interrupt import EXIT_INTERRUPTED

__all__ = [
    "EXIT_FAILED",
    "EXIT_INTERRUPTED",
    "EXIT_LOSS",
    "EXIT_USAGE",
    "Common",
    "command",
    "fail",
]

EXIT_FAILED, EXIT_USAGE, EXIT_LOSS = 1, 2, 3


def check_name(name: str | None) -> str | None:
    """Refuse what LCM would read as a pattern."""
    if name is not None and not re.fullmatch(r"[A-Za-z0-9_-]{1,30}", name):
        raise typer.BadParameter(f"expected 1 to 30 letters, digits, _ or -, found {name!r}")
    return name


@dataclass(frozen=True)
class Common:
    """Options that every command has."""

    url: Annotated[str | None, typer.Option("--lcm-url", metavar="URL", help="LCM bus.")] = None
    name: Annotated[
        str | None,
        typer.Option("--name", "-n", help="Robot's channel prefix.", callback=check_name),
    ] = None
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document on stdout.")] = False
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Errors only.")] = False

    @property
    def silent(self) -> bool:
        """No progress for people: quiet, or JSON asked for."""
        return self.quiet or self.as_json


def command(group: typer.Typer, name: str, example: str, **settings: Any) -> Callable[..., Any]:
    """Register a command: its own parameters, then those of its groups.

    A group is a parameter whose type is a dataclass, as `common`: its fields are the options.
    """

    def register(function: Callable[..., None]) -> Callable[..., None]:
        parameters = inspect.signature(function).parameters.values()
        groups: dict[str, Any] = {
            p.name: p.annotation for p in parameters if is_dataclass(p.annotation)
        }
        own = [p for p in parameters if p.name not in groups]
        members = {
            part: list(inspect.signature(kind).parameters.values()) for part, kind in groups.items()
        }
        options = own + [p for fields in members.values() for p in fields]

        @functools.wraps(function)
        def call(**values: Any) -> None:
            made = {
                part: kind(**{p.name: values.pop(p.name) for p in members[part]})
                for part, kind in groups.items()
            }
            interrupt.raise_again()
            function(**made, **values)

        call.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
            [p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in options]
        )
        call.__annotations__ = {p.name: p.annotation for p in options}
        group.command(name, epilog=f"Example: {example}", **settings)(call)
        return function

    return register


def fail(message: str, status: int = EXIT_FAILED) -> NoReturn:
    """Print one message to stderr and end."""
    print(f"leeway: {message}", file=sys.stderr)
    raise typer.Exit(status)
