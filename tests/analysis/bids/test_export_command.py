"""`cyclopean export`: what it says, and how it ends."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from typing import Any

from analysis.records import Note

Lab = Any  # conftest.py
Cyclopean = Callable[..., subprocess.CompletedProcess[str]]  # tests/conftest.py


def test_it_says_what_it_wrote(lab: Lab, cyclopean: Cyclopean) -> None:
    note = Note(text="tired", by="observer", block=0, trial=1, utc="2026-01-02T03:04:05Z")
    lab.session([lab.pair(0), note])
    copy = lab.session([lab.pair(0), note], station="other")
    told = cyclopean("export", lab.folder / "results", lab.folder / "other", "-o", lab.folder / "bids").stdout
    assert "1 session of 1 participant, 1 trial" in told
    assert f"note: {copy} is a copy of" in told
    assert "1 note in free text is" in told


def test_simulated_sessions_beside_a_person_s_are_told(lab: Lab, cyclopean: Cyclopean) -> None:
    lab.session()
    words = ("export", lab.folder / "results", "-o", lab.folder / "bids")
    assert "note: all sessions are of simulated" in cyclopean(*words).stdout
    lab.session(session="20260103T030405abcd", simulated=False)
    done = json.loads(cyclopean(*words, "--json").stdout)
    assert (done["sessions"], done["simulated"], done["simulated_left_out"]) == (1, 0, 1)
    told = cyclopean(*words, "--with-simulated").stdout
    assert "note: 1 of 2 sessions is simulated" in told
    assert "share the code 01" in told
    lab.session(simulated=False)
    assert "are simulated" not in cyclopean(*words, "--with-simulated").stdout


def test_wrong_input_ends_with_2_and_writes_nothing(lab: Lab, cyclopean: Cyclopean) -> None:
    told = cyclopean("export", lab.folder / "nowhere", "-o", lab.folder / "bids", expect=2)
    assert "there is no such folder" in told.stderr
    assert not (lab.folder / "bids").exists()


def test_a_place_that_cannot_be_written_ends_with_1(lab: Lab, cyclopean: Cyclopean) -> None:
    lab.session()
    (lab.folder / "file").write_text("")
    told = cyclopean("export", lab.folder / "results", "-o", lab.folder / "file" / "bids", expect=1)
    assert "cannot be written" in told.stderr
