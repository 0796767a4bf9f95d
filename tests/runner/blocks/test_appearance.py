"""`style:`, `keys:` and `words:` of an experiment file, on the screens that they are about and in the record."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from documents import InputError
from documents.yaml import read_yaml
from runner import Scene
from runner.blocks import Draft
from runner.check import CheckReport
from runner.check.screens import check_screens
from runner.observers import plain_key, walk
from runner.ports import Ask, KeyPress
from runner.presenter import coverage, text_area
from runner.protocol import Experiment, read_experiment
from runner.scene import Box, Text
from runner.session import Resumed, Session
from runner.session.header import make_header
from runner.views import Interface, Style
from tests.runner import every_kind as EVERY
from tests.runner.every_kind import Stage as Play

Study = Any  # tests/conftest.py
PAIRS = "kind: all_pairs, stimuli: [a, b, c]"


def words_on(design: Experiment) -> list[list[str]]:
    """Return the words of each screen."""
    steps = (step for block in design.blocks("01") for step in walk(block))
    scenes = (step.scene for step in steps if not isinstance(step, Draft))
    return [[item.words for item in scene.items if isinstance(item, Text)] for scene in scenes]


class Pressing:
    """Presses the plainest key that means something here; the keys of the experiment, not its own."""

    def __init__(self) -> None:
        self.pressed: list[str] = []

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        meaning = ask.meaning(plain_key(ask))
        self.pressed.append(next(key for key, meant in ask.keys.items() if meant == meaning))
        return KeyPress(self.pressed[-1], onset_s + 1.0)


def run(design: Experiment, observer: Any, **more: Any) -> Play:
    """Run the session of observer 01 and return what was shown and recorded."""
    play = Play()
    Session(design.blocks("01"), play, observer, play, style=design.style, **more).run()
    return play


def test_a_file_without_them_has_the_digest_that_it_always_had(tmp_path: Path) -> None:
    plain = EVERY.experiment(tmp_path / "plain", PAIRS)
    dump = plain.spec.model_dump_json()
    assert not {"style", "keys", "words"} & set(plain.spec.model_dump())
    physical = dump.replace('"reference":"none"', '"reference":"physical"')
    assert plain.digest == hashlib.sha256(physical.encode()).hexdigest()
    lit = "style: {background: {share_of_white: 0.1}}"
    digests = {plain.digest}
    for number, more in enumerate(("style: {progress: bar}", "words: {language: de}", "keys: {up: [w]}", lit)):
        digests.add(EVERY.experiment(tmp_path / str(number), PAIRS, more=more).digest)
    assert len(digests) == 5


def test_pages_say_what_the_space_bar_is_for(tmp_path: Path) -> None:
    page = "kind: instructions, text: Look."
    design = EVERY.experiment(tmp_path, page, page, PAIRS, "kind: break", PAIRS, page)
    hints = [screen[-1] for screen in words_on(design) if len(screen) == 2]
    assert hints == [
        "Press the space bar for the next page",
        "Press the space bar to begin",
        "Press the space bar to go on",
        "Press the space bar to finish",
    ]


@pytest.mark.parametrize(
    ("blocks", "more", "words"),
    [
        ((PAIRS,), "", "Thank you. That was all."),
        ((PAIRS,), "words: {language: de}", "Vielen Dank. Das war alles."),
        ((PAIRS,), "words: {thanks: 'Bye!'}", "Bye!"),
        ((PAIRS,), "style: {end_page: false}", None),
        ((PAIRS, "kind: instructions, text: Thanks."), "", None),
        ((PAIRS, "kind: instructions, text: Thanks."), "style: {end_page: true}", "Thank you. That was all."),
    ],
)
def test_a_page_thanks_unless_the_last_block_does(
    tmp_path: Path, blocks: tuple[str, ...], more: str, words: str | None
) -> None:
    assert EVERY.experiment(tmp_path, *blocks, more=more + "\n").end_page == words


def test_the_end_page_comes_after_all_is_recorded_and_records_nothing(tmp_path: Path) -> None:
    design = EVERY.experiment(tmp_path, PAIRS)
    play = Play()
    session = Session(design.blocks("01"), play, Pressing(), play, style=design.style)
    session.run()
    assert play.ends
    recorded = len(play.trials)
    session.show_end_page(design.end_page or "")
    assert len(play.trials) == recorded
    assert [item.words for item in play.shown[-1].items if isinstance(item, Text)] == [
        "Thank you. That was all.",
        "Press the space bar to finish",
    ]


@pytest.mark.parametrize("arcmin", [10.0, 20.0, 40.0])
def test_a_capital_letter_is_as_high_as_asked(tmp_path: Path, arcmin: float) -> None:
    design = EVERY.experiment(tmp_path, PAIRS, more=f"style: {{text: {{height_arcmin: {arcmin}}}}}")
    question = next(item for item in _asks(design)[0].scene.items if isinstance(item, Text))
    drawn = coverage("H", question.height_px, 1000)
    assert drawn is not None
    rows = np.flatnonzero(drawn.max(axis=1) > 127)
    rig = design.rig
    height_mm = 2 * rig.spec.distance_mm * np.tan(np.radians(arcmin / 60) / 2)
    assert rows.max() - rows.min() + 1 == pytest.approx(height_mm / rig.display.panel.pixel_pitch_mm, abs=1.0)


def test_progress_is_at_the_lower_edge_of_every_screen_of_a_trial(tmp_path: Path) -> None:
    rating = "kind: rating, stimuli: [a, b], ratings: [{name: q, question: How good}]"
    blocks = "kind: instructions, text: Look.", PAIRS + ", fixation_s: 0.2", rating
    for progress in ("none", "bar", "count"):
        design = EVERY.experiment(tmp_path / progress, *blocks, more=f"style: {{progress: {progress}}}")
        play = run(design, Pressing())
        lower = [_lower(scene, design.view_px) for scene in play.shown]
        assert lower[0] == []
        if progress == "none":
            assert not any(lower)
        elif progress == "count":
            told = [items[0].words for items in lower[1:]]
            assert told[0] == "1 / 5"
            assert told[-1] == "5 / 5"
            assert list(dict.fromkeys(told)) == [f"{n} / 5" for n in range(1, 6)]
        else:
            widths = [items[-1].size_px[0] / items[0].size_px[0] for items in lower[1:]]
            assert sorted({round(width, 2) for width in widths}) == [0.2, 0.4, 0.6, 0.8, 1.0]
            assert len(lower[1]) == 1  # nothing is done yet


def _lower(scene: Scene, view_px: tuple[int, int]) -> list[Any]:
    return [i for i in scene.items if isinstance(i, Text | Box) and i.offset_px[1] > view_px[1] / 2 - 40]


def test_pictures_leave_room_for_the_progress(tmp_path: Path) -> None:
    file = EVERY.experiment(tmp_path, PAIRS).file
    tall = "size_mm: [60, 118]"
    file.write_text(file.read_text().replace("size_mm: [60, 40]", tall))
    read_experiment(file)
    file.write_text(file.read_text() + "style: {progress: bar}\n")
    with pytest.raises(InputError, match="beside the progress"):
        read_experiment(file)


def test_other_keys_are_pressed_recorded_and_replayed(tmp_path: Path) -> None:
    design = EVERY.experiment(
        tmp_path, "kind: instructions, text: Look.", PAIRS, more="keys: {up: [w, f1], space: [b]}"
    )
    pressing = Pressing()
    play = run(design, pressing)
    assert [trial.events[-1][0] for trial in play.trials] == ["b", "w", "w", "w"]
    assert all(trial.details()["answer"] == "first" for trial in play.trials[1:])
    again = run(design, _Script([event for trial in play.trials for event in trial.events]))
    assert [(t.details(), t.events) for t in again.trials] == [(t.details(), t.events) for t in play.trials]
    resumed = run(design, Pressing(), before=Resumed(play.trials[:2]))
    assert [t.details() for t in resumed.trials] == [t.details() for t in play.trials[2:]]


def _asks(design: Experiment) -> list[Ask]:
    return [step for block in design.blocks("01") for step in walk(block) if isinstance(step, Ask)]


class _Script:
    def __init__(self, events: list[tuple[str, float]]) -> None:
        self.events = events

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        key, time_s = self.events.pop(0)
        assert ask.meaning(key)
        return KeyPress(key, onset_s + time_s)


@pytest.mark.parametrize(
    ("style", "words"),
    [
        ("{background: {luminance_cd_m2: 500}}", "the display cannot show this background"),
        ("{background: {luminance_cd_m2: 5, share_of_white: 0.1}}", "not both"),
        ("{background: {xy: [0.3, 0.3]}}", "give its light"),
        ("{background: {share_of_white: 0.3}, text: {share_of_white: 0.35}}", "differ by less than 3 to 1"),
        ("{backgruond: {share_of_white: 0.3}}", "did you mean 'background'?"),
        ("{progress: line}", "progress"),
        ("{text: {height_arcmin: -3}}", "height_arcmin"),
    ],
)
def test_styles_that_cannot_be_are_refused(tmp_path: Path, style: str, words: str) -> None:
    with pytest.raises(InputError) as refused:
        EVERY.experiment(tmp_path, PAIRS, more=f"style: {style}\n")
    assert words in str(refused.value)


def test_the_header_states_style_keys_and_words(study: Study) -> None:
    more = "style: {progress: bar, text: {height_arcmin: 20}}\nkeys: {up: [w]}\nwords: {language: fr, pause: Halte}\n"
    study.experiment.write_text(study.experiment.read_text() + more)
    design = read_experiment(study.experiment)

    class Stimuli:
        digest = ""
        manifest: Mapping[str, str] = {}

    header = make_header(design, Stimuli(), "01", "s", (), {}, simulated=True)  # type: ignore[arg-type]  # no set is built
    assert header.interface.given() == {
        "language": "fr",
        "style": {"text": {"height_arcmin": 20.0}, "progress": "bar"},
        "keys": {"up": ["w"]},
        "words": {"pause": "Halte"},
    }


def test_words_larger_than_the_view_wrap_within_it() -> None:
    style = Style((960, 1080), type_px=60.0)
    area = text_area(style.text("Which of the two images is closer to the reference plate?"))
    assert area is not None
    assert area.within((960, 1080))
    assert Style((960, 1080), Interface("de")).say("pause") == "Pause"


def test_words_at_a_place_in_pixels_are_as_those_at_a_place_in_units() -> None:
    style = Style((960, 1080))
    assert style.text_at("Halt", (3, 4), width_px=880) == style.text("Halt", 3, 4)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ("style: {text: {height_arcmin: 60}}", "height_arcmin"),
        ("style: {text: {height_arcmin: 36}}\nwords: {thanks: '" + "Thank you very much. " * 90 + "'}", "at the end"),
        ("words: {menu_kept: '" + "All is kept. " * 150 + "'}", "around the blocks"),
    ],
)
def test_check_refuses_words_that_do_not_fit(tmp_path: Path, more: str, words: str) -> None:
    file = EVERY.write(tmp_path, "kind: instructions, text: 'Look at the pictures. '", PAIRS, more=more + "\n")
    report = CheckReport(file)
    try:
        check_screens(report, read_experiment(file), read_yaml(file))
    except InputError as error:
        report.errors.extend(error.findings)
    assert any(words in str(error) for error in report.errors), report.errors


def test_an_area_lies_about_its_place_and_type_is_a_pixel_high_at_least() -> None:
    area = text_area(Style((960, 1080)).text("Which?", 30, -40))
    assert area is not None
    assert abs(area.left + area.right - 60) <= 1
    assert abs(area.top + area.bottom + 80) <= 1
    assert Style((8, 9)).text("Which?").height_px == 1
