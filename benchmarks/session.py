"""Sessions: how soon they open, how pairs are shared, what logs cost to write, read, watch and export.

**Opening.** The plain way reads every picture before the first trial, computes its costs unless they are in the cache,
and makes it ready to be shown: what opening a session did. Beside it a session opens with what the cache has, makes the
first trial ready, and computes each other cost when it is needed; the time to all costs is that of asking for all of
them at once. Pictures read are counted. The error is the largest difference of any cost from the plain way's.

**Pairs shared among observers**, with random parts of all pairs beside. The error is how much oftener the commonest
pair is compared than the rarest, over 10, 15 and 30 observers. The time is that of all designs up to the last observer.

**Logs.** What a trial's line costs with its checksum and without, what a sync costs beside it, and reading 20,000
trials. Watching: the error is how many logs are read that did not change since the last look. An export to BIDS stands
beside the least that any export does: to read the logs and to write their lines.

**Marks.** How soon after the swap a mark to another machine is sent and received, and what a thread of its own would
cost. Marks go to a pseudo-terminal, and to an inlet of Lab Streaming Layer in this process. The session sends them with
a write that never waits; beside that a thread of its own writes them, once with nothing else to do and once while the
session's thread prepares the next pictures, as it does after a swap. A whole session of simulated observers states in
its record how long after each swap its mark was sent. Where frames are real, `cyclopean doctor --timing` measures it.
"""

from __future__ import annotations

import json
import os
import queue
import random
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from importlib.util import find_spec
from itertools import combinations
from pathlib import Path
from statistics import median
from time import perf_counter, process_time
from typing import Any

import numpy as np
from curves import program, row, seconds, sized
from promises import Promise, worst

from analysis.kinds import Trial, new_trial
from analysis.records import FILE_NAME, Header, new_header, read_session, session_files
from analysis.seals import check_log
from documents.files.chain import EMPTY, sealed
from documents.platform import pseudo_terminal
from extensions.bids.export import export_dataset
from extensions.marks import LslMarksSpec, Marked, MarksSpec, SerialMarksSpec
from runner.blocks.incomplete_pairs import designs
from runner.protocol.experiment import Experiment, read_experiment
from runner.scene import Picture, Scene
from runner.session import run_session
from runner.session.clipping_costs import COSTS, ClippingCosts
from runner.session.folders import Recorder
from runner.session.options import SessionOptions
from runner.session.station import Station
from runner.session.watching import Watch
from stimuli.build import StimulusSet, build_set, cache_folder
from stimuli.pictures import StereoImage, write_exr

PICTURES, SIZE_PX = sized((90, (360, 240)), (6, (60, 40)))
DISPLAY = Path(__file__).parents[1] / "configs/displays/asus_vg248qe.yaml"
EXPERIMENT = """schema_version: 1
name: opening
rig: rig.yaml
stimuli: recipe.yaml
question: Which is closer?
layout: {arrangement: vertical, size_mm: [95, 60]}
blocks: [{kind: rating, ratings: [{name: closeness, question: "How close is it?"}]}]
"""
SIZES = sized(((12, 20), (30, 60), (60, 118), (60, 300)), ((12, 20), (30, 60)))
OBSERVERS = 10, 15, 30
TRIALS = sized(20_000, 200)
MOST_CHECKSUM_US, MOST_READING_S = 20.0, 4.0
UTC = "2026-01-02T03:00:00.000+00:00"
COST = {f"percent_{what}": 0.5 for what in ("red", "green", "blue", "any", "above_full")} | {"delta_e_00_mean": 0.1}


def make(folder: Path, pictures: int = PICTURES, size_px: tuple[int, int] = SIZE_PX) -> Path:
    """Write an experiment of ``pictures`` noisy pictures and return its file."""
    rng = np.random.default_rng(1)
    names = [f"p{number:03d}" for number in range(pictures)]
    light = rng.uniform(1, 60, (size_px[1], size_px[0], 3)).astype(np.float32)
    for number, name in enumerate(names):
        write_exr(
            folder / f"{name}.exr", StereoImage.flat(np.roll(light, number, axis=0) * np.float32(1 + number / 1000))
        )
    listed = "".join(f"  - {{name: {name}, file: {name}.exr}}\n" for name in names)
    (folder / "recipe.yaml").write_text(f"schema_version: 1\nkind: pictures\nstimuli:\n{listed}")
    (folder / "rig.yaml").write_text(
        f"schema_version: 1\ndisplay: {DISPLAY.as_posix()}\nmode: side-by-side\ndistance_mm: 700\n"
    )
    (folder / "experiment.yaml").write_text(EXPERIMENT)
    return folder / "experiment.yaml"


def built(design: Experiment) -> StimulusSet:
    """Return the experiment's stimuli."""
    return build_set(design.recipe_file, design.rig.display.panel.pixel_pitch_mm)


@contextmanager
def own_cache(folder: Path) -> Iterator[None]:
    """Keep stimuli and costs in ``folder`` meanwhile."""
    before = os.environ.get("CYCLOPEAN_CACHE")
    os.environ["CYCLOPEAN_CACHE"] = str(folder)
    try:
        yield
    finally:
        os.environ.pop("CYCLOPEAN_CACHE")
        if before is not None:
            os.environ["CYCLOPEAN_CACHE"] = before


Costs = Mapping[str, Any]
# Called once the first trial can be shown; the costs and the pictures read are returned.
Opening = Callable[[Experiment, StimulusSet, Callable[[], None]], tuple[Costs, int]]


def plainly(design: Experiment, stimuli: StimulusSet, first_trial: Callable[[], None]) -> tuple[Costs, int]:
    """Read every picture, for its costs and to be shown, before the first trial."""
    with Station.open(design, stimuli, SessionOptions(Path("unused"), backend="egl")) as station:
        costs = ClippingCosts.of(design, stimuli, station.pictures.stimulus)
        known = {}
        for name in stimuli.names:
            known[name] = costs.description(name)["clipping"]
            station.presenter.prefetch(Scene((Picture(name),)))
        first_trial()
        return known, station.pictures.read


def in_turn(design: Experiment, stimuli: StimulusSet, first_trial: Callable[[], None]) -> tuple[Costs, int]:
    """Open as a session does, make the first trial ready, then ask for all costs."""
    with Station.open(design, stimuli, SessionOptions(Path("unused"), backend="egl")) as station:
        station.presenter.prefetch(Scene(tuple(Picture(name) for name in stimuli.names[:2])))
        first_trial()
        return station.costs.of(stimuli.names), station.pictures.read


def opening() -> dict[str, Any]:
    """Open first and again, both ways."""
    rows: list[dict[str, Any]] = []
    reference: Costs = {}

    def timed(series: str, open_session: Opening) -> None:
        nonlocal reference
        design = read_experiment(folder / "experiment.yaml")
        stimuli = built(design)
        began, cpu = perf_counter(), process_time()
        first_s = cpu_first_s = 0.0

        def first_trial() -> None:
            nonlocal first_s, cpu_first_s
            first_s, cpu_first_s = perf_counter() - began, process_time() - cpu

        costs, read = open_session(design, stimuli, first_trial)
        all_s, cpu_all_s = perf_counter() - began, process_time() - cpu
        reference = reference or costs
        error = max(largest_difference(costs[name], reference[name]) for name in reference)
        for what, wall, processor in (("first trial", first_s, cpu_first_s), ("all costs", all_s, cpu_all_s)):
            more = {"processor seconds": processor, "pictures read": read}
            rows.append(row(series, f"to {what}", wall, error, **more))

    with tempfile.TemporaryDirectory() as path, own_cache(Path(path) / "cache"):
        folder = Path(path)
        make(folder, PICTURES, SIZE_PX)
        built(read_experiment(folder / "experiment.yaml"))
        timed("plainly, first time", plainly)
        timed("plainly, again", plainly)
        for file in (cache_folder() / COSTS).iterdir():
            file.unlink()
        timed("in turn, first time", in_turn)
        timed("in turn, again", in_turn)
    return {"title": f"Opening a session of {PICTURES} pictures", "rows": rows, "promises": _opening_promises(rows)}


def _opening_promises(rows: list[dict[str, Any]]) -> list[Promise]:
    cpu = {row["series"]: row["processor seconds"] for row in rows if row["parameter"] == "to first trial"}
    read = next(row["pictures read"] for row in rows if row["series"] == "in turn, again")
    again = cpu["plainly, again"] / cpu["in turn, again"]
    return [
        Promise("costs that came in turn", worst(rows), 0.0, "error"),
        Promise("pictures read for known costs, beside the first trial's two", read - 2, 0, "count", "exactly"),
        Promise("first trial, the second time, as against reading every picture", again, 2.0, "ratio", "at least", "×"),
    ]


def largest_difference(one: Any, other: Any) -> float:
    """Return the largest difference of a number in one mapping from that in another."""
    if isinstance(other, Mapping):
        return max((largest_difference(one[key], other[key]) for key in other), default=0.0)
    return abs(float(one) - float(other))


def shared_pairs() -> dict[str, Any]:
    """Make the designs of several studies, balanced and random."""
    rows = [row for count, each in SIZES for row in _design_rows(count, each)]
    ours = [row for row in rows if row["series"] == "balanced"]
    promises = [Promise("pairs compared oftener than the rarest, at most so many times", worst(ours), 1, "count")]
    return {"title": "Pairs shared among observers: time against imbalance", "rows": rows, "promises": promises}


def balanced(count: int, pairs: Sequence[tuple[int, int]], each: int, observers: int) -> list[list[int]]:
    """Return the pairs of each observer as a session shares them out."""
    return list(designs(count, pairs, each, "seed", observers))


def drawn(pairs: int, each: int, observers: int) -> list[list[int]]:
    """Return a random part of all pairs for each observer."""
    rng = random.Random(1)
    return [rng.sample(range(pairs), each) for _ in range(observers)]


def _design_rows(count: int, each: int) -> Iterator[dict[str, Any]]:
    pairs = list(combinations(range(count), 2))
    for observers in OBSERVERS:
        case = f"{count} stimuli, {each} of {len(pairs)} pairs each, {observers} observers"
        for series, parts in (
            ("balanced", partial(balanced, count, pairs, each, observers)),
            ("random", partial(drawn, len(pairs), each, observers)),
        ):
            taken_s = seconds(parts, repeats=3)
            yield row(series, case, taken_s, _imbalance(len(pairs), parts()))


def _imbalance(pairs: int, parts: Sequence[Sequence[int]]) -> float:
    times = np.bincount(np.concatenate([np.array(part) for part in parts]), minlength=pairs)
    return float(np.ptp(times))


def _header(observer: str, stimuli: Sequence[str], started: str = UTC) -> Header:
    described = tuple({"name": name, "factors": {}} for name in stimuli)
    return new_header("bench", observer, "s1", started, question="Which?", simulated=True, stimuli=described)


def _trial(number: int, first: str = "a", second: str = "b", utc: str = UTC) -> Trial:
    """Return a pair as the runner writes it, with what clipping costs its pictures."""
    pair = {"first": first, "second": second, "answer": "first", "chosen": first, "rejected": second}
    clipping = {name: {"left": COST, "right": COST} for name in (first, second)}
    data = {**pair, "first_position": "top", "clipping": clipping}
    return new_trial(0, number, "all_pairs", (("up", 1.0),), 1.0, utc, data)


def _log(folder: Path, header: Mapping[str, Any], trials: Iterator[Trial]) -> Path:
    """Write a log without syncs and checksums; return its file."""
    folder.mkdir(parents=True)
    lines = [json.dumps(line) for line in (header, *(trial.to_json() for trial in trials))]
    file = folder / FILE_NAME
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file


def _of_processor(work: Callable[[], object], calls: int = 3) -> float:
    """Return the median processor time of ``calls`` in seconds, which other programs do not lengthen."""
    taken = []
    for _ in range(calls):
        began = process_time()
        work()
        taken.append(process_time() - began)
    return median(taken)


def _unchained(line: dict[str, object]) -> bytes:
    text = json.dumps(line, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.encode("utf-8", "backslashreplace") + b"\n"


def _line_rows() -> list[dict[str, Any]]:
    lines = [_trial(number).to_json() for number in range(sized(2000, 100))]
    plain = _of_processor(lambda: [_unchained(line) for line in lines], 21) / len(lines)
    chained = _of_processor(lambda: [sealed(line, 1, EMPTY) for line in lines], 21) / len(lines)
    added = 1e6 * (chained - plain)
    note = f"the number and the checksum add {added:.1f} µs"
    size = f"a line of {len(_unchained(lines[0]))} bytes"
    return [
        row("without a checksum", size, plain),
        row("with a checksum", size, chained, note=note),
    ]


def _reading_rows(folder: Path) -> list[dict[str, Any]]:
    real = os.fsync
    with Recorder.create(folder / "s", _header("01", "ab")) as recorder:
        began = perf_counter()
        for number in range(100):
            recorder.append(_trial(number))
        appended = (perf_counter() - began) / 100
        os.fsync = lambda descriptor: None  # 20,000 of them are not what is measured
        try:
            for number in range(100, TRIALS):
                recorder.append(_trial(number))
        finally:
            os.fsync = real
    file = folder / "s" / FILE_NAME
    reading = _of_processor(lambda: read_session(file))

    def reopen() -> None:
        Recorder.reopen(folder / "s")[0].close()

    reopening, checking = _of_processor(reopen), _of_processor(lambda: check_log(file))
    trials = f"{TRIALS} trials, {file.stat().st_size / 1e6:.0f} MB"
    return [
        row("append with fsync", "a trial", appended),
        row("read a session", trials, reading),
        row("reopen to resume", trials, reopening, note="of the processor"),
        row("verify", trials, checking),
    ]


def log() -> dict[str, object]:
    """Time a line, and a log read again."""
    with tempfile.TemporaryDirectory() as place:
        rows = _line_rows() + _reading_rows(Path(place))
    times = {str(row["series"]): float(row["seconds"]) for row in rows}
    added_us = 1e6 * (times["with a checksum"] - times["without a checksum"])
    promises = [
        Promise("number and checksum of a line", added_us, MOST_CHECKSUM_US, "seconds", unit="µs"),
        Promise("reopened to resume, 20,000 trials", times["reopen to resume"], MOST_READING_S, "seconds", unit="s"),
    ]
    return {"title": "The log of a session", "rows": rows, "promises": promises}


def watching() -> dict[str, Any]:
    """Look at all logs, and again where none changed, and one."""
    sessions, trials = sized((20, 300), (3, 20))
    with tempfile.TemporaryDirectory() as folder:
        files = [_watched(Path(folder), f"{number:02d}", trials) for number in range(sessions)]
        watch = Watch(Path(folder))
        case = f"{sessions} sessions of {trials} trials"
        rows = []
        for series, changed in (("first look", sessions), ("no log changed", 0), ("one log changed", 1)):
            for file in files[:changed]:
                os.utime(file)
            before = watch.read
            start_s = perf_counter()
            watch.look()
            taken_s = perf_counter() - start_s
            rows.append(row(series, case, taken_s, float(watch.read - before - changed)))
    promises = [Promise("logs read again although they did not change", worst(rows), 0, "count")]
    return {"title": "Watching running sessions: time against logs read in vain", "rows": rows, "promises": promises}


def _watched(folder: Path, observer: str, trials: int) -> Path:
    planned = ({"kind": "all_pairs", "trials": 2 * trials, "expected_s": 10.0 * trials},)
    header = _header(observer, "ab").to_json() | {"planned": planned}
    times = (f"2026-01-31T{9 + n // 3600:02}:{30 + n // 60 % 30:02}:{n % 60:02}Z" for n in range(trials))
    answers = (_trial(number, utc=utc) for number, utc in enumerate(times))
    return _log(folder / f"sub-{observer}" / "ses-s1", header, answers)


def export() -> dict[str, object]:
    """Time an export to BIDS, and the least that it does; the error column has no meaning here."""
    sessions, trials = sized(100, 3), 45
    names = tuple(f"s{index}" for index in range(10))
    with tempfile.TemporaryDirectory() as place:
        results = Path(place, "results")
        for number in range(sessions):
            header = _header(f"o{number}", names).to_json()
            answers = (_trial(trial, names[trial % 10], names[(trial + 3) % 10]) for trial in range(trials))
            _log(results / f"sub-o{number}", header, answers)
        exporting = seconds(lambda: export_dataset([results], Path(place, "bids")), repeats=3)
        reading = seconds(lambda: [len(read_session(file).trials) for file in session_files(results)], repeats=3)
        again = seconds(lambda: _write_again(results, Path(place, "again.jsonl")), repeats=3)
    what = f"{sessions} sessions of {trials} trials"
    note = f"{1000 * exporting / sessions:.1f} ms per session, {exporting / reading:.1f} × reading the logs"
    rows = [
        row("export", what, exporting, note=note),
        row("reading the logs", what, reading),
        row("reading them and writing their lines", what, again),
    ]
    name = "time of an export beside reading the logs and writing their lines"
    return {
        "title": "BIDS export",
        "rows": rows,
        "promises": [Promise(name, exporting / again, 5.0, "ratio", unit="×")],
    }


def _write_again(results: Path, file: Path) -> None:
    with open(file, "w", encoding="utf-8") as stream:
        for log in map(read_session, session_files(results)):
            stream.writelines(json.dumps(trial.to_json()) + "\n" for trial in log.trials)


MARKS = sized(2000, 100)
MARKED_PICTURES = sized(40, 6)
BUSY_S = 0.004
_OBSERVERS = "schema_version: 1\nkind: bradley_terry\nstimuli:\n"
Send = Callable[[float], None]
Delays = list[float]


def delays(send: Send, receive: Callable[[float], object], meanwhile: Callable[[], None]) -> tuple[Delays, Delays, int]:
    """Return how long after an event each mark was handed over and received, in seconds, and how many were not."""
    sent_s, received_s, lost = [], [], 0
    for _ in range(MARKS):
        time.sleep(0.0005)
        event_s = time.monotonic()
        send(event_s)
        sent_s.append(time.monotonic() - event_s)
        meanwhile()
        if receive(1.0):
            received_s.append(time.monotonic() - event_s)
        else:
            lost += 1
    return sent_s, received_s, lost


@contextmanager
def from_a_thread(send: Send) -> Iterator[tuple[Send, Delays]]:
    """Let a thread of its own send what is handed to it; yield when it had sent each, after the event."""
    waiting: queue.SimpleQueue[float | None] = queue.SimpleQueue()
    done: Delays = []

    def work() -> None:
        while (event_s := waiting.get()) is not None:
            send(event_s)
            done.append(time.monotonic() - event_s)

    thread = threading.Thread(target=work)
    thread.start()
    try:
        yield waiting.put, done
    finally:
        waiting.put(None)
        thread.join()


def busy() -> None:
    """Compute in Python for some milliseconds."""
    until_s = time.monotonic() + BUSY_S
    while time.monotonic() < until_s:
        sum(range(50))


def nothing() -> None:
    """Do nothing."""


def _marks_measured() -> dict[str, Any]:
    """Measure each kind, and a whole session."""
    rows: list[dict[str, Any]] = []
    lost = 0

    def add(series: str, what: str, seconds: Delays) -> None:
        rows.append(row(series, what, median(seconds), note=f"worst of {len(seconds)}: {1000 * max(seconds):.3g} ms"))

    kinds: list[tuple[str, MarksSpec]] = [
        ("serial port, by a pseudo-terminal", SerialMarksSpec(kind="serial", port="x"))
    ]
    if find_spec("pylsl"):
        kinds.append(("Lab Streaming Layer, by an inlet", LslMarksSpec(kind="lsl", stream=f"benchmark {os.getpid()}")))
    for name, spec in kinds:
        code = spec.code(Marked("onset", 1, 4, stimuli=("a", "b")))
        with spec.loopback() as loopback:
            if loopback is None or code is None:
                continue

            def send(event_s: float, port: Any = loopback.port, code: Any = code) -> None:
                port.send(code, event_s)

            sent, received, missing = delays(send, loopback.receive, nothing)
            lost += missing
            add(name, "sent by the session itself", sent)
            add(name, "received", received)
            for what, meanwhile in (("nothing else to do", nothing), ("the session prepares pictures", busy)):
                with from_a_thread(send) as (hand_over, done):
                    *_, missing = delays(hand_over, loopback.receive, meanwhile)
                lost += missing
                add(name, f"sent by a thread, {what}", done)
    marks = session_marks()
    lost += sum("failed" in mark for mark in marks)
    onsets = [mark["after_ms"] / 1000.0 for mark in marks if mark["mark"] == "onset" and "after_ms" in mark]
    add("a session, its own record", "onsets, after the swap", onsets)
    return {"title": "Timing marks after the swap", "rows": rows, "lost": lost}


def session_marks() -> list[dict[str, Any]]:
    """Run a session whose marks go to a pseudo-terminal, and return what its record says of them."""
    with tempfile.TemporaryDirectory() as path, own_cache(Path(path) / "cache"), pseudo_terminal() as terminal:
        if terminal is None:
            return []
        folder = Path(path)
        experiment = make(folder, MARKED_PICTURES, (60, 40))
        experiment.write_text(EXPERIMENT)
        rig = folder / "rig.yaml"
        rig.write_text(f"{rig.read_text()}timing_marks: {{kind: serial, port: {terminal[0]}}}\n")
        listed = "".join(f"  p{number:03d}: {{score: {1 + number}}}\n" for number in range(MARKED_PICTURES))
        (folder / "observers.yaml").write_text(_OBSERVERS + listed)
        options = SessionOptions(folder / "results", simulate=folder / "observers.yaml", marks=True)
        run_session(experiment, "01", options)
        (file,) = session_files(folder / "results")
        return [mark for trial in read_session(file).trials for mark in trial.details()["timing_marks"]]


def marks() -> dict[str, Any]:
    """Measure, and state what is promised."""
    result = _marks_measured()
    times = {(row["series"], row["parameter"]): row["seconds"] for row in result["rows"]}
    promises = [Promise("marks that were lost", result["lost"], 0, "count", "exactly")]
    for name in dict.fromkeys(series for series, _ in times if series != "a session, its own record"):
        by_thread = times[name, "sent by a thread, the session prepares pictures"]
        sooner = by_thread / times[name, "sent by the session itself"]
        what = f"{name}: sent as against a thread of its own, while pictures are prepared"
        promises.append(Promise(what, sooner, 5.0, "ratio", "at least", "×"))
    own = times["a session, its own record", "onsets, after the swap"]
    promises.append(Promise("onset marks of a session, median after the swap", own, 0.001, "seconds", unit="s"))
    if not find_spec("pylsl"):
        missing = "pylsl is not installed: pip install '.[lsl]'"
        promises.append(Promise("Lab Streaming Layer", None, 5.0, "ratio", "at least", "×", missing=missing))
    return result | {"promises": promises}


if __name__ == "__main__":
    program("session", opening, shared_pairs, log, watching, export, marks)
