"""Marks while their reader stalls and pulses end at random moments: what comes out is what was reported as sent."""

from __future__ import annotations

import random
import sys
import threading
import time
from contextlib import closing

import pytest

from documents.platform import pseudo_terminal
from extensions.marks import MarkError, SerialMarksSpec
from tests.kept import known

pytestmark = [
    pytest.mark.stress,
    pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals"),
]


@pytest.mark.parametrize("seed", range(3))
def test_a_reader_that_stalls_gets_what_was_sent_and_nothing_else(seed: int) -> None:
    rng = random.Random(seed)
    got = bytearray()
    over, full = threading.Event(), threading.Event()
    with pseudo_terminal() as pair:
        name, read = known(pair)

        def reader() -> None:
            stalls = random.Random(seed + 100)
            full.wait(60)
            while True:
                piece = read(0.05)
                got.extend(piece)
                if not piece and over.is_set():
                    return
                if stalls.random() < 0.3:
                    time.sleep(stalls.uniform(0.0, 0.1))

        thread = threading.Thread(target=reader)
        thread.start()
        sent, lost = bytearray(), 0
        with closing(SerialMarksSpec(kind="serial", port=name).open_port()) as port:
            for _ in range(150_000):
                code = rng.randint(1, 255)
                try:
                    port.send(code, 0.0)
                    sent.append(code)
                except MarkError:
                    lost += 1
                    full.set()
            over.set()
            thread.join()
    assert lost > 0  # it did stall
    assert got == sent


@pytest.mark.parametrize("pulse_ms", [0.1, 1.0, 5.0])
def test_each_pulse_ends_in_0_unless_a_mark_cuts_it_short(pulse_ms: float) -> None:
    rng = random.Random(1)
    with pseudo_terminal() as pair:
        name, read = known(pair)
        codes, waits_s = [], []
        with closing(SerialMarksSpec(kind="serial", port=name, pulse_ms=pulse_ms).open_port()) as port:
            for _ in range(1500):
                code = rng.randint(1, 255)
                port.send(code, 0.0)
                codes.append(code)
                waits_s.append(rng.uniform(0.0, 2.0 * pulse_ms / 1000.0))
                time.sleep(waits_s[-1])
        got = b""
        while piece := read(0.3):
            got += piece
    assert bytes(code for code in got if code) == bytes(codes)
    assert b"\x00\x00" not in got
    assert got.endswith(b"\x00")
    # Which pulses were cut short depends on the machine; that all of long waits end in 0 does not.
    after = [got[place + 1] for place, code in enumerate(got[:-1]) if code]
    assert after.count(0) >= sum(wait_s > 1.5 * pulse_ms / 1000.0 for wait_s in waits_s[:-1]) * 0.5
