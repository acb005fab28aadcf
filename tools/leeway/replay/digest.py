"""Which input changed, found from the digest of all inputs.

Each step of the digest is invertible. So for every single value there is exactly one that would
lead to the recorded digest; the value that resembles what the log holds, or that has few digits,
is the one that changed.
The order of the values is that of `digest_input` in controller/explain.c and of `digest_entry` in
lib/collision/world.c; where it is not, nothing is found. The digest of a world is the sum of those
of its obstacles, so what the sum lacks any single one of them may lack.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any, NamedTuple

from leeway import _native

START, PRIME, MASK = 0xCBF29CE484222325, 0x100000001B3, (1 << 64) - 1
INVERSE = pow(PRIME, -1, 1 << 64)
BITS_MAX = 6  # a value that differs in no more bits resembles another
HEAD = 64 - 24  # so does one that differs in its lower 40 bits alone
DIGITS_MAX = 9  # of a float that somebody wrote down; one drawn at random has 16 or 17


class Word(NamedTuple):
    """One value of the digest."""

    name: str
    bits: int  # unsigned
    is_float: bool = False

    def show(self, bits: int) -> str:
        """Write a value of this kind."""
        if self.is_float:
            return f"{_as_float(bits)!r} (0x{bits:016x})"
        return str(bits - (1 << 64) if bits >> 63 else bits)


class Change(NamedTuple):
    """A value that is not what the controller had."""

    name: str
    had: str  # by the controller
    log: str  # in the log
    bits: int  # that differ


def integer(name: str, value: int) -> Word:
    """Return the word of an integer."""
    return Word(name, value & MASK)


def floats(name: str, values: Sequence[float]) -> list[Word]:
    """Return the words of floats."""
    return [
        Word(f"{name}[{k}]", struct.unpack(">Q", struct.pack(">d", value))[0], True)
        for k, value in enumerate(values)
    ]


def digest(words: Sequence[Word]) -> int:
    """Return the digest of values, unsigned."""
    value = START
    for word in words:
        value = _step(value, word.bits)
    return value


def _step(value: int, word: int) -> int:
    value = ((value ^ word) * PRIME) & MASK
    return value ^ (value >> 32)


def _back(value: int) -> int:
    """Return what a step had before it multiplied: digest before, XOR word."""
    return ((value ^ (value >> 32)) * INVERSE) & MASK


def needed(words: Sequence[Word], wanted: int) -> list[int]:
    """Return for each value the one that, alone, would lead to a digest."""
    before = [START]
    for word in words:
        before.append(_step(before[-1], word.bits))
    out, value = [], wanted
    for word, earlier in zip(reversed(words), reversed(before[:-1]), strict=True):
        value = _back(value)
        out.append(value ^ earlier)
        value ^= word.bits
    return out[::-1]


def changes(words: Sequence[Word], wanted: int) -> list[Change]:
    """Return the single values whose change explains a digest."""
    return [
        Change(word.name, word.show(bits), word.show(word.bits), (bits ^ word.bits).bit_count())
        for word, bits in zip(words, needed(words, wanted), strict=True)
        if bits != word.bits and _is_plausible(word, bits)
    ]


def scene_change(words: Sequence[Word], wanted: int) -> list[Change]:
    """Return the digest of the scene that, alone, would explain a digest; no other tells more."""
    had = needed(words, wanted & MASK)[0]
    bits = words[0].bits
    text = [f"digest 0x{value:016x}" for value in (had, bits)]
    return [Change("SCENE", text[0], text[1], (had ^ bits).bit_count())]


def _is_plausible(word: Word, bits: int) -> bool:
    """Whether a value was meant: hardly any of 2^64 is."""
    difference = bits ^ word.bits
    if difference.bit_count() <= BITS_MAX or difference >> HEAD == 0:
        return True
    mantissa = repr(_as_float(bits)).partition("e")[0].replace(".", "").strip("-0")
    return word.is_float and mantissa.isdigit() and len(mantissa) <= DIGITS_MAX


def _as_float(bits: int) -> float:
    value: float = struct.unpack(">d", struct.pack(">Q", bits))[0]
    return value


def obstacle_words(obstacle: Any) -> tuple[list[Word], list[Word]]:
    """Return the values of an obstacle of `World.obstacles`, and those of its vertices."""
    number, shape, p, quat, radius, size, v, omega, time_ns, expires_ns, vertices, _ = obstacle
    what = f"OBSTACLES id {number}"
    points = floats(f"HULL id {number}: vertex", vertices)
    corners = [integer(f"HULL id {number}: number of vertices", len(vertices) // 3), *points]
    words = [integer(f"{what}: id", number), integer(f"{what}: shape", shape)]
    words += floats(f"{what}: p", p) + floats(f"{what}: quat", quat)
    words += [w._replace(name=f"{what}: radius") for w in floats("radius", [radius])]
    words += floats(f"{what}: size", size) + floats(f"{what}: v", v)
    words += floats(f"{what}: omega", omega)
    words += [integer(f"{what}: time_ns", time_ns), integer(f"{what}: expiry, ns", expires_ns)]
    return [*words, Word(VERTICES, digest(corners) if vertices else 0)], corners


def world_changes(obstacles: Sequence[Any], wanted: int) -> list[Change]:
    """Return the single values of obstacles whose change explains a digest of all of them."""
    each = [obstacle_words(obstacle) for obstacle in obstacles]
    digests = [digest(words) for words, _ in each]
    more = wanted - sum(digests)
    found = []
    for (words, corners), known in zip(each, digests, strict=True):
        own = (known + more) & MASK
        found += changes(words, own)
        if words[-1].bits:
            found += changes(corners, needed(words, own)[-1])
    return found


def input_words(
    scene_digest: int, state: Any, world: _native.World, command: Any, warming_up: bool
) -> list[Word]:
    """Return the values that a tick was given.

    Parameters
    ----------
    scene_digest
        Of the scene that the controller ran.
    state
        Row of JOINT_STATE, None before the first was heard.
    command
        Row of JOINT_COMMAND as computed from these inputs.
    """
    stamp = ("utime", "mono_ns", "session", "seq")
    joint = ("plant_mode", "command_session", "command_seq", "tick", "period_ns")
    names = [*stamp, *joint]
    values = [state["h"][n] for n in stamp] + [state[n] for n in joint] if state else [0] * 9
    words = [integer("digest of the scene", scene_digest)]
    words += [integer(f"JOINT_STATE {n}", int(v)) for n, v in zip(names, values, strict=True)]
    echo = zip(("channel", "session", "seq", "version"), world.echo, strict=True)
    words += [integer(f"world {name}", value) for name, value in echo]
    words.append(integer(WORLD_DIGEST, world.digest))
    request = (int(command["request_session"]), int(command["request_seq"]))
    words += [integer("request session", request[0]), integer("request seq", request[1])]
    words.append(integer("request kind", int(bool(command["flags"] & 8))))
    words += [integer(name, int(command[name])) for name in ("tick_ns", "state_age_ns")]
    words.append(integer("warming_up", int(warming_up)))
    zeros = [0.0] * 6
    words += floats("JOINT_STATE q", state["q"].tolist() if state else zeros)
    words += floats("JOINT_STATE qd", state["qd"].tolist() if state else zeros)
    goal = "scene request.goal" if request == (0, 0) else "GOAL p"
    return words + floats(goal, command["goal"].tolist())


WORLD_DIGEST, VERTICES = "digest of the obstacles", "digest of the vertices"


def explain(words: Sequence[Word], world: _native.World, recorded: int) -> list[Change]:
    """Return the likeliest input in the log that is not what the controller had.

    None when no single value explains the digest; several when they are equally likely.

    Parameters
    ----------
    words
        As `input_words` returns them, of that world.
    recorded
        Digest in the command.
    """
    recorded &= MASK
    computed = digest(words)
    if (computed ^ recorded).bit_count() == 1:
        had, log = (f"0x{value:016x}" for value in (computed, recorded))
        return [Change("input_digest of the command", had, log, 1)]
    found = changes(words, recorded)
    place = [word.name for word in words].index(WORLD_DIGEST)
    found += world_changes(world.obstacles(), needed(words, recorded)[place])
    # A flipped top bit looks like two flipped bits of the next value.
    least = min((change.bits for change in found), default=0)
    return [change for change in found if change.bits == least]
