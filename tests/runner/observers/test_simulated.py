"""Simulated observers: what they were given comes back out of their answers, and they finish every task."""

from __future__ import annotations

import math
import random
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from runner import Scene
from runner.errors import SessionError
from runner.observers import BradleyTerryObserver
from runner.observers.behaviour import BehaviourSpec, FatigueSpec, PsychometricSpec, TiesSpec
from runner.ports import Ask, Browse, Choose, Compare, Rate, Write

SCORES = {"a": 0.5, "b": 1.0, "c": 2.0, "d": 6.0}
PAIR = {"up": "first", "down": "second"}
RELAXED = {**PAIR, "n": "no_difference", "u": "not_sure"}


def _observer(seed: int = 3, scores: dict[str, float] | None = None, **behaviour: object) -> BradleyTerryObserver:
    return BradleyTerryObserver(scores or SCORES, random.Random(seed), 2.0, BehaviourSpec(**behaviour))


def _answers(observer: BradleyTerryObserver, ask: Ask, times: int) -> list[str]:
    return [ask.meaning(observer.respond(ask, 0.0).key) or "" for _ in range(times)]


def _compare(first: str, second: str, keys: dict[str, str] = PAIR) -> Ask:
    return Ask(Scene(), keys, task=Compare(first, second))


def _within(count: int, of: int, probability: float) -> bool:
    """Four standard errors: a right law fails once in sixteen thousand seeds, and the seed is fixed."""
    return abs(count - of * probability) <= 4 * math.sqrt(of * probability * (1 - probability))


def test_position_bias_comes_back_as_an_order_effect() -> None:
    observer = _observer(position_bias=0.6)
    first = _answers(observer, _compare("b", "b"), 4000).count("first")
    assert _within(first, 4000, 1 / (1 + math.exp(-0.6)))
    assert not _within(first, 4000, 0.5)
    assert _within(_answers(observer, _compare("c", "a"), 4000).count("first"), 4000, 1 / (1 + math.exp(-0.6) / 4))


def test_lapses_come_as_often_as_stated() -> None:
    """Of a pair that leaves no doubt, half of the lapses, and nothing else, are wrong."""
    wrong = _answers(_observer(scores={"a": 1e9, "b": 1.0}, lapse_rate=0.2), _compare("a", "b"), 5000).count("second")
    assert _within(wrong, 5000, 0.1)


def test_fatigue_makes_more_lapses_later() -> None:
    fatigue = FatigueSpec(over_trials=2000, lapse_rate=0.5)
    answers = _answers(_observer(scores={"a": 1e9, "b": 1.0}, fatigue=fatigue), _compare("a", "b"), 6000)
    assert _within(answers[:2000].count("second"), 2000, 0.125)
    assert _within(answers[2000:].count("second"), 4000, 0.25)


def test_ties_follow_davidsons_law_where_they_may_be_answered() -> None:
    ties = TiesSpec(width=0.8, not_sure_share=0.25)
    told = Counter(_answers(_observer(ties=ties), _compare("c", "b", RELAXED), 6000))
    tie = 0.8 * math.sqrt(2)
    total = 3 + tie
    assert _within(told["first"], 6000, 2 / total)
    assert _within(told["second"], 6000, 1 / total)
    assert _within(told["no_difference"], 6000, 0.75 * tie / total)
    assert _within(told["not_sure"], 6000, 0.25 * tie / total)
    forced = Counter(_answers(_observer(ties=ties), _compare("c", "b"), 4000))
    assert set(forced) == {"first", "second"}
    assert _within(forced["first"], 4000, 2 / 3)


def _leaf(observer: BradleyTerryObserver, series: tuple[str, ...], start: int) -> tuple[str, frozenset[int]]:
    """Let the observer leaf through a series and return its choice and what it had seen by then."""
    index, seen = start, frozenset({start})
    for _ in range(100):
        keys = {"left": "previous", "right": "next"}
        if len(seen) == len(series):
            keys["enter"] = "choose"
        ask = Ask(Scene(), keys, task=Browse(series, index, seen))
        meaning = ask.meaning(observer.respond(ask, 0.0).key)
        if meaning == "choose":
            return series[index], seen
        index += 1 if meaning == "next" else -1
        assert 0 <= index < len(series)
        seen |= {index}
    raise AssertionError("never chose")


def test_a_series_is_seen_whole_and_chosen_from_by_luces_law() -> None:
    observer, names = _observer(), tuple(SCORES)
    chosen: Counter[str] = Counter()
    for turn in range(3000):
        choice, seen = _leaf(observer, names, turn % 4)
        assert len(seen) == 4
        chosen[choice] += 1
    for name, score in SCORES.items():
        assert _within(chosen[name], 3000, score / 9.5)


def _number(observer: BradleyTerryObserver, task: Rate, keys: dict[str, str]) -> int:
    """Let the observer move a marker until it accepts."""
    for _ in range(300):
        more = {"enter": "accept"} if task.current is not None else {}
        ask = Ask(Scene(), {**keys, **more}, task=task)
        meaning = ask.meaning(observer.respond(ask, 0.0).key)
        if meaning == "accept":
            assert task.current is not None
            return task.current
        middle = (task.lowest + task.highest) // 2
        if meaning in ("lower", "higher"):
            step = 1 if meaning == "higher" else -1
            to = middle if task.current is None else min(task.highest, max(task.lowest, task.current + step))
        else:
            to = int(meaning or "")
        task = replace(task, current=to)
    raise AssertionError("never accepted")


ARROWS = {"left": "lower", "right": "higher"}
NUMBERS = {**{str(number): str(number) for number in range(1, 10)}, "0": "10", **ARROWS}


@pytest.mark.parametrize("keys", [ARROWS, NUMBERS])
def test_similarity_follows_the_log_score(keys: dict[str, str]) -> None:
    observer = _observer(rating_noise=0.0)
    found = {name: _number(observer, Rate("similarity", 1, 10, name), keys) for name in SCORES}
    places = {name: (math.log(score) - math.log(0.5)) / math.log(12) for name, score in SCORES.items()}
    assert found == {name: round(1 + 9 * place) for name, place in places.items()}
    assert (found["a"], found["d"]) == (1, 10)
    assert _number(observer, Rate("similarity", 0, 100, "b"), keys if keys is ARROWS else ARROWS) == round(
        100 * places["b"]
    )


def test_ratings_scatter_as_stated() -> None:
    observer = _observer(rating_noise=0.05)
    found = [_number(observer, Rate("similarity", 0, 100, "b"), ARROWS) for _ in range(300)]
    assert np.std(found) == pytest.approx(5, rel=0.2)
    assert np.mean(found) == pytest.approx(100 * math.log(2) / math.log(12), abs=1.5)


def test_a_choice_among_equals_is_rated_more_difficult() -> None:
    alike = _observer(scores=dict.fromkeys(SCORES, 1.0), rating_noise=0.0)
    apart = _observer(scores={"a": 1.0, "b": 1e9, "c": 1.0, "d": 1.0}, rating_noise=0.0)
    for observer, number in ((alike, 10), (apart, 1)):
        _leaf(observer, tuple(SCORES), 2)
        assert _number(observer, Rate("difficulty", 1, 10), NUMBERS) == number


def _choose(strength: float | None, correct: str | None = "left") -> Ask:
    options = ("left", "right", "up", "down")
    return Ask(Scene(), {option: option for option in options}, task=Choose("acuity", options, correct, strength))


def test_right_answers_follow_the_psychometric_function() -> None:
    observer = _observer(psychometric={"acuity": PsychometricSpec(threshold=60, slope=2)})
    for strength in (20.0, 60.0, 200.0):
        right = _answers(observer, _choose(strength), 3000).count("left")
        assert _within(right, 3000, 0.25 + 0.75 / (1 + (60 / strength) ** 2))
    assert _answers(observer, _choose(None), 50).count("left") == 50
    assert _answers(_observer(), _choose(0.1), 50).count("left") == 50


def test_pages_and_questions_are_got_on_with() -> None:
    observer = _observer()
    assert _answers(observer, Ask(Scene(), {"space": "continue"}), 1) == ["continue"]
    asked = Ask(Scene(), {"backspace": "erase"}, task=Write("age", number=True), typing=True)
    assert _answers(observer, asked, 1) == ["text 1"]
    typed = Ask(Scene(), {"backspace": "erase", "enter": "accept"}, task=Write("age", "1", True), typing=True)
    assert _answers(observer, typed, 1) == ["accept"]


def test_a_stimulus_without_a_score_is_refused_by_name() -> None:
    with pytest.raises(SessionError, match="'e', for which it has no score"):
        _observer().respond(_compare("a", "e"), 0.0)


def test_log_scores_may_be_as_far_apart_as_they_like() -> None:
    rng = random.Random(1)
    observer = BradleyTerryObserver.by_log_scores({"a": -5000.0, "b": -5001.0, "c": 0.0}, rng, BehaviourSpec())
    first = _answers(observer, _compare("a", "b"), 4000).count("first")
    assert _within(first, 4000, 1 / (1 + math.exp(-1)))
    assert _answers(observer, _compare("a", "c"), 100).count("second") == 100
