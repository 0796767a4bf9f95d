"""Keyboards that are not American, in a real window: keys count by what they print and by their place."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from typing import Any

import pytest

from analysis.records import read_session, session_files
from runner import Scene
from runner.blocks.message import pause_menu
from runner.check.doctor import ANY_KEYS
from runner.observers import Person, read_observer, walk
from runner.ports import Ask, KeyPress
from runner.presenter.surfaces.keyboard import Keyboard, examine_keyboard
from runner.presenter.surfaces.windows import WindowSurface
from runner.protocol import read_experiment
from runner.scene import Text
from runner.session import SessionOptions, build_stimuli
from runner.session.station import Station
from tests.choice import nightly

Study = Any  # tests/conftest.py

pytestmark = pytest.mark.window
Lay = Callable[[str], None]
Sit = Callable[[str], WindowSurface]
# X11's numbers of keys, by what an American keyboard has there.
KEYS = {"1": "10", "2": "11", "5": "14", "a": "38", "n": "57", "s": "39", "q": "24"}
KEYPAD = {"4": "83", "6": "85", "8": "80"}


def _do(*words: str) -> None:
    subprocess.run(words, check=True, timeout=10, env=dict(os.environ))


@pytest.fixture
def lay(display: str) -> Iterator[Lay]:
    """Give the keyboard the layout that is named."""
    for tool in ("xdotool", "setxkbmap"):
        if shutil.which(tool) is None:
            pytest.skip(f"{tool} is not installed")
    yield lambda layout: _do("setxkbmap", layout)
    _do("setxkbmap", "us")


@pytest.fixture
def sit(lay: Lay) -> Iterator[Sit]:
    """Open a window at a keyboard of the layout that is named."""
    with ExitStack() as opened:

        def at(layout: str) -> WindowSurface:
            lay(layout)
            return opened.enter_context(WindowSurface((640, 480)))

        yield at


def _answers(window: WindowSurface, ask: Ask, presses: int) -> list[KeyPress]:
    # Another person for each, for whom nothing was pressed before.
    return [Person(window.wait_key).respond(ask, 0.0) for _ in range(presses)]


def _press(*keys: str) -> None:
    _do("xdotool", "key", "--delay", "30", *keys, "F12")


@pytest.mark.parametrize("layout", ["fr", *nightly("us", "cz", "ru", "de")])
def test_the_row_of_digits_answers_at_every_keyboard(sit: Sit, layout: str) -> None:
    window = sit(layout)
    ask = Ask(Scene(), {**dict.fromkeys("12345", "rated"), "f12": "end"})
    _press(KEYS["1"], f"shift+{KEYS['2']}", KEYS["5"])
    assert [press.key for press in _answers(window, ask, 4)] == ["1", "2", "5", "f12"]


@pytest.mark.parametrize("layout", ["ru", *nightly("us", "cz")])
def test_letters_answer_by_their_place(sit: Sit, layout: str) -> None:
    window = sit(layout)
    ask = Ask(Scene(), {"n": "no_difference", "s": "stop", "a": "option", "f12": "end"})
    _press(KEYS["n"], KEYS["s"], KEYS["a"])
    assert [press.key for press in _answers(window, ask, 4)] == ["n", "s", "a", "f12"]


def test_what_a_key_prints_goes_before_its_place(sit: Sit) -> None:
    """The French key at Q prints A, and the one at A prints Q."""
    window = sit("fr")
    _press(KEYS["q"], KEYS["a"])
    both = Ask(Scene(), {"a": "one", "q": "other", "f12": "end"})
    assert [press.key for press in _answers(window, both, 3)] == ["a", "q", "f12"]


def test_the_keypad_has_arrows_while_num_lock_is_off_and_digits_while_it_is_on(sit: Sit) -> None:
    window = sit("us")
    scale = Ask(Scene(), {**dict.fromkeys("468", "rated"), "left": "lower", "right": "higher", "f12": "end"})
    _press(KEYPAD["4"], KEYPAD["6"], KEYPAD["8"])
    answers = _answers(window, scale, 3)
    assert [press.key for press in answers] == ["left", "right", "f12"]
    assert [(one.key, one.why) for one in answers[-1].ignored] == [("up", "no_meaning")]
    _do("xdotool", "key", "Num_Lock")
    try:
        _press(KEYPAD["4"], KEYPAD["6"], KEYPAD["8"])
        assert [press.key for press in _answers(window, scale, 4)] == ["4", "6", "8", "f12"]
    finally:
        _do("xdotool", "key", "Num_Lock")


def test_presses_with_alt_ctrl_or_super_answer_nothing_and_are_recorded(sit: Sit) -> None:
    window = sit("us")
    ask = Ask(Scene(), {"n": "no_difference", "up": "first", "f12": "end"})
    _press("ctrl+n", "alt+n", "super+n", "ctrl+Up", "shift+n")
    answers = _answers(window, ask, 2)
    assert [press.key for press in answers] == ["n", "f12"]
    ignored = [(one.key, one.why) for one in answers[0].ignored]
    assert ignored == [(key, "no_meaning") for key in ("ctrl+n", "alt+n", "super+n", "ctrl+up")]


def test_super_types_nothing_and_shift_types(sit: Sit) -> None:
    window = sit("us")
    _press("super+n", "ctrl+n", "shift+n")
    keys = [window.wait_key().key]
    while keys[-1] != "f12":
        keys.append(window.wait_key().key)
    assert [key for key in keys if key.startswith("text")] == ["text N"]


@pytest.mark.parametrize(
    ("layout", "labels"),
    [
        ("us", {}),
        ("fr", {"1": "&", "2": "é"}),
        *nightly(("de", {}), ("cz", {"1": "+", "n": None}), ("ru", {"n": "Т", "1": None})),
    ],
)
def test_a_window_says_what_keys_print_that_count_by_their_place(
    sit: Sit, layout: str, labels: dict[str, str | None]
) -> None:
    there = sit(layout).keyboard_labels()
    assert {key: there.get(key) for key in labels} == labels
    assert bool(there) == bool(labels)


def _said(study: Study) -> tuple[set[str], Any]:
    """Return what is said in a session's blocks and its pause menu, and what its record holds of the interface."""
    design = read_experiment(study.experiment)
    with Station.open(design, build_stimuli(design), SessionOptions(study.results, windowed=True)) as station:
        scenes = [
            step.scene for block in station.experiment.blocks("01") for step in walk(block) if isinstance(step, Ask)
        ]
        menu = pause_menu(station.experiment.style, can_repeat=True).scene
        law = read_observer(study.observers, design.scored_names, None)
        log = read_session(next(session_files(station.run("01", station.simulated(law, "01"), simulated=True))))
    words = {item.words for scene in (*scenes, menu) for item in scene.items if isinstance(item, Text)}
    return words, log.header.interface.given().get("keyboard_labels")


PAIRS = "{kind: all_pairs, break_every: 4}"
ASKED = """{kind: all_pairs, ties: no_difference, presentation: sequence, exposure_s: 0.1}
  - {kind: questionnaire, questions: [{kind: choice, name: hand, question: Which hand, options: [left, right]}]}"""


@pytest.mark.parametrize(
    ("layout", "hints", "recorded"),
    [
        ("fr", {"N: no difference", "S", "1 (&)", "2 (é)"}, {"1": "&", "2": "é"}),
        *nightly(
            ("ru", {"N (Т): no difference", "S (Ы)", "1", "2"}, {"n": "Т"}),
            ("us", {"N: no difference", "S", "1", "2"}, {}),
        ),
    ],
)
def test_hints_name_the_keys_as_they_stand_on_the_keyboard(
    lay: Lay, study: Study, layout: str, hints: set[str], recorded: dict[str, str]
) -> None:
    study.edit("small.yaml", PAIRS, ASKED)
    lay(layout)
    words, labels = _said(study)
    assert hints <= words
    assert recorded.items() <= (labels or {}).items()
    assert bool(labels) == bool(recorded) == any("(" in said for said in words)


def test_doctor_lists_keys_of_a_note_too(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where words are typed, every key is itself, whatever `keys` of the experiment puts in its place."""
    from runner.check import doctor

    asked: list[str] = []

    def sends_none(keys: Iterable[str]) -> Keyboard:
        asked.extend(keys)
        return Keyboard({}, tuple(asked))

    monkeypatch.setattr(doctor, "examine_keyboard", sends_none)
    text = study.experiment.read_text()
    study.experiment.write_text(f"{text}keys: {{enter: [ö]}}\n")
    told = study.cyclopean("doctor", "--experiment", study.experiment).stdout
    assert "'enter' (accept in a note)" in told
    assert "'backspace' (erase in a note)" in told
    assert {"enter", "backspace"} <= set(ANY_KEYS)


@pytest.mark.parametrize(("layout", "missing"), [("fr", "öф"), *nightly(("us", "öéф"), ("de", "éф"), ("ru", "öé"))])
def test_a_key_that_is_printed_or_has_its_place_on_a_keyboard_can_be_sent(lay: Lay, layout: str, missing: str) -> None:
    lay(layout)
    asked = ("pad_a", "wheel_up", "f12", "page_down", "é", "+")
    assert examine_keyboard((*ANY_KEYS, *"öéф")).cannot_send == tuple(missing)
    assert set(examine_keyboard(asked).cannot_send) <= {"é"}
