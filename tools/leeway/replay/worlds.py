"""Which obstacles a controller believed in at a tick: OBSTACLES, HULL and the commands' echoes.

The log need not hold the messages in the order in which the controller took them: messages of two
senders may overtake one another, a message may be missing here or there. A command echoes channel
and number of the newest message taken, and the number of changes; of the worlds that fit, the
caller takes the one whose tick has the recorded digest.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from leeway import _native
from leeway.logs.log import Table, wire

AHEAD = 8  # messages logged later than the one echoed that may have been taken before it
START_MAX = 64  # messages heard before the first tick, at most
TRIALS_MAX = 2000  # messages applied in one search
MEMORY = 256  # messages that may still come late
_OBSTACLES, _HULL = wire.joint_command_t.OBSTACLES, wire.joint_command_t.HULL

Echo = tuple[int, int, int, int]  # channel, session, seq of the newest message; number of changes
Sender = tuple[int, int]  # channel, session: each has numbers of its own


class Guess(NamedTuple):
    """A world that may be the controller's, and the messages that made it."""

    world: _native.World
    taken: tuple[int, ...] = ()  # rows of the messages, in the order taken
    told: bool = True  # the log lacks nothing that could make it another
    forced: bool = False  # its numbers are the echo's, not its own


@dataclass
class WorldLine:
    """Follows the world of one controller through a log."""

    obstacles: Table  # OBSTACLES
    hulls: Table  # HULL
    known: bool = True  # whether the world now is what the controller had, as far as the log tells
    whole: bool = True  # whether its history is known from the first message on
    world: _native.World = field(default_factory=_native.World)
    _late: list[int] = field(default_factory=list)  # rows passed by that may still come
    _next: int = 0  # first row not yet looked at

    def __post_init__(self) -> None:
        # Rows are those of both channels, in the order of the log.
        tables = {_OBSTACLES: self.obstacles, _HULL: self.hulls}
        found = [
            (table.order[k], channel, k)
            for channel, table in tables.items()
            for k in range(len(table))
        ]
        self._order = np.array(sorted(order for order, _, _ in found), dtype=np.int64)
        self._place = [(channel, k) for _, channel, k in sorted(found)]
        heads = {channel: table.rows["h"] for channel, table in tables.items()}
        numbers = {c: (h["session"].tolist(), h["seq"].tolist()) for c, h in heads.items()}
        self._sender: list[Sender] = [(c, numbers[c][0][k]) for c, k in self._place]
        self._seq: list[int] = [numbers[c][1][k] for c, k in self._place]
        self._newest: dict[Sender, int] = {}  # seq taken last
        self._rows: dict[tuple[int, int, int], list[int]] = {}
        for row, (sender, seq) in enumerate(zip(self._sender, self._seq, strict=True)):
            self._rows.setdefault((*sender, seq), []).append(row)

    def _message(self, row: int) -> tuple[bytes, bool]:
        """Return a message, and whether it is a hull."""
        channel, k = self._place[row]
        return (self.hulls if channel == _HULL else self.obstacles).message(k), channel == _HULL

    def begin_late(self, order: int) -> None:
        """Start in the middle of a run: take all that the log has up to a place in it."""
        rows = tuple(range(int(self._order.searchsorted(order))))
        self.take(self._apply(self.world, rows))
        self.known = self.whole = False

    def guesses(self, echo: Echo, order: int) -> Iterator[Guess]:
        """Yield the worlds that a command may have been computed with, likeliest first.

        Parameters
        ----------
        echo
            What the command echoes.
        order
            Place of the command in the log.
        """
        if self.world.echo == echo:
            yield Guess(self.world, told=self.known)
            return
        target = self._target(echo, order)
        if target is None:
            yield self._force(Guess(self.world), echo, told=False)
        elif self.whole and self.world.echo[3] == 0:
            yield from self._starts(target, echo)
        else:
            straight = self._apply(self.world, tuple(range(self._next, target + 1)))
            fits = straight.world.echo == echo
            told = self.whole and not self._gaps(straight.taken)
            yield straight if fits else self._force(straight, echo, told)
            yield from self._search(target, echo) if self.whole else ()
        yield Guess(self.world, told=False)  # the echo itself may be damaged

    def take(self, guess: Guess) -> None:
        """Go on from a guess whose tick had the recorded digest."""
        self.world = guess.world
        self.known = True
        self.whole = self.whole and not guess.forced
        if guess.taken:
            self._forget(guess.taken)

    def lose(self, guess: Guess) -> None:
        """Go on from the likeliest guess when none had the recorded digest."""
        known = self.known and guess.told
        self.take(guess)
        self.known = known

    # --- ways of going on ---

    def _target(self, echo: Echo, order: int) -> int | None:
        """Return the row that a command echoes, the first that is not yet taken."""
        last = int(self._order.searchsorted(order)) + AHEAD
        rows = self._rows.get(echo[:3], ())
        return next((r for r in rows if r < last and (r >= self._next or r in self._late)), None)

    def _apply(self, world: _native.World, rows: tuple[int, ...]) -> Guess:
        after = world.copy()
        for row in rows:
            after.apply(*self._message(row))
        return Guess(after, rows)

    @staticmethod
    def _force(guess: Guess, echo: Echo, told: bool) -> Guess:
        """Give a world the numbers of an echo."""
        world = guess.world.copy()
        world.adopt(*echo)
        return Guess(world, guess.taken, told, forced=True)

    def _gaps(self, rows: tuple[int, ...]) -> bool:
        """Whether a sender's numbers say that the log lacks one of its messages."""
        newest = dict(self._newest)
        for row in rows:
            sender, seq = self._sender[row], self._seq[row]
            if seq > newest.setdefault(sender, seq - 1) + 1:
                return True
            newest[sender] = max(seq, newest[sender])
        return False

    def _starts(self, target: int, echo: Echo) -> Iterator[Guess]:
        """Yield what a controller knows that began to listen some messages before the target."""
        first = max(self._next, target - START_MAX)
        count = 0
        for start in range(target, first - 1, -1):
            guess = self._apply(self.world, tuple(range(start, target + 1)))
            if guess.world.echo == echo:
                count += 1
                yield guess
        yield from self._search(target, echo)
        if count == 0:
            yield self._force(self._apply(self.world, (target,)), echo, told=False)

    def _search(self, target: int, echo: Echo) -> Iterator[Guess]:
        """Yield all ways to the echo, short ones first: any order of senders, any message lost."""
        begin = max(self._next, target - AHEAD)
        pending = [*self._late[-AHEAD:], *range(begin, min(target + AHEAD, len(self._order)))]
        queue = deque([Guess(self.world)])
        trials = 0
        while queue and trials < TRIALS_MAX:
            guess = queue.popleft()
            for row in pending:
                if not self._may_follow(guess.taken, row):
                    continue
                trials += 1
                longer = self._apply(guess.world, (row,))._replace(taken=(*guess.taken, row))
                if longer.world.echo == echo:
                    yield longer
                if longer.world.echo[3] <= echo[3]:
                    queue.append(longer)

    def _may_follow(self, taken: tuple[int, ...], row: int) -> bool:
        """Whether a sender's messages stay in their order."""
        own = [self._seq[r] for r in taken if self._sender[r] == self._sender[row]]
        return row not in taken and (not own or own[-1] <= self._seq[row])

    def _forget(self, taken: tuple[int, ...]) -> None:
        """Keep the rows that were passed by, except those that a newer one has made void."""
        for row in taken:
            self._newest[self._sender[row]] = self._seq[row]
        end = max(self._next, max(taken) + 1)
        passed = self._late + list(range(max(self._next, end - MEMORY), end))
        gone = set(taken)
        self._late = [
            r
            for r in passed
            if r not in gone and self._seq[r] >= self._newest.get(self._sender[r], 0)
        ][-MEMORY:]
        self._next = end
