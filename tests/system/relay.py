"""A bad network between two buses: a seeded relay that loses, doubles, overtakes and delays.

It forwards joint states one way and joint commands the other; everything that a plant's bus has
for a controller goes along unharmed. A packet's fate depends on the seed, its channel and its
number alone, so the same seed treats the same packets alike.

As a program: `relay.py SEED GROUP PLANT_PORT CONTROLLER_PORT`. Each line on stdin is a JSON object
with the faults from now on and is answered by "ok"; at the end of stdin it writes what it did.
"""

from __future__ import annotations

import dataclasses
import hashlib
import heapq
import itertools
import json
import os
import select
import socket
import struct
import sys
import time

# Channel -> whether it goes from the plant's bus to the controller's, and whether it suffers.
ROUTES = {
    "JOINT_STATE": (True, True),
    "OBSTACLES": (True, False),
    "HULL": (True, False),
    "GOAL": (True, False),
    "STOP": (True, False),
    "JOINT_COMMAND": (False, True),
}
OVERTAKEN_S = 4e-3
DATAGRAM_MAX = 1 << 16
RECEIVE_BUFFER = 2 << 20
MAGIC = b"LC02"
# A message's payload: fingerprint, then utime, mono_ns, session and seq of its header.
HEADER = struct.Struct(">8x16xqq")


@dataclasses.dataclass(frozen=True)
class Faults:
    """What befalls a packet: probabilities, and delays in seconds."""

    loss: float = 0.0
    duplicate: float = 0.0
    reorder: float = 0.0  # share of the packets that come OVERTAKEN_S later
    delay: float = 0.0
    jitter: tuple[float, float] = (0.0, 0.0)  # bounds of a uniform delay


def fate(seed: int, channel: str, number: int, faults: Faults) -> list[float]:
    """Delay of each copy of a packet, s: none when it is lost, two when it is doubled."""
    key = f"{seed}/{channel}/{number}".encode()
    words = struct.unpack(">6Q", hashlib.blake2b(key, digest_size=48).digest())
    lost, doubled, *draws = (word / 2**64 for word in words)
    if lost < faults.loss:
        return []
    low, high = faults.jitter
    return [
        faults.delay + low + (high - low) * spread + OVERTAKEN_S * (late < faults.reorder)
        for late, spread in (draws[:2], draws[2:])[: 1 + (doubled < faults.duplicate)]
    ]


def split(datagram: bytes) -> tuple[str, bytes] | None:
    """Channel and payload of a short LCM message with a header, None for anything else."""
    name, nul, payload = datagram[8:].partition(b"\0")
    if datagram[:4] != MAGIC or not nul or len(payload) < HEADER.size:
        return None
    return name.decode("ascii", errors="replace"), payload


def join(channel: str, payload: bytes) -> bytes:
    """The short LCM message of a channel and a payload."""
    return MAGIC + bytes(4) + channel.encode() + b"\0" + payload


class Bus:
    """One LCM bus as a datagram socket."""

    def __init__(self, group: str, port: int) -> None:
        self.address = (group, port)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        self.socket.bind(self.address)
        member = socket.inet_aton(group) + socket.inet_aton("0.0.0.0")
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
        self.socket.setblocking(False)

    def receive(self) -> bytes | None:
        """Return the next datagram, None when there is none."""
        try:
            return self.socket.recv(DATAGRAM_MAX)
        except BlockingIOError:
            return None

    def send(self, datagram: bytes) -> None:
        """Send a datagram to everyone on the bus."""
        self.socket.sendto(datagram, self.address)


class Relay:
    """Forwards between the plant's bus and the controller's, and notes what it did."""

    def __init__(self, seed: int, plant: Bus, controller: Bus) -> None:
        self.seed = seed
        self.faults = Faults()
        self.buses = (plant, controller)
        self.heard = dict.fromkeys(ROUTES, 0)
        self.lost = dict.fromkeys(ROUTES, 0)
        self.doubled = dict.fromkeys(ROUTES, 0)
        # Channel -> (session, seq) of what was delivered, in that order.
        self.delivered: dict[str, list[tuple[int, int]]] = {name: [] for name in ROUTES}
        self.late_ns: list[int] = []  # how much later than due each was delivered
        self._heap: list[tuple[int, int, Bus, str, bytes]] = []
        self._order = itertools.count()

    def take(self, bus: Bus, datagram: bytes, now_ns: int) -> None:
        """Decide on a datagram heard on a bus; one that does not go this way is not ours."""
        found = split(datagram)
        plant, controller = self.buses
        if found is None or found[0] not in ROUTES or (bus is plant) != ROUTES[found[0]][0]:
            return
        channel, payload = found
        self.heard[channel] += 1
        faults = self.faults if ROUTES[channel][1] else Faults()
        delays = fate(self.seed, channel, self.heard[channel], faults)
        self.lost[channel] += not delays
        self.doubled[channel] += len(delays) > 1
        to = controller if bus is plant else plant
        for delay in delays:
            due = now_ns + round(delay * 1e9)
            heapq.heappush(self._heap, (due, next(self._order), to, channel, payload))

    def deliver(self, now_ns: int) -> None:
        """Send what is due."""
        while self._heap and self._heap[0][0] <= now_ns:
            due, _, bus, channel, payload = heapq.heappop(self._heap)
            bus.send(join(channel, payload))
            self.delivered[channel].append(HEADER.unpack_from(payload))
            self.late_ns.append(now_ns - due)

    def wait(self) -> list[int]:
        """Wait for a datagram, an order or the next due time; return the files that are ready."""
        seconds = None
        if self._heap:
            seconds = max(0.0, (self._heap[0][0] - time.monotonic_ns()) * 1e-9)
        files = [sys.stdin.fileno(), *(bus.socket.fileno() for bus in self.buses)]
        return select.select(files, [], [], seconds)[0]

    def turn(self) -> bool:
        """Do what there is to do, once. Return whether stdin is still open."""
        ready = self.wait()
        for bus in self.buses:
            # What has waited longest goes first, also while more comes.
            while bus.socket.fileno() in ready and (datagram := bus.receive()) is not None:
                self.take(bus, datagram, time.monotonic_ns())
                self.deliver(time.monotonic_ns())
        self.deliver(time.monotonic_ns())
        return sys.stdin.fileno() not in ready or self.obey(sys.stdin.readline())

    def obey(self, line: str) -> bool:
        """Adopt the faults of an order."""
        if not line:
            return False
        self.faults = Faults(**json.loads(line))
        print("ok", flush=True)
        return True

    def account(self) -> dict[str, object]:
        """Return what it did."""
        kept = ("heard", "lost", "doubled", "delivered", "late_ns")
        return {name: getattr(self, name) for name in kept}


def main() -> None:
    """Relay until the end of stdin, ahead of normal processes where the system grants it."""
    seed, group, plant_port, controller_port = sys.argv[1:]
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(2))
    except PermissionError:
        print("relay: no real-time priority", file=sys.stderr)
    relay = Relay(int(seed), Bus(group, int(plant_port)), Bus(group, int(controller_port)))
    print("ok", flush=True)
    while relay.turn():
        pass
    print(json.dumps(relay.account()))


if __name__ == "__main__":
    main()
