"""Histograms in bins of 1 us: read, pool, percentiles, ratios."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

BINS = 20_000
# A percentile rests on this many samples above it, or it is noise.
FEW_SAMPLES = 10


@dataclass(frozen=True)
class Histogram:
    """Counts of samples of k us, cut to whole microseconds, for k < BINS; the others are `over`."""

    bins: NDArray[np.int64]
    over: int
    max_us: float

    @property
    def n(self) -> int:
        """Number of samples."""
        return int(self.bins.sum()) + self.over

    def percentile(self, p: float) -> float:
        """Return the sample at place (n - 1) p of all in order, us; the largest when it is over."""
        if self.n == 0:
            return float("nan")
        bin_ = int(np.searchsorted(np.cumsum(self.bins), int((self.n - 1) * p), side="right"))
        return float(bin_) if bin_ < BINS else self.max_us

    def at_least(self, us: float) -> int:
        """Count the samples of `us` or more."""
        return int(self.bins[int(np.ceil(us)) :].sum()) + self.over

    def summary(self) -> dict[str, float]:
        """Return n, percentiles and the largest sample, us."""
        points = {name: self.percentile(p) for name, p in PERCENTILES.items()}
        return {"n": self.n, **points, "max": self.max_us}


PERCENTILES = {"p50": 0.5, "p99": 0.99, "p99.9": 0.999}


def pool(histograms: Iterable[Histogram]) -> Histogram:
    """All samples together."""
    all_ = list(histograms)
    bins = np.zeros(BINS, np.int64)
    for h in all_:
        bins += h.bins
    return Histogram(bins, sum(h.over for h in all_), max((h.max_us for h in all_), default=0.0))


def from_json(value: dict[str, Any]) -> Histogram:
    """Read what our programs write: bins from 0 with trailing zeros cut, over, max_ns."""
    bins = np.zeros(BINS, np.int64)
    bins[: len(value["bins"])] = value["bins"]
    return Histogram(bins, int(value["over"]), value["max_ns"] / 1e3)


def _counts(text: str, head: str) -> list[int]:
    """Return the numbers, one a thread, of a line `# HEAD: ...` of cyclictest."""
    found = re.search(rf"^# {head}:([ \t\d]*)$", text, re.M)
    if not found:
        raise ValueError(f"cyclictest printed no line '# {head}'")
    return [int(number) for number in found[1].split()]


def from_cyclictest(text: str) -> Histogram:
    """Read what `cyclictest -h 20000 -q` prints, all threads together."""
    bins = np.zeros(BINS, np.int64)
    for row in re.finditer(r"^(\d+)((?:[ \t]+\d+)+)[ \t]*$", text, re.M):
        bins[int(row[1])] = sum(map(int, row[2].split()))
    # Its totals leave the overflows out.
    if bins.sum() != sum(_counts(text, "Total")):
        raise ValueError("cyclictest's rows do not add up to its totals")
    over = sum(_counts(text, "Histogram Overflows"))
    return Histogram(bins, over, float(max(_counts(text, "Max Latencies"))))


def ratio(ours: float, theirs: float) -> float | None:
    """Return ours / theirs, None where that is no number."""
    value = ours / theirs if theirs > 0 else float("nan")
    return value if np.isfinite(value) else None


def compare(
    ours: Sequence[Histogram], theirs: Sequence[Histogram], p: float
) -> dict[str, float | bool | None]:
    """Compare one percentile of slices that were measured in pairs.

    Returns
    -------
    Ratio of the pooled percentiles; quartiles of the slices' own ratios; whether either pool is too
    small for this percentile.
    """
    a, b = pool(ours), pool(theirs)
    each = [ratio(x.percentile(p), y.percentile(p)) for x, y in zip(ours, theirs, strict=True)]
    known = [value for value in each if value is not None]
    quartiles = [float(q) for q in np.percentile(known, [25, 50, 75])] if known else [None] * 3
    return {
        "pooled": ratio(a.percentile(p), b.percentile(p)),
        **dict(zip(("q1", "median", "q3"), quartiles, strict=True)),
        "few_samples": min(a.n, b.n) * (1 - p) < FEW_SAMPLES,
    }
