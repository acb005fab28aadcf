"""From the slices of one condition to its numbers, JSON-able."""

from __future__ import annotations

from typing import Any

from rt.histogram import PERCENTILES, Histogram, compare, pool
from rt.slices import HISTOGRAMS, LINKS, PROGRAMS, Slice

# By contender, in the order of the alternations.
Slices = dict[str, list[Slice]]

WAKE_PERCENTILES = ("p99", "p99.9")
ROUND_TRIP_PERCENTILES = ("p50", "p99")
ROUND_TRIP_COUNTS = ("sent", "lost", "skipped")
REALTIME_BITS = {1: "FIFO", 2: "LOCKED", 4: "AWAKE", 8: "PINNED"}
COUNTS = ("ticks", "skipped", "stale_ticks", "unsent", "minor_faults", "major_faults")


def of_name(slices: list[Slice], name: str) -> list[Histogram]:
    """One histogram of every slice."""
    return [s.histograms[name] for s in slices]


def sparse(histogram: Histogram) -> dict[str, int]:
    """Bins that are not empty: us -> count."""
    return {str(us): int(histogram.bins[us]) for us in histogram.bins.nonzero()[0]}


def realtime_words(bits: int) -> str:
    """Name what the system granted."""
    return "+".join(word for bit, word in REALTIME_BITS.items() if bits & bit) or "none"


def program_counts(slices: list[Slice], who: str, period_us: float) -> dict[str, Any]:
    """Add up what one of our programs counted; what one slice lacked, all lack."""
    each = [s.counts[who] for s in slices]
    total: dict[str, Any] = {name: sum(c[name] for c in each) for name in COUNTS}
    # A program that cannot watch its allocations says so by a negative number.
    allocations = [c["allocations"] for c in each]
    total["allocations"] = sum(allocations) if min(allocations) >= 0 else None
    total["late"] = pool(of_name(slices, f"{who} wake_late_us")).at_least(period_us)
    granted = each[0]["realtime"]
    for c in each[1:]:
        granted &= c["realtime"]
    total["realtime"] = realtime_words(granted)
    return total


def wake_results(slices: Slices) -> dict[str, Any]:
    """How late each woke, and the ratios to cyclictest's threads, pooled."""
    theirs = of_name(slices["cyclictest"], "wake_late_us")
    ours = {who: of_name(slices["leeway"], f"{who} wake_late_us") for who in PROGRAMS}
    ours["both"] = [pool(pair) for pair in zip(*ours.values(), strict=True)]
    return {
        "wake_us": {
            **{who: pool(histograms).summary() for who, histograms in ours.items()},
            "cyclictest": pool(theirs).summary(),
        },
        "wake_ratio": {
            who: {p: compare(histograms, theirs, PERCENTILES[p]) for p in WAKE_PERCENTILES}
            for who, histograms in ours.items()
        },
    }


def round_trip_results(slices: Slices) -> dict[str, Any]:
    """Round trips of every link, and the ratios to bare UDP."""
    links = {name: of_name(slices[name], "round_trip_us") for name in LINKS}
    return {
        "round_trip_us": {name: pool(histograms).summary() for name, histograms in links.items()},
        "round_trip_ratio": {
            name: {
                p: compare(histograms, links["udp"], PERCENTILES[p]) for p in ROUND_TRIP_PERCENTILES
            }
            for name, histograms in links.items()
            if name != "udp"
        },
        "round_trips": {
            name: {
                **{key: sum(s.counts[key] for s in slices[name]) for key in ROUND_TRIP_COUNTS},
                **{key: slices[name][0].counts[key] for key in ("bytes_there", "bytes_back")},
                "realtime": all(s.counts["realtime"] for s in slices[name]),
            }
            for name in links
        },
    }


def condition_results(slices: Slices, rate_hz: float, loaded: bool) -> dict[str, Any]:
    """Everything that was found out at one rate under one load."""
    period_us = 1e6 / rate_hz
    ours = slices["leeway"]
    wake = pool(of_name(slices["cyclictest"], "wake_late_us"))
    return {
        "rate_hz": rate_hz,
        "load": "loaded" if loaded else "idle",
        "alternations": len(ours),
        **wake_results(slices),
        **round_trip_results(slices),
        **{
            name: {who: pool(of_name(ours, f"{who} {name}")).summary() for who in PROGRAMS}
            for name in HISTOGRAMS[1:]
        },
        "programs": {who: program_counts(ours, who, period_us) for who in PROGRAMS},
        "cyclictest": {"samples": wake.n, "late": wake.at_least(period_us)},
        "receivers": max(s.counts["receivers"] for s in ours),
        "histograms": {
            f"{kind} {name}": sparse(pool(of_name(of_kind, name)))
            for kind, of_kind in slices.items()
            for name in of_kind[0].histograms
        },
    }
