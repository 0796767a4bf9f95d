"""All pairs at once and in sequence, with ties, catch trials and ratings: screens, answers, records, replay."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from pydantic import ValidationError

from runner import Picture
from runner.blocks import Block, BlockContext, Stimuli
from runner.observers import key_for, plain_key
from runner.ports import Ask, Compare, Rate
from runner.scene import Text
from tests.runner.blocks.conftest import at_random
from tests.runner.every_kind import entry, met, setting

Play = Callable[..., Any]
NAMES = ("a", "b", "c", "d", "e")
PLACE = setting(NAMES, size_mm=(50, 40))
ROW = setting(NAMES, arrangement="horizontal", size_mm=(50, 40))
COLUMN = setting(NAMES, size_mm=(50, 40))
WITH_REFERENCE = setting(Stimuli({name: {} for name in (*NAMES, "r")}, "r"), size_mm=(50, 40))
ONE = PLACE.single_layout()
SCALES = [
    {"name": "similarity", "question": "How similar?"},
    {"name": "gloss", "question": "How glossy?", "lowest": 0, "highest": 100, "of": "both"},
]

AT_ONCE: dict[str, Any] = {"break_every": 4}
SEQUENCE: dict[str, Any] = {"presentation": "sequence", "exposure_s": 1.0, "blank_between_s": 0.5, "break_every": 4}
CATCH = {"pairs": [["a", "x"]], "identical": 2, "share": 0.4}
TIMES = {"fixation_s": 0.5, "exposure_s": 1.0, "blank_s": 0.3}
EVERYTHING: dict[str, Any] = {"ties": "both", "break_every": 4, "catch": CATCH, "ratings": SCALES, **TIMES}


def block(keys: dict[str, Any], place: BlockContext = PLACE, **more: Any) -> Block:
    return met("all_pairs", place, **keys | more)


BLOCKS = {
    "at once": block(AT_ONCE),
    "taken away": block(AT_ONCE, exposure_s=0.5, ties="not_sure"),
    "sequence": block(SEQUENCE),
    "everything": block(SEQUENCE | EVERYTHING),
    "everything at once": block(EVERYTHING, ROW),
}


@pytest.mark.parametrize("name", BLOCKS)
def test_a_block_keeps_what_every_block_promises(play: Play, promised: Play, name: str) -> None:
    made = BLOCKS[name]
    comparing = [ask for ask in promised(made, "all_pairs").asks if isinstance(ask.task, Compare)]
    assert len(comparing) >= made.trials
    for ask in comparing:
        assert ask.keys == made.keys
        assert set(ask.targets) == set(ask.keys.values())
        assert ask.task.reference is None
    assert {trial.details()["answer"] for trial in play(made).trials} == {"first"}


def test_in_sequence_two_numbered_intervals_come_before_the_question(play: Play) -> None:
    played = play(block(SEQUENCE))
    _, one, between, two, question, *_ = played.shown
    first, second = played.trials[0].details()["first"], played.trials[0].details()["second"]
    assert one.items == (Picture(first, ONE.picture_px, ONE.aperture_px), _number(1))
    assert not between.items
    assert two.items == (Picture(second, ONE.picture_px, ONE.aperture_px), _number(2))
    assert not question.stimuli
    assert [item.words for item in question.items] == ["Which?", "1", "2"]
    held = [(scene["what"], scene["asked_ms"]) for scene in played.trials[0].details()["timed"]]
    assert held == [("interval_1", 1000.0), ("between", 500.0), ("interval_2", 1000.0)]
    assert played.trials[0].details()["first_position"] == "interval_1"
    assert played.trials[0].response_time_s == 0.5


def _number(number: int) -> Text:
    return Text(str(number), ONE.question_px, 36, luminance_share=0.3)


def test_both_intervals_are_made_ready_before_the_first(play: Play) -> None:
    played = play(block(SEQUENCE))
    pairs = [{trial.details()["first"], trial.details()["second"]} for trial in played.trials]
    ready = [set(scene.stimuli) for scene in played.prefetched]
    assert ready[0] == pairs[0]
    assert [pair for pair in ready if pair] == [pairs[0], *_with_breaks(pairs, 4)]


def _with_breaks(pairs: list[set[str]], every: int) -> list[set[str]]:
    """Return what is made ready: each pair at the question before it, and once more at a break before it."""
    return [pair for n, pair in enumerate(pairs) if n for _ in range(2 if n % every == 0 else 1)]


def test_a_reference_picture_stays_beside_a_sequence(play: Play) -> None:
    layout = WITH_REFERENCE.single_layout()
    played = play(block(SEQUENCE, WITH_REFERENCE))
    assert layout.reference_px is not None
    beside = Picture("r", layout.reference_px, layout.aperture_px)
    assert all(beside in scene.items for scene in played.shown[1:5])
    # Nothing that can be clicked lies on it.
    (ask, *_) = [ask for ask in played.asks if isinstance(ask.task, Compare)]
    assert ask.task.reference == "r"
    assert all(target.offset_px[1] - target.size_px[1] / 2 >= layout.below_px for target in ask.targets.values())


@pytest.mark.parametrize(
    ("key", "answer"),
    [
        ("1", "first"),
        ("2", "second"),
        ("left", "first"),
        ("right", "second"),
        ("pad_left", "first"),
        ("pad_right", "second"),
        ("click first", "first"),
        ("click second", "second"),
        ("n", "no_difference"),
        ("u", "not_sure"),
        ("click no_difference", "no_difference"),
        ("click not_sure", "not_sure"),
    ],
)
def test_each_answer_has_keys_and_a_place_to_click(play: Play, key: str, answer: str) -> None:
    played = play(block(SEQUENCE, ties="both"), lambda ask: key if isinstance(ask.task, Compare) else plain_key(ask))
    assert {trial.details()["answer"] for trial in played.trials} == {answer}


@pytest.mark.parametrize(("place", "keys"), [(ROW, ("left", "pad_right")), (COLUMN, ("up", "pad_down"))])
def test_pictures_at_once_are_chosen_by_arrows_and_clicks_on_them(
    play: Play, place: BlockContext, keys: tuple[str, str]
) -> None:
    made, layout = block(AT_ONCE, place), place.pair_layout()
    for key, answer in zip(keys, ("first", "second"), strict=True):
        assert made.keys[key] == answer
        (ask, *_) = [ask for ask in play(made).asks if isinstance(ask.task, Compare)]
        assert ask.targets[answer].offset_px == (layout.first_px if answer == "first" else layout.second_px)
        assert ask.targets[answer].size_px == layout.aperture_px


@pytest.mark.parametrize(
    ("ties", "allowed"),
    [("none", set()), ("no_difference", {"n"}), ("not_sure", {"u"}), ("both", {"n", "u"})],
)
@pytest.mark.parametrize("keys", [AT_ONCE, SEQUENCE])
def test_ties_can_be_answered_only_where_they_are_allowed(
    play: Play, keys: dict[str, Any], ties: str, allowed: set[str]
) -> None:
    asked = block(keys, ties=ties)
    assert {"n", "u"} & set(asked.keys) == allowed
    (ask, *_) = [ask for ask in play(asked).asks if isinstance(ask.task, Compare)]
    words = [item.words for item in ask.scene.items if isinstance(item, Text)]
    assert {word[0].lower() for word in words if ":" in word} == allowed


def test_a_tie_has_no_winner(play: Play) -> None:
    played = play(block(AT_ONCE, ties="both"), lambda ask: "n" if isinstance(ask.task, Compare) else plain_key(ask))
    for trial in played.trials:
        assert trial.details()["answer"] == "no_difference"
        assert not {"chosen", "rejected"} & set(trial.details())
        assert {"first", "second"} < set(trial.details())


def test_words_of_other_answers_do_not_lie_on_the_pictures(play: Play) -> None:
    for place in (ROW, COLUMN):
        layout = place.pair_layout()
        top = min(layout.first_px[1], layout.second_px[1]) - layout.aperture_px[1] / 2
        (ask, *_) = [ask for ask in play(block(AT_ONCE, place, ties="both")).asks if isinstance(ask.task, Compare)]
        for meaning, target in ask.targets.items():
            if meaning in ("no_difference", "not_sure"):
                assert target.offset_px[1] + target.size_px[1] / 2 <= top


def test_catch_trials_say_what_they_are_and_whether_the_answer_is_right(play: Play) -> None:
    made = block(AT_ONCE, catch=CATCH, ties="both")
    for seed in range(3):
        played = play(made, at_random(seed))
        assert len(played.trials) == 10 + 4
        catch = [trial for trial in played.trials if "catch" in trial.details()]
        assert sorted(trial.details()["catch"] for trial in catch) == ["identical"] * 2 + ["obvious"] * 2
        for trial in catch:
            data = trial.details()
            if data["catch"] == "identical":
                assert data["first"] == data["second"]
                assert not {"chosen", "rejected", "correct"} & set(data)
            else:
                assert {data["first"], data["second"]} == {"a", "x"}
                assert data["correct"] is (data.get("chosen") == "a")
        plain = [trial.details() for trial in played.trials if "catch" not in trial.details()]
        assert len({frozenset((data["first"], data["second"])) for data in plain}) == 10


def test_ratings_follow_the_choice_under_the_picture_they_are_about(play: Play) -> None:
    made = block(AT_ONCE, ratings=SCALES, ties="no_difference")
    marks = {"a": 1, "b": 2, "c": 3, "d": 4, "e": 5}

    def press(ask: Ask) -> str:
        if not isinstance(ask.task, Rate):
            return plain_key(ask)
        if ask.task.current is not None:
            return "enter"
        assert ask.task.stimulus is not None
        assert ask.scene.stimuli == (ask.task.stimulus,)
        return key_for(ask, str(marks[ask.task.stimulus]))

    for trial in play(made, press).trials:
        chosen, rejected = marks[trial.details()["chosen"]], marks[trial.details()["rejected"]]
        assert trial.details()["ratings"] == {"similarity": chosen, "gloss": {"first": chosen, "second": rejected}}
        assert trial.details()["rating_times_s"] == {"similarity": 1.0, "gloss": {"first": 1.0, "second": 1.0}}
        assert trial.response_time_s == 0.5
    tied = play(made, lambda ask: "n" if isinstance(ask.task, Compare) else plain_key(ask)).trials[0].details()
    assert tied["ratings"] == {"similarity": None, "gloss": {"first": 50, "second": 50}}


def test_the_expected_time_counts_intervals_and_ratings() -> None:
    assert BLOCKS["at once"].expected_s == 50
    assert BLOCKS["sequence"].expected_s == 10 * (5 + 2 * 1.0 + 0.5)
    assert BLOCKS["everything"].expected_s == pytest.approx(14 * (5 + 2.5 + 0.5 + 0.3 + 3 * 4))


@pytest.mark.parametrize(
    ("written", "what"),
    [
        ({"presentation": "sequence"}, "needs 'exposure_s'"),
        ({"blank_between_s": 1}, "belongs to 'presentation: sequence'"),
        ({"ties": "maybe"}, "no_difference"),
        ({"ratings": [{"name": "a", "question": "?", "of": "none"}]}, "chosen"),
    ],
)
def test_what_does_not_go_together_is_refused(written: dict[str, Any], what: str) -> None:
    with pytest.raises(ValidationError, match=what):
        entry("all_pairs", **written)


def test_faults_name_their_place() -> None:
    scales = [{"name": "r", "question": "?"}, {"name": "r", "question": "?"}]
    spec = entry("all_pairs", stimuli=["a", "b"], catch={"identical": 2}, ratings=scales)
    faults = list(spec.faults(Stimuli({"a": {}, "b": {}, "c": {}})))
    assert [fault.path for fault in faults] == [("catch",), ("ratings", 1, "name")]


def test_a_long_question_leaves_room_for_the_other_answers(play: Play) -> None:
    def height(words: str) -> int:
        made = block(AT_ONCE, setting(NAMES, question=words, size_mm=(50, 40)), ties="both", exposure_s=0.5)
        (ask, *_) = [ask for ask in play(made).asks if isinstance(ask.task, Compare)]
        first, *_ = ask.scene.items
        assert isinstance(first, Text)
        return first.height_px

    assert height("Which of these two pictures is closer to the plate?") == 24
    assert height("Which of these two pictures is closer in gloss and colour to the plate that lies on your left?") < 20


def test_the_cross_stands_in_the_middle_of_pictures_shown_at_once(play: Play) -> None:
    shown = play(block(AT_ONCE | TIMES)).shown
    crosses = {
        item.offset_px for scene in shown for item in scene.items if isinstance(item, Text) and item.words == "+"
    }
    assert crosses == {(0, 0)}
