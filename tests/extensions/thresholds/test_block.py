"""Thresholds as a block: levels that follow the answers, interleaved tracks, known thresholds that come back."""

from __future__ import annotations

import json
import random
from collections import Counter
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from analysis.records import new_header, read_session
from extensions.thresholds import Easier, QuestionSummary, QuestPlus, Staircase, summarise_thresholds
from extensions.thresholds.ladders import ladders
from runner.blocks import Block, Stimuli
from runner.check import CheckOptions, check_file
from runner.observers import BradleyTerryObserver, key_for, plain_key
from runner.observers.behaviour import BehaviourSpec, PsychometricSpec
from runner.ports import Ask, Choose
from tests.answers import changed
from tests.runner.every_kind import entry, met, setting

Play = Callable[..., Any]
Study = Any  # tests/conftest.py
LEVELS = tuple(round(float(level), 4) for level in np.geomspace(0.01, 1, 15))
FACTORS = {"blank": {"contrast": 0.0}} | {f"c{n:02d}": {"contrast": level} for n, level in enumerate(LEVELS)}
KNOWN = Stimuli(FACTORS)
PLACES: dict[str, Any] = {"factor": "contrast", "task": "two_places", "reference": "blank", "trials": 12}
YES_NO: dict[str, Any] = {"task": "yes_no"}
STAIRS: dict[str, Any] = {"method": {"kind": "staircase", "start": ["above", "below"]}}
SCENES = Stimuli(
    {f"{name}-{scene}": {**levels, "scene": scene} for name, levels in FACTORS.items() for scene in ("x", "y")}
)


def block(stimuli: Stimuli = KNOWN, **keys: Any) -> Block:
    return met("threshold", setting(stimuli), **PLACES | keys)


BLOCKS = {
    "places": block(),
    "intervals": block(task="two_intervals", exposure_s=0.5, blank_between_s=0.2, **STAIRS),
    "yes or no": block(catch_share=5 / 29, break_every=4, **YES_NO, **STAIRS),
    "two scenes": block(SCENES, reference={"x": "blank-x", "y": "blank-y"}, within="scene", function="normal"),
}


def detects(threshold: float, slope: float = 8.0, seed: int = 1, guess: float | None = None) -> Callable[[Ask], str]:
    """Return a simulated observer of known threshold and slope."""
    seen = PsychometricSpec(threshold=threshold, slope=slope, guess=guess)
    observer = BradleyTerryObserver(
        {"blank": 1.0}, random.Random(seed), behaviour=BehaviourSpec(psychometric={"contrast": seen})
    )
    return lambda ask: observer.respond(ask, 0.0).key


@pytest.mark.parametrize("name", BLOCKS)
def test_it_keeps_what_every_block_promises(promised: Play, name: str) -> None:
    whole = promised(BLOCKS[name], "threshold", lambda: detects(0.1))
    asked = [ask for ask in whole.asks if isinstance(ask.task, Choose)]
    for ask, trial in zip(asked, whole.trials, strict=True):
        assert set(ask.targets) == set(ask.keys.values()) == set(ask.task.options)
        assert ask.task.strength == trial.details()["level"]
        if name != "intervals":
            assert trial.details()["stimulus"] in ask.scene.stimuli
        if name == "yes or no":
            assert "correct" not in trial.details()
        else:
            assert trial.details()["correct"] == (trial.details()["answer"] == trial.details()["correct_answer"])


@pytest.mark.parametrize("name", BLOCKS)
def test_what_may_come_next_is_made_ready(play: Play, name: str) -> None:
    """Whatever is answered, the pictures of the next trial were among those made ready before the answer."""
    whole = play(BLOCKS[name], detects(0.1))
    ready = [set(scene.stimuli) for scene in whole.prefetched]
    after = [trial.details()["stimulus"] for trial in whole.trials[1:]]
    asks = [ask for ask in whole.asks if isinstance(ask.task, Choose)]
    assert all(name in set(ask.upcoming.stimuli) for ask, name in zip(asks[:-1], after, strict=True) if ask.upcoming)
    assert sum(ask.upcoming is not None for ask in asks) == BLOCKS[name].trials - 1 <= len(ready)
    assert max(map(len, ready)) <= 3  # two levels at most, and the reference


def _levels(trials: Any, track: int) -> list[int]:
    return [LEVELS.index(trial.details()["level"]) for trial in trials if trial.details().get("track") == track]


def test_staircases_move_by_their_rule(play: Play) -> None:
    """The slow twin: each track's levels from its own answers alone."""
    trials = play(block(trials=30, **STAIRS), detects(0.1)).trials
    assert _levels(trials, 0)[0] == 11  # a quarter from the easiest
    assert _levels(trials, 1)[0] == 3
    for track in (0, 1):
        own = [trial.details() for trial in trials if trial.details()["track"] == track]
        stairs = Staircase(len(LEVELS), LEVELS.index(own[0]["level"]), 3, 1)
        for number, data in enumerate(own):
            assert data["track_trial"] == number
            assert LEVELS.index(data["level"]) == stairs.next_level()
            stairs.learn(stairs.next_level(), right=data["correct"])


@pytest.mark.parametrize("easier", ["higher", "lower"])
def test_quest_plus_asks_at_the_levels_of_its_twin(play: Play, easier: Easier) -> None:
    levels = LEVELS if easier == "higher" else LEVELS[::-1]
    trials = play(block(easier=easier, trials=20), detects(0.1, 8.0 if easier == "higher" else -8.0)).trials
    axis = np.log10(levels) * (1 if easier == "higher" else -1)
    quest = QuestPlus.standard(axis)
    for trial in trials:
        assert trial.details()["level"] == levels[quest.next_level()]
        quest.learn(quest.next_level(), right=trial.details()["correct"])
    at = float(10 ** (quest.median[0] * (1 if easier == "higher" else -1)))
    assert 0.04 < at < 0.25


def test_tracks_take_turns_and_sides_are_balanced(play: Play) -> None:
    trials = play(block(trials=20, method={"kind": "quest_plus", "tracks": 3}), detects(0.1)).trials
    turns = [trial.details()["track"] for trial in trials]
    assert all(sorted(turns[start : start + 3]) == [0, 1, 2] for start in range(0, 60, 3))
    assert len({tuple(turns[start : start + 3]) for start in range(0, 60, 3)}) > 3
    for track in range(3):
        sides = [t.details()["correct_answer"] for t in trials if t.details()["track"] == track]
        assert Counter(sides) == {"first": 10, "second": 10}
        assert sum(one != other for one, other in pairwise(sides)) > 4  # not all of one side first
    assert max(Counter(trial.details()["correct_answer"] for trial in trials).values()) == 30


def test_of_an_odd_number_the_stimulus_stands_first_once_more(play: Play) -> None:
    trials = play(block(trials=5), plain_key).trials
    assert Counter(trial.details()["correct_answer"] for trial in trials) == {"first": 3, "second": 2}


def test_two_intervals_take_twice_the_exposure_and_the_blank_between() -> None:
    one = block(exposure_s=0.5, fixation_s=0.25)
    two = block(task="two_intervals", exposure_s=0.5, fixation_s=0.25, blank_between_s=0.125)
    assert (two.expected_s - one.expected_s) / one.trials == pytest.approx(0.5 + 0.125)


def test_trials_without_a_signal_take_turns_among_the_ladders(play: Play) -> None:
    both = block(
        SCENES, reference={"x": "blank-x", "y": "blank-y"}, within="scene", catch_share=0.2, trials=8, **YES_NO
    )
    shown = [trial.details()["stimulus"] for trial in play(both, plain_key).trials if trial.details()["level"] is None]
    assert shown == ["blank-x", "blank-y"] * (len(shown) // 2)
    assert shown


def test_catch_trials_are_spread_and_move_no_track(play: Play) -> None:
    trials = play(block(trials=40, catch_share=10 / 90, **YES_NO, **STAIRS), lambda ask: key_for(ask, "yes")).trials
    blanks = [number for number, trial in enumerate(trials) if trial.details()["level"] is None]
    assert len(trials) == 90
    assert [number * 10 // 90 for number in blanks] == list(range(10))
    assert blanks[0] > 0
    assert {trials[number].details()["stimulus"] for number in blanks} == {"blank"}
    assert _levels(trials, 0)[-1] == 0  # always yes: the weakest, whatever the blanks


def test_several_stimuli_of_one_level_are_drawn_by_chance(play: Play) -> None:
    twice = Stimuli(FACTORS | {f"{name}b": factors for name, factors in FACTORS.items() if name != "blank"})
    names = [trial.details()["stimulus"] for trial in play(block(twice), plain_key).trials]
    assert 0 < sum(name.endswith("b") for name in names) < len(names)


LONG: dict[str, Any] = {"function": "logistic", "trials": 250}
CASES = {
    "places": (block(**LONG), 0.1, 8.0, None),
    "stairs": (block(**LONG | {"trials": 125}, **STAIRS), 0.1, 8.0, None),
    "lower": (block(easier="lower", **LONG), 0.1, -8.0, None),
    "yes": (block(catch_share=60 / 310, **YES_NO, **LONG), 0.1, 8.0, 0.08),
}


def _summary(block: Block, press: Callable[[Ask], str], play: Play, folder: Path) -> QuestionSummary:
    """Play a block, write its log, read it again and return what came of its only question."""
    stimuli = tuple({"name": name, "factors": factors} for name, factors in FACTORS.items())
    header = new_header("e", "01", "s", "2026-01-01T00:00:00Z", simulated=True, stimuli=stimuli)
    utc = "2026-01-01T00:00:01.000+00:00"
    trials = [changed(trial, utc=utc) for trial in play(block, press).trials]
    file = folder / "session.jsonl"
    file.write_text(
        "".join(json.dumps(line) + "\n" for line in [header.to_json(), *(trial.to_json() for trial in trials)])
    )
    (question,) = summarise_thresholds([read_session(file)]).questions
    return question


@pytest.mark.promise("one-engine")
@pytest.mark.parametrize("case", CASES)
def test_known_thresholds_come_back(play: Play, case: str, tmp_path: Path) -> None:
    """The observers' law is logistic in natural logarithms, the fit's axis is in decimal ones."""
    made, threshold, slope, guess = CASES[case]
    question = _summary(made, detects(threshold, slope, seed=3, guess=guess), play, tmp_path)
    (each,) = question.observers
    fit = each.fit
    assert question.trials == made.trials
    assert fit.threshold_interval is not None
    assert fit.slope_interval is not None
    low, high = fit.threshold_interval
    assert low / 1.15 < threshold < high * 1.15
    assert high / low < 2
    low, high = fit.slope_interval
    assert low / 1.5 < abs(slope) * np.log(10) < high * 1.5
    if guess is not None:
        assert fit.guess == pytest.approx(guess, abs=0.05)
        assert fit.blanks[1] == 60


def test_answers_that_tell_nothing_have_a_reason_in_place_of_a_number(play: Play, tmp_path: Path) -> None:
    question = _summary(block(**STAIRS), plain_key, play, tmp_path)
    (each,) = question.observers
    assert each.fit.threshold is None
    assert each.fit.reason.startswith("all answers are right")
    assert question.threshold.value is None
    assert question.threshold.observers == 0


def _faults(factors: dict[str, Any] = FACTORS, **keys: Any) -> list[str]:
    """Return the faults of a block on stimuli with such factors, as "place: message"."""
    known = {"kind": "threshold", "factor": "contrast", "task": "two_places", "reference": "blank", "trials": 10}
    spec = entry(**{**known, **keys})
    return [f"{'.'.join(map(str, fault.path))}: {fault.message}" for fault in spec.faults(Stimuli(factors))]


STAIRCASE = {"kind": "staircase"}


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ({}, []),
        ({"task": "yes_no", "reference": None}, []),
        ({"method": {**STAIRCASE, "start": ["above", "below", LEVELS[4]]}}, []),
        ({"factor": "contrst"}, ["factor: the stimuli have no factor 'contrst'"]),
        ({"reference": "blnk"}, ["reference: the recipe makes no stimulus 'blnk'"]),
        ({"reference": None}, ["reference: there is no reference to compare with"]),
        ({"stimuli": ["c00", "c01"]}, ["factor: 'contrast' has 2 levels, too few for a threshold"]),
        (
            {"stimuli": ["c00", "c01", "c02", "blank"]},
            ["stimuli.3: 'blank' is the reference, and cannot be at a level too"],
        ),
        (
            {"stimuli": ["c00", "c01", "c02"], "method": STAIRCASE},
            ["method: a staircase that moves 3 up and 1 down needs 5 levels, and there are 3"],
        ),
        (
            {"method": {**STAIRCASE, "start": [LEVELS[-1]]}},
            ["method.start.0: the staircase starts at 1, which has no easier level"],
        ),
        (
            {"method": {**STAIRCASE, "start": [LEVELS[0]]}},
            ["method.start.0: the staircase starts at 0.01, which has no harder level"],
        ),
        ({"method": {**STAIRCASE, "start": [0.3333]}}, ["method.start.0: there is no level 0.3333"]),
        ({"within": "scene"}, ["within: the stimuli have no factor 'scene'"]),
    ],
)
def test_wrong_blocks_have_one_fault_at_its_place(keys: dict[str, Any], told: list[str]) -> None:
    assert _faults(**keys) == told


def test_a_factor_of_words_is_no_number() -> None:
    factors: dict[str, dict[str, str | float]] = {
        name: {"scene": "beach", "codec": number} for number, name in enumerate("abcd")
    }
    assert _faults(factors, factor="scene", reference="a") == [
        "factor: the factor 'scene' is no number: it is 'beach' for 'b'"
    ]
    spec = entry("threshold", factor="scene", task="yes_no", trials=9)
    (fault,) = spec.faults(Stimuli(factors))
    assert fault.remedy == "name a factor of numbers: codec"


def test_each_scene_has_a_ladder_and_a_reference_of_its_own() -> None:
    factors = {f"{scene}{n}": {"scene": scene, "level": n} for scene in ("beach", "church") for n in range(5)}
    references = {"beach": "beach0", "church": "church0"}
    made = ladders("all", Stimuli(factors), "level", "scene", references, "lower")
    assert [(ladder.group, ladder.reference, ladder.levels) for ladder in made] == [
        ("beach", "beach0", (4, 3, 2, 1)),
        ("church", "church0", (4, 3, 2, 1)),
    ]
    keys = {"factor": "level", "within": "scene"}
    assert _faults(factors, **keys, reference=references) == []
    assert _faults(factors, **keys, reference={"beach": "beach0"}) == [
        "reference: there is no reference to compare with in the scene 'church'"
    ]
    assert _faults(factors, **keys, reference={**references, "harbour": "beach0"}) == [
        "reference.harbour: no stimulus has the scene 'harbour'"
    ]


@pytest.mark.parametrize(
    "wrong",
    [
        {"task": "two_intervals"},
        {"task": "two_places", "catch_share": 0.2},
        {"task": "two_places", "blank_between_s": 0.2},
        {"task": "two_places", "reference": {"beach": "a"}},
        {"task": "yes_no", "function": "step"},
        {"task": "yes_no", "method": {"kind": "staircase", "start": []}},
    ],
)
def test_keys_that_do_not_go_together_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        entry("threshold", **{"factor": "contrast", "trials": 9, **wrong})


def test_a_level_of_zero_is_warned_of_where_others_have_logarithms(study: Study) -> None:
    block = "  - {kind: threshold, factor: contrast, task: yes_no, stimuli: [one, two, three], trials: 3}\n"
    study.edit("small.yaml", "  - {kind: all_pairs, break_every: 4}\n", block)
    for level, name in enumerate(("one", "two", "three")):
        study.edit("recipe.yaml", f"{name}.exr}}", f"{name}.exr, factors: {{contrast: {level}}}}}")
    options = CheckOptions(results=study.results, screen=False)
    (found,) = [each for each in check_file(study.experiment, options).warnings if "level 0" in each.message]
    assert (found.line, "reference" in str(found.remedy)) == (
        study.experiment.read_text().split(block)[0].count("\n") + 1,
        True,
    )
    study.edit("recipe.yaml", "contrast: 0}", "contrast: 3}")
    assert not [each for each in check_file(study.experiment, options).warnings if "level 0" in each.message]
