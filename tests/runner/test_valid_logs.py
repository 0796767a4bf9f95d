"""Logs of unusual sessions are read as any other: what an observer can do is no damage."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from analysis.comparisons import grouped_comparisons
from analysis.errors import ResultsError
from analysis.kinds import Trial
from analysis.records import FILE_NAME, Change, Resumption, SessionLog, SessionTimes, pool, read_session
from analysis.seals import check_log
from runner.observers import plain_key
from runner.ports import Ask, Browse, KeyPress, Rate
from runner.session import Recorder, Session
from tests.answers import altered, changed, new_answer
from tests.runner.every_kind import HEADER, Stage, experiment, written

Read = Callable[[Path], Iterator[SessionLog]]


@pytest.fixture
def read(unchained: Callable[[Path], None]) -> Read:
    """Read a log as it was recorded, and without checksums as older versions recorded it."""

    def both(file: Path) -> Iterator[SessionLog]:
        assert check_log(file).findings == ()
        yield read_session(file)
        unchained(file)
        assert check_log(file).findings == ()
        yield read_session(file)

    return both


@dataclass
class Scripted:
    """Presses what is asked of it, or else the plainest answer, each so long after the onset."""

    press: Callable[[Ask], str | None] = lambda ask: None
    seconds: float = 1.0

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        return KeyPress(self.press(ask) or plain_key(ask), onset_s + self.seconds)


def record(folder: Path, block: str, observer: Scripted, more: str = "") -> Path:
    """Run a session of ``block``, in an experiment with ``more`` keys, and return its log."""
    design = experiment(folder, block, more=more)
    keys = {key: list(presses) for key, presses in design.spec.keys.items()}
    header = altered(HEADER, interface={"language": "en", "keys": keys} if keys else {})
    with Recorder.create(folder / "s", header) as recorder:
        Session(design.blocks("01"), Stage(), observer, recorder, style=design.style).run()
    return folder / "s" / FILE_NAME


def typing(characters: Iterable[str]) -> Scripted:
    keys = iter([*(f"text {character}" for character in characters), "enter"])
    return Scripted(lambda ask: next(keys))


@pytest.mark.parametrize(
    ("kind", "typed", "answer"),
    [
        ("number", "4917612345678", 4917612345678),
        ("number", "123456789012345678901234", 123456789012345678901234),
        ("number", "0.12345678901234567", 0.12345678901234566),
        ("number", "0.09999999999999999999999", 0.1),
        ("number", "12345678901234567.5", 12345678901234568.0),
        ("number", "-0", 0),
        ("text", "  é\u2028 😀 ", "é\u2028 😀"),
        ("text", ["\ud83d", "\ude00"], "😀"),
        ("text", ["\ud83d", "a"], "\N{REPLACEMENT CHARACTER}a"),
        ("text", ["e\u0301", "x"], "e\u0301x"),
    ],
)
def test_whatever_was_typed(kind: str, typed: Iterable[str], answer: Any, tmp_path: Path, read: Read) -> None:
    """Telephone numbers, more digits than a float keeps, and what keyboards send in parts."""
    block = f"kind: questionnaire, questions: [{{name: n, question: N, kind: {kind}}}]"
    for log in read(record(tmp_path, block, typing(typed))):
        assert [trial.details()["answer"] for trial in log.trials] == [answer]


def test_a_digit_may_accept_a_rating(tmp_path: Path, read: Read) -> None:
    """On a response box of digits, 0 in place of Enter."""
    turn = iter("12345" * 3)

    def press(ask: Ask) -> str:
        assert isinstance(ask.task, Rate)
        return next(turn) if ask.task.current is None else "0"

    scale = "{name: quality, question: How good, lowest: 1, highest: 5}"
    file = record(tmp_path, f"kind: rating, ratings: [{scale}]", Scripted(press), "keys: {enter: ['0']}\n")
    for log in read(file):
        assert [trial.details()["ratings"]["quality"] for trial in log.trials] == [1, 2, 3, 4, 5, 1]


def test_digits_may_move_the_marker(tmp_path: Path, read: Read) -> None:
    steps = iter(["2", "enter", "2", "2", "enter", "2", "1", "enter"] * 2)
    scale = "{name: quality, question: How good, lowest: -3, highest: -1}"
    file = record(
        tmp_path,
        f"kind: rating, ratings: [{scale}]",
        Scripted(lambda ask: next(steps)),
        "keys: {left: ['1'], right: ['2']}\n",
    )
    for log in read(file):
        assert [trial.details()["ratings"]["quality"] for trial in log.trials] == [-2, -1, -3] * 2


def test_one_button_may_go_on_and_choose(tmp_path: Path, read: Read) -> None:
    block = "kind: best_of_series, series: {one: [a, b, c], two: [d, e, f]}, start: first, ratings: []"
    button = Scripted(lambda ask: "x" if isinstance(ask.task, Browse) else None)
    for log in read(record(tmp_path, block, button, "keys: {right: [x], enter: [x]}\n")):
        assert [trial.details()["chosen_index"] for trial in log.trials] == [2, 2]


@pytest.mark.parametrize(
    ("kind", "variant"), [("all_pairs", 2), ("best_of_series", 0), ("best_of_series", 1), ("preference", 0)]
)
def test_presses_may_take_no_time(kind: str, variant: int, tmp_path: Path, read: Read) -> None:
    """Every press has the same time, so that presses can be told apart by nothing but their order."""
    for log in read(record(tmp_path, written(kind, variant), Scripted(seconds=0.0))):
        assert {seconds for trial in log.trials for _, seconds in trial.events} == {0.0}


def pair(number: int, first: str, second: str, **more: Any) -> Trial:
    """Return an answered pair; ``more`` replaces its fields."""
    data = {"first": first, "second": second, "answer": "first", "chosen": first, "rejected": second}
    data |= {"first_position": "top"}
    key, time_s, utc = (more.pop(name, usual) for name, usual in (("key", "up"), ("time_s", 1.0), ("utc", "")))
    utc = utc or f"2026-01-01T00:0{number + 1}:00.000+00:00"
    return new_answer(0, number, "all_pairs", ((key, time_s),), time_s, utc, data | more)


def write(folder: Path, *records: Any, header: Any = HEADER) -> Path:
    with Recorder.create(folder / "s", header) as recorder:
        for line in records:
            recorder.append(line)
        recorder.end({"work": {"pixels_shaded": 7 * 10**12}})
    return folder / "s" / FILE_NAME


ACCEPTED = Resumption(utc="2026-01-01T00:05:00.000+00:00", accepted_changes={"stimuli": Change(before="x", now="y")})
PLAIN = Resumption(utc="2026-01-01T00:05:00.000+00:00", accepted_changes={})


def test_the_clock_of_an_older_version_may_be_set(tmp_path: Path, read: Read) -> None:
    """Before clocks were steady, times ran back where the machine's clock was set, and trials took longer than that."""
    back = "2025-12-31T23:00:00.000+00:00"
    trials = (pair(0, "a", "b"), pair(1, "c", "a", utc=back, time_s=90.0), pair(2, "b", "c"))
    for log in read(write(tmp_path, *trials)):
        assert len(log.trials) == 3
        assert SessionTimes.of(log).moved_s > 0


def test_another_machine_may_state_other_costs_of_clipping(tmp_path: Path, read: Read) -> None:
    def costs(mean: float) -> dict[str, Any]:
        return {"left": {"percent_any": 1.0, "delta_e_00_mean": mean}}

    stimuli = tuple({**stimulus.given(), "clipping": costs(0.1)} for stimulus in HEADER.stimuli)
    header = altered(HEADER, stimuli=stimuli)
    other = pair(1, "b", "c", clipping={"b": costs(0.10000000000000002)})
    for log in read(write(tmp_path / "one", pair(0, "a", "b"), PLAIN, other, header=header)):
        assert log.trials[1].details()["clipping"]["b"]["left"]["delta_e_00_mean"] != 0.1
    with pytest.raises(ResultsError, match="clipping of 'b' is another"):
        read_session(write(tmp_path / "two", pair(0, "a", "b"), other, header=header))


def test_what_was_changed_and_accepted(tmp_path: Path, read: Read) -> None:
    """A recipe with another picture and other levels, and an experiment with other keys."""
    after = (
        pair(1, "g", "a", key="down"),
        pair(2, "b", "c", group="strand", group_factor="scene"),
    )
    for log in read(write(tmp_path / "one", pair(0, "a", "b"), ACCEPTED, *after)):
        assert log.header.stimulus_names == [*"abcdef", "g"]
        assert "g" in grouped_comparisons([log])[0].items
    for number, trial in enumerate(after):
        file = write(tmp_path / f"refused-{number}", pair(0, "a", "b"), PLAIN, changed(trial, trial=1))
        with pytest.raises(ResultsError, match=r"no stimulus of the|group is 'strand'"):
            read_session(file)


def test_any_whole_number_is_a_seed_and_digits_of_a_date_are_a_level(tmp_path: Path, read: Read) -> None:
    level = 20260131123000.0
    stimuli = tuple({**stimulus.given(), "factors": {"taken": level}} for stimulus in HEADER.stimuli)
    file = write(tmp_path, pair(0, "a", "b"), header=altered(HEADER, seed=10**23, stimuli=stimuli))
    for log in read(file):
        assert (log.header.seed, log.header.stimuli[0].factors["taken"]) == (10**23, level)


def test_only_without_checksums_are_presses_compared(tmp_path: Path, unchained: Callable[[Path], None]) -> None:
    """What is concluded from presses refuses no line that is as it was recorded."""
    file = write(tmp_path, pair(0, "a", "b", key="down"))
    assert check_log(file).findings == ()
    assert len(read_session(file).trials) == 1
    unchained(file)
    with pytest.raises(ResultsError, match="the key 'down' means 'second'"):
        read_session(file)
    assert json.loads(file.read_bytes().splitlines()[1])["events"] == [["down", 1.0]]


def test_the_key_of_a_vision_test_has_one_meaning_too(tmp_path: Path, unchained: Callable[[Path], None]) -> None:
    file = record(tmp_path, "kind: screening, tests: [{test: near_acuity, pass_logmar: 0.3}]", Scripted())
    unchained(file)
    assert check_log(file).findings == ()
    lines = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
    shown = [line for line in lines if "correct_answer" in line]
    other = next(line["answer"] for line in shown if line["answer"] != shown[0]["answer"])
    shown[0]["answer"] = shown[0]["correct_answer"] = other
    file.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")
    assert check_log(file).findings


@pytest.mark.parametrize(
    "further", ['"catcg":"obvious"', '"clipping":{"a":{"left":{"percent_rad":1.0}}}'], ids=["pair", "within"]
)
def test_a_further_field_a_letter_from_a_missing_one_is_no_field(
    tmp_path: Path, unchained: Callable[[Path], None], further: str
) -> None:
    file = write(tmp_path, pair(0, "a", "b"))
    unchained(file)
    plain, at = file.read_text(encoding="utf-8"), '"first_position":'
    file.write_text(plain.replace(at, f"{further},{at}"), encoding="utf-8")
    with pytest.raises(ResultsError, match="a letter away"):
        read_session(file)
    other = further.replace("catcg", "note").replace("percent_rad", "note")
    file.write_text(plain.replace(at, f"{other},{at}"), encoding="utf-8")
    assert len(read_session(file).trials) == 1


def test_a_code_that_a_person_has_too_is_told_apart_and_kept(tmp_path: Path) -> None:
    logs = [
        read_session(write(tmp_path / str(simulated), pair(0, "a", "b"), header=altered(HEADER, simulated=simulated)))
        for simulated in (False, True)
    ]
    person, simulated = pool(logs, with_simulated=True).sessions
    code = HEADER.observer
    assert (person.header.observer, simulated.header.observer) == (code, f"{code} (simulated)")
    assert simulated.recorded_as == code
    assert pool(logs).sessions == (logs[0],)
