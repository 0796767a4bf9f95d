"""A session opens without reading its pictures: costs are found or come in turn, and its log has them all the same."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from analysis.errors import ResultsError
from analysis.records import FILE_NAME, SessionLog, read_session
from runner.observers import read_observer
from runner.ports import Ask, KeyPress, Observer, WindowClosed
from runner.protocol import Experiment, read_experiment
from runner.session import SessionOptions
from runner.session.clipping_costs import ClippingCosts
from runner.session.folders import to_resume
from runner.session.station import Station
from stimuli.build import StimulusSet, build_set

Study = Any  # tests/conftest.py


def _open(study: Study, **more: Any) -> Station:
    design = read_experiment(study.experiment)
    return Station.open(design, _built(design), SessionOptions(study.results, backend="egl", **more))


def _built(design: Experiment) -> StimulusSet:
    return build_set(design.recipe_file, design.rig.display.panel.pixel_pitch_mm)


def _answering(study: Study, station: Station) -> Observer:
    names = station.stimuli.names
    return station.simulated(read_observer(study.observers, names), "01")


def _run(study: Study, station: Station) -> Path:
    return station.run("01", _answering(study, station), simulated=True) / FILE_NAME


def _lines(file: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in file.read_text().splitlines()]


def _kinds(file: Path) -> list[str]:
    return [line["record"] for line in _lines(file)]


def _costs(log: SessionLog) -> dict[str, Any]:
    return {one.name: one.given().get("clipping") for one in log.header.stimuli}


def _plain(study: Study) -> dict[str, Any]:
    """Return the costs of all stimuli, each picture read and computed."""
    design = read_experiment(study.experiment)
    stimuli = _built(design)
    costs = ClippingCosts.of(design, stimuli, partial(stimuli.load, part=design.visible_part))
    return {name: costs.description(name)["clipping"] for name in stimuli.names}


def _of_two(study: Study) -> None:
    """Let the session show two of the four pictures."""
    study.edit("small.yaml", "{kind: all_pairs, break_every: 4}", "{kind: all_pairs, stimuli: [one, two]}")


def test_nothing_is_read_to_open_and_the_second_time_nothing_for_costs(study: Study) -> None:
    with _open(study) as station:
        assert (station.pictures.read, station.cost_work.clipping_costs_computed) == (0, 0)
        first = _run(study, station)
        assert (station.pictures.read, station.cost_work.clipping_costs_computed) == (4, 4)
    with _open(study) as station:
        # Where it is a first sitting, too, in the same order.
        station.options = replace(station.options, results=study.folder / "elsewhere")
        second = _run(study, station)
        assert station.cost_work.clipping_costs_computed == 0
        assert station.cost_work.clipping_costs_cached == 4
        assert station.pictures.read == station.presenter.counters.decodes == 4  # to be shown
    assert not any("clipping" in one for one in _lines(first)[0]["stimuli"])
    assert all("clipping" in one for one in _lines(second)[0]["stimuli"])
    assert "clipping" not in (*_kinds(first), *_kinds(second))
    logs = read_session(first), read_session(second)
    assert _costs(logs[0]) == _costs(logs[1]) == _plain(study)
    assert [dict(one) for one in logs[0].header.stimuli] == [dict(one) for one in logs[1].header.stimuli]
    for one, other in zip(logs[0].trials, logs[1].trials, strict=True):
        assert one.details().get("clipping") == other.details().get("clipping")


def test_costs_of_what_is_not_shown_follow_before_the_end(study: Study) -> None:
    _of_two(study)
    with _open(study) as station:
        file = _run(study, station)
    assert _kinds(file)[-2:] == ["clipping", "end"]
    assert set(_lines(file)[-2]["stimuli"]) == {"three", "four"}
    assert _lines(file)[-1]["work"]["clipping_costs_computed"] == 4
    assert _costs(read_session(file)) == _plain(study)


class Leaving:
    """Answers some questions, then the window is closed."""

    def __init__(self, answers: Observer, questions: int) -> None:
        self._answers, self._left = answers, questions

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        if not self._left:
            raise WindowClosed
        self._left -= 1
        return self._answers.respond(ask, onset_s)


def _leave(study: Study, questions: int) -> Path:
    with _open(study) as station, pytest.raises(WindowClosed):
        station.run("01", Leaving(_answering(study, station), questions), simulated=True)
    return to_resume(study.results, "small", "01").file


def _resume(study: Study, *, accept_changes: bool = False) -> tuple[Path, Station]:
    stopped = to_resume(study.results, "small", "01")
    with _open(study, accept_changes=accept_changes) as station:
        station.run("01", _answering(study, station), simulated=True, resume=stopped)
    return stopped.file, station


def test_a_session_that_stopped_after_a_trial_is_resumed_to_the_same_costs(study: Study) -> None:
    file = _leave(study, 3)
    assert {name for name, costs in _costs(read_session(file)).items() if costs} == set(
        name for answer in read_session(file).answers for name in answer.details().get("clipping") or ()
    )
    _resume(study)
    assert _costs(read_session(file)) == _plain(study)
    assert "clipping" not in _kinds(file)


def test_what_was_answered_is_not_read_to_resume(study: Study) -> None:
    _of_two(study)
    _leave(study, 1)
    file, station = _resume(study)
    assert _kinds(file)[-2:] == ["clipping", "end"]
    assert _kinds(file).count("resume") == 1
    assert _costs(read_session(file)) == _plain(study)
    assert station.pictures.read == 4
    file.write_text("".join(file.read_text().splitlines(keepends=True)[:-1]))  # killed between the last two lines
    file, station = _resume(study)
    assert station.pictures.read == 0
    assert _kinds(file).count("clipping") == 1
    assert _costs(read_session(file)) == _plain(study)


def test_of_a_picture_that_was_taken_out_since_no_costs_are_said(study: Study) -> None:
    _of_two(study)
    _leave(study, 1)
    study.edit("recipe.yaml", "  - {name: four, file: four.exr}\n", "")
    study.edit("observers.yaml", "  four: {score: 4}\n", "")
    file, _ = _resume(study, accept_changes=True)
    assert _kinds(file)[-2:] == ["clipping", "end"]
    assert {name: costs is not None for name, costs in _costs(read_session(file)).items()} == {
        "one": True,
        "two": True,
        "three": True,
        "four": False,
    }


def _changed(line: dict[str, Any], stimulus: str) -> dict[str, Any]:
    other: dict[str, Any] = json.loads(json.dumps(line))
    key = "stimuli" if line["record"] == "clipping" else "clipping"
    other[key][stimulus]["left"]["percent_any"] += 1e-3
    return other


def test_costs_that_contradict_what_was_said_before_are_refused(study: Study, unchained: Any) -> None:
    with _open(study) as station:
        file = _run(study, station)
    unchained(file)
    lines = _lines(file)
    shown = [number for number, line in enumerate(lines) if "one" in (line.get("clipping") or ())]
    lines[shown[1]] = _changed(lines[shown[1]], "one")
    file.write_text("".join(json.dumps(line) + "\n" for line in lines))
    with pytest.raises(ResultsError, match="the clipping of 'one' is another"):
        read_session(file)


@pytest.mark.parametrize("wrong", ["another", "unknown", "no number"])
def test_a_line_of_costs_that_does_not_fit_is_refused(study: Study, unchained: Any, wrong: str) -> None:
    _of_two(study)
    with _open(study) as station:
        file = _run(study, station)
    unchained(file)
    lines = _lines(file)
    costs = lines[-2]["stimuli"]
    if wrong == "another":
        shown = next(line["clipping"] for line in lines if "clipping" in line)
        costs["one"] = _changed({"record": "clipping", "stimuli": shown}, "one")["stimuli"]["one"]
    elif wrong == "unknown":
        costs["five"] = costs["four"]
    else:
        costs["four"] = {**costs["four"], "left": {"percent_any": "many"}}
    file.write_text("".join(json.dumps(line) + "\n" for line in lines))
    said = {"another": "of 'one' is another", "unknown": "'five', which is no stimulus", "no number": "percent_any"}
    with pytest.raises(ResultsError, match=said[wrong]):
        read_session(file)
