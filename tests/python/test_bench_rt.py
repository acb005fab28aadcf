"""Real-time bench: what it makes of histograms, of cyclictest's words and of its own children."""

import re
import shutil
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from rt import jobs
from rt.__main__ import make_order, missing_tools, parse
from rt.histogram import (
    BINS,
    PERCENTILES,
    Histogram,
    compare,
    from_cyclictest,
    from_json,
    pool,
    ratio,
)
from rt.load import flood_rate
from rt.results import condition_results, realtime_words
from rt.slices import CONTENDERS, LINKS, PROGRAMS, Slice
from rt.tables import show


def histogram_of(samples):
    """Histogram of samples in us."""
    samples = np.asarray(samples)
    inside = samples[samples < BINS].astype(int)
    bins = np.bincount(inside, minlength=BINS).astype(np.int64)
    return Histogram(bins, int((samples >= BINS).sum()), float(samples.max(initial=0)))


def cyclictest_text(*threads):
    """What cyclictest prints for the samples of each thread."""
    all_ = [histogram_of(t) for t in threads]

    def line(head, values):
        return f"# {head}: " + " ".join(f"{v:05d}" for v in values)

    rows = [f"{us:06d} " + "\t".join(f"{h.bins[us]:06d}" for h in all_) for us in range(BINS)]
    return "\n".join(
        [
            "# /dev/cpu_dma_latency set to 0us",
            "# Histogram",
            *rows,
            line("Total", [h.n - h.over for h in all_]),
            line("Min Latencies", [min(t) for t in threads]),
            line("Avg Latencies", [int(np.mean(t)) for t in threads]),
            line("Max Latencies", [max(t) for t in threads]),
            line("Histogram Overflows", [h.over for h in all_]),
            "# Histogram Overflow at cycle number:",
            "# Thread 0: 00017",
            "# Thread 1:",
            "",
        ]
    )


# --- histograms ---


@pytest.mark.parametrize("n", [1, 2, 7, 1000, 9999])
def test_percentiles_are_those_of_the_sorted_samples(n):
    samples = np.random.default_rng(n).exponential(40, n)
    h = histogram_of(samples)
    for p in (0.0, *PERCENTILES.values(), 1.0):
        assert h.percentile(p) == int(np.sort(samples)[int((n - 1) * p)])
    assert h.n == n


def test_a_percentile_beyond_the_bins_is_the_largest_sample():
    h = histogram_of([10] * 90 + [25_000] * 9 + [31_000])
    assert h.percentile(0.5) == 10
    assert h.percentile(0.99) == 31_000
    assert h.summary() == {"n": 100, "p50": 10, "p99": 31_000, "p99.9": 31_000, "max": 31_000}


def test_nothing_measured_has_no_percentile():
    assert np.isnan(pool([]).percentile(0.5))
    assert ratio(5.0, pool([]).percentile(0.5)) is None


def test_pooling_is_joining_the_samples():
    parts = [np.random.default_rng(k).exponential(3000, 500) for k in range(4)]
    pooled, joined = pool(map(histogram_of, parts)), histogram_of(np.concatenate(parts))
    assert (pooled.bins == joined.bins).all()
    assert pooled.over == joined.over > 0
    assert pooled.max_us == joined.max_us


def test_at_least_counts_the_bin_itself_and_the_overflows():
    h = histogram_of([199, 200, 200, 201, 30_000])
    assert [h.at_least(us) for us in (199, 199.5, 200, 201, 202)] == [5, 4, 4, 2, 1]


def test_our_programs_histograms_are_read():
    h = from_json({"bins": [0, 3, 1], "over": 2, "max_ns": 20_500_000})
    assert (h.n, h.over, h.max_us) == (6, 2, 20_500)
    assert h.percentile(0.5) == 1


# --- cyclictest ---


def test_cyclictest_is_read_with_all_threads_and_overflows():
    a, b = [5, 5, 7, 21_000], [0, 7, 7, 19_999]
    h = from_cyclictest(cyclictest_text(a, b))
    expected = histogram_of(a + b)
    assert (h.bins == expected.bins).all()
    assert (h.over, h.max_us) == (1, 21_000)


def test_cyclictest_cut_short_is_refused():
    text = cyclictest_text([5, 5], [6, 7])
    with pytest.raises(ValueError, match="do not add up"):
        from_cyclictest(text.replace("000005 000002", "000005 000001"))
    with pytest.raises(ValueError, match="no line '# Total'"):
        from_cyclictest(text[: text.index("# Total")])


@pytest.mark.skipif(shutil.which("cyclictest") is None, reason="no cyclictest")
def test_the_real_cyclictest_is_understood():
    command = "cyclictest -t2 -i 1000 -d0 -h 20000 -D 1 -q --policy other --default-system"
    result = subprocess.run(command.split(), capture_output=True, text=True, timeout=30)
    if result.returncode != 0:
        pytest.skip(f"cyclictest may not run here: {result.stderr.strip()}")
    h = from_cyclictest(result.stdout)
    assert 1000 < h.n <= 2002
    assert 0 < h.percentile(0.5) <= h.max_us


# --- ratios ---


def test_ratios_are_of_the_pools_with_quartiles_of_the_slices():
    ours = [histogram_of([us] * 2000) for us in (20, 40, 60, 80, 100)]
    theirs = [histogram_of([us] * 2000) for us in (20, 20, 20, 20, 50)]
    found = compare(ours, theirs, 0.5)
    assert found == {"pooled": 3, "q1": 2, "median": 2, "q3": 3, "few_samples": False}


def test_few_samples_are_marked():
    h = [histogram_of(np.arange(999))]
    assert compare(h, h, 0.99)["few_samples"]
    h = [histogram_of(np.arange(1001))]
    assert not compare(h, h, 0.99)["few_samples"]
    assert compare(h, h, 0.999)["few_samples"]


def test_a_ratio_to_zero_is_none():
    zero, some = [histogram_of([0] * 10)], [histogram_of([3] * 10)]
    found = compare(some, zero, 0.5)
    assert found["pooled"] is None
    assert found["q1"] is None


def test_slices_without_a_partner_are_refused():
    h = histogram_of([1])
    with pytest.raises(ValueError, match="zip"):
        compare([h, h], [h], 0.5)


# --- flood ---


def test_the_floods_rate_is_that_of_the_spans():
    start = 2**60 + 1
    # 1000/s for a second, then 3000/s; the last line is not whole yet.
    sent = [*range(0, 1001, 100), *range(1300, 4001, 300)]
    lines = [f"{start + k * 10**8} {n}" for k, n in enumerate(sent)]
    text = "\n".join(lines) + f"\n{start + 21 * 10**8} 4"
    s = 10**9
    assert flood_rate(text, [(start, start + s)]) == pytest.approx(1000)
    assert flood_rate(text, [(start + s // 2, start + 3 * s // 2)]) == pytest.approx(2000)
    assert flood_rate(text, [(start, start + s), (start + s, start + 2 * s)]) == pytest.approx(2000)


# --- a condition ---


def leeway_slice(allocations=0, realtime=7):
    """Slice of both programs: the controller wakes after 20 us, the plant after 40."""
    counts = {
        "ticks": 1000,
        "skipped": 1,
        "stale_ticks": 2,
        "unsent": 0,
        "minor_faults": 3,
        "major_faults": 0,
        "allocations": allocations,
        "realtime": realtime,
    }
    late = {"controller": 20, "plant": 40}
    histograms = {f"{who} wake_late_us": histogram_of([late[who]] * 999 + [1000]) for who in late}
    for who in PROGRAMS:
        for name in ("exec_us", "age_us"):
            histograms[f"{who} {name}"] = histogram_of([9] * 1000)
    return Slice((0, 1), histograms, {"receivers": 3, **{who: dict(counts) for who in PROGRAMS}})


def link_slice(us):
    """Slice of a ping-pong."""
    counts = {"sent": 1000, "lost": 1, "skipped": 0, "bytes_there": 189, "bytes_back": 383}
    return Slice((0, 1), {"round_trip_us": histogram_of([us] * 999)}, counts | {"realtime": True})


def slices(count=2):
    cyclictest = Slice((0, 1), {"wake_late_us": histogram_of([10] * 1998 + [2000] * 2)})
    return {
        "leeway": [leeway_slice() for _ in range(count)],
        "cyclictest": [cyclictest] * count,
        **{link: [link_slice(50 if link == "udp" else 100)] * count for link in LINKS},
    }


def test_a_condition_is_summed_up():
    found = condition_results(slices(), 1000, True)
    assert found["wake_ratio"]["controller"]["p99"]["pooled"] == 2
    assert found["wake_ratio"]["plant"]["p99"]["pooled"] == 4
    assert found["wake_ratio"]["both"]["p99"]["pooled"] == 4
    assert found["wake_us"]["both"]["n"] == found["wake_us"]["cyclictest"]["n"] == 4000
    assert found["round_trip_ratio"]["lcm"]["p50"]["pooled"] == 2
    assert found["round_trips"]["lcm"]["lost"] == 2
    controller = found["programs"]["controller"]
    assert (controller["ticks"], controller["late"], controller["stale_ticks"]) == (2000, 2, 4)
    assert found["cyclictest"] == {"samples": 4000, "late": 4}
    assert found["histograms"]["leeway plant wake_late_us"] == {"40": 1998, "1000": 2}


def test_what_one_slice_lacks_is_not_claimed():
    with_holes = slices() | {"leeway": [leeway_slice(-1, realtime=5), leeway_slice()]}
    controller = condition_results(with_holes, 1000, False)["programs"]["controller"]
    assert controller["allocations"] is None
    assert controller["realtime"] == "FIFO+AWAKE"
    assert realtime_words(0) == "none"


def test_tables_show_every_condition(capsys):
    conditions = [
        {**condition_results(slices(), rate, bool(flood)), "flood_hz": flood}
        for rate, flood in ((1000, {}), (5000, {"leeway": 27e3}))
    ]
    machine = dict.fromkeys(("kernel", "preemption", "cpus", "cpu", "cyclictest"), "?")
    options = {"slice_s": 3, "alternations": 2, "seed": 1, "stress": "--cpu 2", "flood_hz": 1}
    machine |= {"virtual": True, "stress-ng": "0.15"}
    show({"conditions": conditions, "machine": machine, "options": options})
    shown = capsys.readouterr().out
    assert len(re.findall(r"1000 Hz +idle", shown)) == 4
    assert len(re.findall(r"5000 Hz +loaded", shown)) == 4
    assert "4.00 [4.00 4.00]" in shown
    assert "0.200 + 0.200" in shown
    assert "…" not in shown


# --- the session ---


def test_every_alternation_has_each_contender_once():
    order = make_order(7, 20)
    assert all(sorted(turn) == sorted(CONTENDERS) for turn in order)
    assert order == make_order(7, 20) != make_order(8, 20)
    assert {turn[0] for turn in order} == set(CONTENDERS)


def test_options_have_their_defaults():
    assert parse([]).rates == [125, 500, 1000, 2000, 5000]
    assert parse([]).alternations == 10
    quick = parse(["--quick"])
    assert (quick.rates, quick.alternations) == ([1000], 3)
    assert parse(["--quick", "--rates", "500,2000"]).rates == [500, 2000]


@pytest.mark.parametrize(
    "wrong", ["--rates=0", "--rates=1,a", "--slice=0", "--slice=1.5", "--alternations=0"]
)
def test_wrong_options_are_refused(wrong, capsys):
    with pytest.raises(SystemExit) as ended:
        parse([wrong])
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert f"argument {wrong.split('=')[0]}: expected " in said


def test_missing_tools_are_named_with_their_remedy(monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None if name == "cyclictest" else name)
    assert missing_tools() == (
        "cyclictest not found: sudo apt-get install --no-install-recommends -y rt-tests"
    )
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert missing_tools().endswith(" -y rt-tests stress-ng")
    monkeypatch.setattr(shutil, "which", lambda name: name)
    assert missing_tools() is None


# --- children ---


def test_a_job_that_will_not_end_is_killed_with_its_children(monkeypatch):
    monkeypatch.setattr(jobs, "STOP_PATIENCE_S", 0.3)
    script = 'trap "" TERM; sleep 60 & echo $!; while :; do wait; done'
    with jobs.Job("sh", "-c", script) as job:
        job.wait_for(lambda: job.printed().endswith("\n"), 5, "child")
        child = int(job.printed())
    assert job.process.returncode == -signal.SIGKILL
    end = time.monotonic() + 5
    while _runs(child):
        assert time.monotonic() < end, "the job's child outlived it"
        time.sleep(0.01)


def _runs(pid):
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False
    return stat.rpartition(")")[2].split()[0] != "Z"


def test_a_job_that_fails_says_why():
    with (
        jobs.Job("sh", "-c", "echo no luck >&2; exit 3") as job,
        pytest.raises(jobs.JobFailed, match="sh ended with exit status 3: no luck"),
    ):
        job.finish(5)
    with (
        jobs.Job("sleep", "60") as job,
        pytest.raises(jobs.JobFailed, match=r"sleep did not end within 0\.1 s"),
    ):
        job.finish(0.1)
    assert job.process.returncode == -signal.SIGTERM
