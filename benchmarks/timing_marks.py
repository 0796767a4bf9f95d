"""How soon after the swap a mark to another machine is sent and received, and what a thread of its own would cost.

Marks go to a pseudo-terminal, and to an inlet of Lab Streaming Layer in this process. The session sends them with a
write that never waits; beside that a thread of its own writes them, once with nothing else to do and once while the
session's thread prepares the next pictures, as it does after a swap. A whole session of simulated observers states in
its record how long after each swap its mark was sent. Where frames are real, `cyclopean doctor --timing` measures it.
"""

from __future__ import annotations

import os
import queue
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from statistics import median
from typing import Any

from curves import program, row, sized
from promises import Promise
from session import EXPERIMENT, make, own_cache

from analysis.records import read_session, session_files
from documents.platform import pseudo_terminal
from extensions.marks import LslMarksSpec, Marked, MarksSpec, SerialMarksSpec
from runner.session import SessionOptions, run_session

MARKS = sized(2000, 100)
PICTURES = sized(40, 6)
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


def idle() -> None:
    """Do nothing."""


def run() -> dict[str, Any]:
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

            sent, received, missing = delays(send, loopback.receive, idle)
            lost += missing
            add(name, "sent by the session itself", sent)
            add(name, "received", received)
            for what, meanwhile in (("nothing else to do", idle), ("the session prepares pictures", busy)):
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
        experiment = make(folder, PICTURES, (60, 40))
        experiment.write_text(EXPERIMENT)
        rig = folder / "rig.yaml"
        rig.write_text(f"{rig.read_text()}timing_marks: {{kind: serial, port: {terminal[0]}}}\n")
        listed = "".join(f"  p{number:03d}: {{score: {1 + number}}}\n" for number in range(PICTURES))
        (folder / "observers.yaml").write_text(_OBSERVERS + listed)
        options = SessionOptions(folder / "results", simulate=folder / "observers.yaml", marks=True)
        run_session(experiment, "01", options)
        (file,) = session_files(folder / "results")
        return [mark for trial in read_session(file).trials for mark in trial.details()["timing_marks"]]


def promised() -> dict[str, Any]:
    """Measure, and state what is promised."""
    result = run()
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
    program("timing_marks", promised)
