"""Every word an observer reads comes from the table of its language, and every key can be another."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from documents import InputError
from runner import Scene
from runner.blocks import Block, Draft, Stimuli
from runner.blocks.message import pause_menu
from runner.blocks.text_entry import Number, typed
from runner.observers import walk
from runner.ports import Ask, Browse, GoOn, Rate
from runner.presenter import coverage
from runner.scene import Text
from runner.views import Interface, Style, page
from runner.views.interface import ENGLISH, LANGUAGES, Language, words_of
from tests.runner import every_kind as EVERY
from tests.runner.every_kind import ROOT, VARIANTS, met, setting

_BRACES = re.compile(r"\{(\w+)\}")
# What str.format would fill in, and the interface does not: its braces would be shown.
NOT_FILLED_IN = ("{done.nope}", "{done[0]}", "{done!r}", "{done:03d}", "{ done }", "{done-}", "{nope.done}")
# What the experiments of every_kind.py themselves say.
THEIRS = (
    *("Which is closer?", "Look.", "Rest.", "How good", "How old", "Which hand", "What else", "left", "right"),
    *("image", "beach", "church", "How glossy", "years", "Which gender", "woman", "man"),
)


def said(scene: Scene) -> list[str]:
    """Return the words on a screen."""
    return [item.words for item in scene.items if isinstance(item, Text)]


def marked(language: Language = "en") -> dict[str, str]:
    """Return words that show where they come from: a mark and what stands in braces."""
    return {name: "§" + "".join(f"{{{b}}}" for b in _BRACES.findall(w)) for name, w in words_of(language).items()}


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_language_has_every_word_with_the_same_places(language: Language) -> None:
    words = words_of(language)
    assert set(words) == set(words_of("en"))
    for name, text in words_of("en").items():
        assert sorted(_BRACES.findall(words[name])) == sorted(_BRACES.findall(text)), name
        assert words[name].strip(), name


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_letter_of_a_language_can_be_drawn(language: Language) -> None:
    absent = coverage("\uffff", 24, 100)
    assert absent is not None
    letters = {letter for words in words_of(language).values() for letter in words if not letter.isspace()}
    assert len(letters) > 40
    for letter in letters | set("éßüœ"):
        drawn = coverage(letter, 24, 100)
        assert drawn is not None
        assert drawn.shape != absent.shape or (drawn != absent).any(), letter


@pytest.mark.parametrize(("kind", "variant"), VARIANTS)
def test_no_word_on_any_screen_is_from_elsewhere(tmp_path: Path, kind: str, variant: int) -> None:
    more = "words:\n" + "".join(f"  {name}: {text!r}\n" for name, text in marked().items())
    design = EVERY.experiment(tmp_path, EVERY.written(kind, variant), more=more)
    for block in design.blocks("01"):
        for step in walk(block):
            for words in [] if isinstance(step, Draft) else said(step.scene):
                for theirs in THEIRS:
                    words = words.replace(theirs, "")
                assert not re.search(r"[^\W\d_]{2}", words), words


def test_no_word_of_menus_and_typed_pages_is_from_elsewhere() -> None:
    style = Style(interface=Interface("en", marked()))
    scenes = [pause_menu(style, can_repeat=True).scene, page("§", style, "finish").scene]
    writing = typed("§", style, field=Number(unit="§", lowest=1, highest=9), required=False)
    ask = next(writing)
    for key in ("backspace", "text x", "text 0", "enter"):
        scenes.append(ask.scene)
        from runner.ports import Response

        ask = writing.send(Response(key, ask.meaning(key) or "", 1.0))
    scenes.append(ask.scene)
    assert not [words for scene in scenes for words in said(scene) if re.search(r"[^\W\d_]{2}", words)]


def _literals(file: Path) -> Iterator[tuple[int, str]]:
    """Yield words that are written where they are drawn."""
    drawing = {"text": 0, "Text": 0, "page": 0, "button": 1, "typed": 0}
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if not isinstance(node, ast.Call):
            continue
        name = getattr(node.func, "attr", getattr(node.func, "id", ""))
        if name in drawing and len(node.args) > drawing[name]:
            for part in ast.walk(node.args[drawing[name]]):
                if isinstance(part, ast.Call):
                    break
                if isinstance(part, ast.Constant) and isinstance(part.value, str):
                    yield node.lineno, part.value


def test_no_word_is_written_where_it_is_drawn() -> None:
    files = [*(ROOT / "runner/blocks").rglob("*.py"), *(ROOT / "runner/session").glob("*.py")]
    assert len(files) > 30
    written = [(f.name, line, text) for f in files for line, text in _literals(f) if re.search(r"[^\W\d_]{2}", text)]
    assert written == []


def test_keys_are_called_by_their_names_in_the_language() -> None:
    assert ENGLISH.say("press_space") == "Press the space bar to go on"
    assert Interface("de", {}, {"space": ["enter"]}).say("press_space") == "Weiter mit Enter"
    assert Interface("fr", {}, {"space": ["b"]}).say("press_space") == "Appuyez sur B pour continuer"
    assert Interface("en", {}, {"space": ["f5"]}).say("press_space") == "Press F5 to go on"
    assert ENGLISH.say("leaf") == "Arrows: leaf through.  Look at all of them"
    assert Interface("en", {}, {"left": ["a"], "right": ["d"]}).say("leaf").startswith("A / D: leaf")
    assert ENGLISH.pointing("near_page") == words_of("en")["near_page"]
    turned = Interface("en", {}, {"up": ["w"]}).pointing("near_page")
    assert turned.endswith(
        "In place of the arrow keys: W (up), down arrow (down), left arrow (left), right arrow (right)"
    )


def test_other_keys_mean_what_theirs_meant_and_their_own_no_longer() -> None:
    ask = Ask(Scene(), {"left": "first", "right": "second", "n": "no_difference"})
    heard = Interface("en", {}, {"left": ["a", "1"], "n": ["right_arrow"]}).listening(ask)
    assert dict(heard.keys) == {"right": "second", "a": "first", "1": "first", "right_arrow": "no_difference"}
    writing = Ask(Scene(), {"enter": "accept"}, typing=True)
    assert Interface("en", {}, {"enter": ["a"]}).listening(writing) is writing


def findings(folder: Path, more: str, block: str = "kind: all_pairs, stimuli: [a, b, c], ties: both") -> list[str]:
    """Return what is wrong with an experiment of ``block`` with ``more`` keys."""
    with pytest.raises(InputError) as refused:
        EVERY.experiment(folder, block, more=more)
    return [str(finding) for finding in refused.value.findings]


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ("words: {language: english}", "there is no language 'english'"),
        ("words: {pres_space: Weiter}", "no words called 'pres_space' (did you mean 'press_space'?)"),
        (
            "words: {press_space: 'Hit {spade}'}",
            "nothing is called {spade} in 'press_space' (did you mean 'space'? there can be: {space}",
        ),
        *((f"words: {{comparisons_done: '{text}'}}", f"nothing is called {text} in") for text in NOT_FILLED_IN),
        (
            "words: {language: de, series_done: '{done.nope}'}",
            "(did you mean 'done'? there can be: {done}, {all}, {up}",
        ),
        ("words: {finish: '{}'}", "nothing is called {} in 'finish' (there can be: {space}, {up}"),
        ("words: {finish: 'Press {space'}", "'{' stands without its other brace in 'finish'"),
        ("words: {finish: 'Press space}'}", "'}' stands without its other brace in 'finish'"),
        # Words that other words take up are put there as they are.
        ("words: {arrows: '{left}'}", "nothing is called {left} in 'arrows' (write it without braces)"),
        ("words: {key_space: '{enter}'}", "nothing is called {enter} in 'key_space' (write it without braces)"),
        ("words: {pause: ' '}", "'pause' is empty"),
        ("keys: {lefft: [a]}", "no screen asks for the key 'lefft' (did you mean 'left'?)"),
        ("keys: {left: [spacee]}", "there is no key 'spacee' (did you mean 'space'?)"),
        ("keys: {left: [A]}", "there is no key 'A' (did you mean 'a'?)"),
        ("keys: {escape: [q]}", "Escape always opens the pause menu"),
        ("keys: {up: [n]}", "'n' means something else too on one screen"),
    ],
)
def test_words_and_keys_that_cannot_be_are_refused_with_their_place(tmp_path: Path, more: str, words: str) -> None:
    (finding,) = findings(tmp_path, more + "\n")
    assert words in finding
    assert re.search(r"every_kind\.yaml:\d+:\d+: ", finding)


def test_every_brace_of_words_that_pass_is_filled_in(tmp_path: Path) -> None:
    """With the shipped words of every language as an experiment's own, and with every key beside them."""
    for language in LANGUAGES:
        own = dict(words_of(language)) | {"press_space": "{space} {enter} {left} {right} {up} {down}"}
        text = "".join(f"  {name}: {json.dumps(words)}\n" for name, words in own.items())
        design = EVERY.experiment(tmp_path / language, "kind: all_pairs, stimuli: [a, b, c]", more=f"words:\n{text}")
        for name, words in own.items():
            values = {brace: 1 for brace in _BRACES.findall(words_of("en")[name])}
            assert not re.search("[{}]", design.style.say(name, **values)), words


def test_one_key_cannot_choose_both_but_may_choose_and_go_on(tmp_path: Path) -> None:
    first, second = findings(tmp_path / "both", "keys: {up: [a], down: [b, a]}\n")
    assert "'a' means something else too" in first
    assert "'a' means something else too" in second
    more = "keys: {up: ['1'], space: ['1', '4']}\n"
    EVERY.experiment(tmp_path / "on", "kind: all_pairs, stimuli: [a, b, c]", more=more)


def test_a_key_may_take_the_place_of_one_that_goes_elsewhere(tmp_path: Path) -> None:
    """N for the upper picture where U and O are the other answers: nothing means two things."""
    more = "keys: {up: [n], n: [o]}\n"
    design = EVERY.experiment(tmp_path, "kind: all_pairs, stimuli: [a, b, c], ties: both", more=more)
    ask = next(step for step in walk(design.blocks("01")[0]) if isinstance(step, Ask))
    heard: Mapping[str, str] = design.style.interface.listening(ask).keys
    assert (heard["n"], heard["o"]) == ("first", "no_difference")
    assert "O: no difference" in said(ask.scene)


# Ratings and series: what holds for every block, right in what they say, by the mouse alone.


Play = Callable[..., Any]  # conftest.py
SCALES = [
    {"name": "quality", "question": "How good?", "highest": 5},
    {"name": "depth", "question": "How deep?", "lowest": 0, "highest": 100},
]
SERIES = {f"{paint}-{kind}": [f"{paint}{kind}1", f"{paint}{kind}2"] for paint in "ab" for kind in "xy"}
TWICE: dict[str, Any] = {"ratings": SCALES, "repeats": 2}
BEST: dict[str, Any] = {"series": SERIES}
BLOCKS: dict[str, tuple[str, dict[str, Any], str | None, set[type]]] = {
    "rating": ("rating", TWICE, None, {Rate}),
    "rating, timed": (
        "rating",
        TWICE | {"fixation_s": 1.0, "exposure_s": 0.5, "blank_s": 2.0, "break_every": 2},
        None,
        {Rate, GoOn},
    ),
    "rating beside a reference": ("rating", {"ratings": SCALES, "stimuli": ["a"]}, "r", {Rate}),
    "best of series": ("best_of_series", BEST, None, {Browse, Rate}),
    "best of series, with breaks": (
        "best_of_series",
        BEST | {"break_every": 1, "wrap": True, "start": "first"},
        None,
        {Browse, Rate, GoOn},
    ),
    "best of series without ratings": ("best_of_series", BEST | {"ratings": [], "see_all": False}, "r", {Browse}),
}


def block(name: str) -> Block:
    kind, keys, reference, _ = BLOCKS[name]
    stimuli = Stimuli({stimulus: {} for stimulus in ("a", "b", "c", *([reference] if reference else []))}, reference)
    return met(kind, setting(stimuli), **keys)


@pytest.mark.parametrize("name", BLOCKS)
def test_everything_can_be_answered_with_the_mouse_alone(name: str, play: Play) -> None:
    def click(ask: Ask) -> str:
        task = ask.task
        if isinstance(task, Rate):
            return f"click {task.highest}" if task.current is None else "click accept"
        if isinstance(task, Browse):
            left = set(range(len(task.series))) - task.seen
            return "click choose" if not left else "click next" if max(left) > task.index else "click previous"
        return "click continue"

    clicked = play(block(name), click)
    assert len(clicked.trials) == block(name).trials
    assert all(key.startswith("click ") for trial in clicked.trials for key, _ in trial.events)
