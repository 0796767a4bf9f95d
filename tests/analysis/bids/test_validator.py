"""The official BIDS validator on what the export writes."""

from __future__ import annotations

import json
import os
import shutil
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from analysis.bids import About, export_dataset
from analysis.records import Change, Mark, Note, Resumption

Lab = Any  # conftest.py
Issues = Callable[[Path], list[dict[str, Any]]]
ABOUT = About("Car paints", ("A. Author", "B. Author"), "CC0")
# docs/bids.md says of each why it is left.
WARNED = {
    ("JSON_KEY_RECOMMENDED", "HEDVersion"),
    ("SIDECAR_KEY_RECOMMENDED", "Instructions"),
    ("SIDECAR_KEY_RECOMMENDED", "CogAtlasID"),
    ("SIDECAR_KEY_RECOMMENDED", "CogPOID"),
    ("SIDECAR_KEY_RECOMMENDED", "InstitutionName"),
    ("SIDECAR_KEY_RECOMMENDED", "InstitutionAddress"),
    ("SIDECAR_KEY_RECOMMENDED", "InstitutionalDepartmentName"),
}
HOSTILE = (
    "a\tb\nc\r\nd",
    "\u202eright to left\u2066",
    "n/a",
    "",
    " ",
    "=cmd|' /C calc'!A0",
    '"open quote',
    "<script>alert(1)</script>",
    "\x00\x1b[31m\x7f\x85\u2028\u2029\ufeff",
    "back\\slash\\t",
    "é" * 3000,
    "\U0001f469\u200d\U0001f52c \U000e0041",
)


def check(issues: list[dict[str, Any]]) -> None:
    """No error, and no warning that the documentation does not name."""
    errors = [issue for issue in issues if issue["severity"] == "error"]
    assert not errors, json.dumps(errors[:5], indent=1)
    warned = {(issue["code"], issue.get("subCode", "")) for issue in issues if issue["severity"] == "warning"}
    assert warned <= WARNED


def _kinds(lab: Lab, text: str) -> list[Any]:
    """A trial of each kind, as the runner may record it, with words from people in it."""
    words = text or "none"
    rated = {"ratings": {words: 4}, "rating_times_s": {words: 0.5}}
    data: dict[str, dict[str, Any]] = {
        "instructions": {},
        "break": {"text": text},
        "best_of_series": {
            "series": words,
            "stimuli": ["one", "two", "three"],
            "start": 1,
            "chosen": "two",
            "chosen_index": 1,
            "path": [[1, 0.5]],
            "dwell_s": [0.0, 0.5, 0.0],
            "ratings": {},
            "rating_times_s": {},
        },
        "rating": {"stimulus": "one", **rated, "scale": {"low": text, "high": "glossy"}},
        "questionnaire": {"name": words, "question": text, "answer": text, "answered_by": "choice", "comment": text},
        "preference": {
            "answer": "second",
            "first": "one",
            "second": "two",
            "chosen": "two",
            "rejected": "one",
            "chosen_view": "flat",
            "first_view": "stereo",
            "stim_file": "x.exr",
        },
        "screening": {
            "test": words,
            "series": words,
            "level": 40.0,
            "unit": text,
            "presentation": 0,
            "correct_answer": "up",
            "answer": "up",
            "correct": True,
            "passed": False,
            "HED": "Event",
        },
        "active_pairs": {
            "first": "one",
            "second": "two",
            "answer": "not_sure",
            "batch": 0,
            "expected_information_bits": 0.25,
        },
        "threshold": {
            "task": "two_places",
            "factor": words,
            "stimulus": "one",
            "level": 0.5,
            "answer": "first",
            "method": "quest_plus",
            "function": "weibull",
            "easier": "higher",
            "reference": "two",
            "first_position": "top",
            "correct_answer": "first",
            "correct": True,
            "track": 0,
            "track_trial": 0,
            "group": words,
            "group_factor": words,
        },
        "practice": {
            "practice_of": "rating",
            "stimulus": "one",
            **rated,
            words: text,
            "duration": -1,
            "practice": True,
            "age": "old",
        },
    }
    return [lab.trial(kind, fields, block=n) for n, (kind, fields) in enumerate(data.items())]


@pytest.mark.nightly
def test_every_kind_of_trial_with_hostile_words_passes(lab: Lab, bids_issues: Issues) -> None:
    for number, text in enumerate(HOSTILE):
        records = [
            *_kinds(lab, text),
            lab.pair(20, block=10, trial=0),
            lab.pair(21, block=10, trial=1),
            Note(text=text, by="observer", block=10, trial=1, utc="2026-01-02T03:04:22Z"),
            Note(text=text, by="experimenter", block=10, trial=2, utc="2026-01-02T03:04:22.500+00:00"),
            Mark(block=10, trial=0, by="observer", utc="2026-01-02T03:04:23Z"),
            Resumption(utc="2026-01-02T03:08:00Z", accepted_changes={"rig": Change(before=text, now=None)}),
        ]
        words = {"question": text, "remarks": (text,), "analysis": {text: text}}
        lab.session(records, observer=f"{number:02d}", session=f"s{number}", complete=number % 2 == 0, **words)
    done = export_dataset([lab.folder / "results"], lab.folder / "bids", ABOUT)
    assert done.sessions == len(HOSTILE)
    check(bids_issues(done.folder))


@pytest.mark.nightly
def test_two_experiments_from_two_stations_pass(lab: Lab, bids_issues: Issues) -> None:
    for station, experiment in (("a", "dynamic_range"), ("b", "gloss-2")):
        for number in range(3):
            lab.session(station=station, experiment=experiment, observer=f"{number}", session=f"{station}{number}")
    shutil.copytree(lab.folder / "a", lab.folder / "copy of a")
    done = export_dataset([lab.folder / "a", lab.folder / "b", lab.folder / "copy of a"], lab.folder / "bids", ABOUT)
    assert (done.sessions, len(done.copies)) == (6, 3)
    check(bids_issues(done.folder))


@pytest.mark.nightly
def test_simulated_observers_pass(study: Any, bids_issues: Issues) -> None:
    """Sessions that the runner recorded, through the command line."""
    for observer in ("01", "02"):
        simulated = ("--simulate", study.observers, "--results", study.results, "--json")
        study.cyclopean("run", study.experiment, "--observer", observer, *simulated)
    folder = study.folder / "bids"
    names = ("--author", "A. Author", "--author", "B. Author", "--license", "CC0")
    study.cyclopean("export", study.results, "-o", folder, *names)
    check(bids_issues(folder))
    tables = sorted(folder.glob("sub-*/ses-*/beh/*_beh.tsv"))
    assert len(tables) == 2
    kinds = Counter(line.split("\t")[4] for line in tables[0].read_text().splitlines()[1:])
    assert kinds["all_pairs"] == 6


@pytest.mark.nightly
def test_the_validator_does_find_faults(lab: Lab, bids_issues: Issues) -> None:
    """The oracle is awake: what is spoilt on purpose is told."""
    lab.session()
    folder = export_dataset([lab.folder / "results"], lab.folder / "bids", ABOUT).folder
    (file,) = folder.glob("sub-*/ses-*/beh/*_beh.tsv")
    file.write_text(file.read_text().replace("1.25", "soon"))
    os.rename(file.with_suffix(".json"), file.with_name("notes.json"))
    codes = {issue["code"] for issue in bids_issues(folder) if issue["severity"] == "error"}
    assert {"TSV_VALUE_INCORRECT_TYPE", "NOT_INCLUDED"} <= codes
