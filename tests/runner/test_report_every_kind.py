"""A report on sessions of every kind of block, as they are really recorded."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from analysis.errors import ResultsError
from analysis.records import Header, Mark, Note, PooledBatch, SessionLog, Trial
from analysis.report import describe, write_report
from analysis.report.report import KIND_WORDS
from runner.ports import Holding
from runner.presenter import Scene
from runner.protocol import Experiment
from runner.session import Session
from tests.runner import every_kind as EVERY
from tests.runner.every_kind import VARIANTS


@dataclass
class Stage:
    """Shows nothing and keeps the trials."""

    shown: int = 0
    trials: list[Trial] = field(default_factory=list)

    def show(self, scene: Scene) -> float:
        self.shown += 1
        return float(self.shown)

    def prefetch(self, scene: Scene) -> None:
        pass

    def hold(self, scene: Scene, seconds: float) -> Holding:
        return Holding(self.show(scene), round(seconds * 60), 1 / 60)

    def append(self, trial: Trial) -> None:
        self.trials.append(trial)

    def note(self, note: Note) -> None:
        raise AssertionError

    def mark(self, mark: Mark) -> None:
        raise AssertionError

    def pool(self, batch: PooledBatch) -> None:
        pass

    def answers(self) -> Sequence[Trial]:
        return self.trials

    def end(self, facts: Mapping[str, Any]) -> None:
        pass


class Words(HTMLParser):
    """The text of a page outside style."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.text = ""
        self.feed(re.sub(r"<style.*?</style>", "", page, flags=re.DOTALL))

    def handle_data(self, data: str) -> None:
        self.text += data


def log_of(experiment: Experiment, observer: str) -> SessionLog:
    stage = Stage()
    Session(experiment.blocks(observer), stage, EVERY.Fickle(int(observer)), stage).run()
    kept = tuple(Trial(**{**vars_of(trial), "data": json.loads(json.dumps(trial.data))}) for trial in stage.trials)
    stimuli = tuple({"name": name, "factors": {}, "flat": True} for name in "abcdef")
    header = Header("every_kind", observer, "s", "t", 0, "Which?", True, stimuli, {}, {}, {}, {}, {})
    return SessionLog(Path(f"{observer}.jsonl"), header, kept, complete=True)


def vars_of(trial: Trial) -> dict[str, Any]:
    return {name: getattr(trial, name) for name in Trial.__slots__}


# Their reports are much like those of the variants before them.
ALIKE = {("all_pairs", 3), ("all_pairs", 5), ("all_pairs", 6), *(("active_pairs", variant) for variant in (1, 2, 4))}


# All, each with its figures, and by one observer: tests/stress.
@pytest.mark.parametrize(
    ("kind", "variant", "observers"),
    [(*one, count) for one in VARIANTS if one not in ALIKE for count in ((4,) if one[1] else (1, 4))],
)
def test_sessions_of_every_kind_make_a_page_or_a_clear_refusal(
    kind: str, variant: int, observers: int, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """Figures are drawn of the first variant of each, by four observers."""
    if variant or observers == 1:
        request.getfixturevalue("undrawn")
    make_a_page(kind, variant, observers, tmp_path)


def make_a_page(kind: str, variant: int, observers: int, tmp_path: Path) -> None:
    experiment = EVERY.of_kind(kind, variant)
    sessions = [log_of(experiment, f"{number:02d}") for number in range(1, observers + 1)]
    report = write_report(sessions, tmp_path / "report.html", csv_folder=tmp_path / "tables")
    json.dumps(report.to_json(), allow_nan=False)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    words = set(re.findall(r"[a-z]+", Words(page).text.lower()))
    assert not words & {"nan", "none", "inf"}
    assert any((tmp_path / "tables").iterdir())
    scored = {trial.kind for session in sessions for trial in session.trials} & set(KIND_WORDS)
    assert any("the sessions have no comparison" in note for note in report.notes) != bool(scored)


def test_sessions_that_stopped_before_an_answer_are_refused() -> None:
    log = log_of(EVERY.of_kind("instructions", 0), "01")
    assert describe([log]).kinds == ()
    with pytest.raises(ResultsError, match="the results hold no answer"):
        describe([replace(log, complete=False)])
