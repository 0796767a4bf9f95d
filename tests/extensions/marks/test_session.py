"""Marks of a session: the bytes that come out, what the record says of them, and ports that fail."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from analysis.records import SessionLog, read_session, session_files
from analysis.seals import check_results
from devices.timing_marks import MARKS
from documents import Finding, InputError
from documents.platform import pseudo_terminal
from extensions.marks import LslMarksSpec, Marked, MarkError, OpenMarks, PortLostError, SerialMarksSpec, TimingMarks
from runner.check import CheckOptions, check_file
from runner.session import Recording, SceneShown, SessionOptions, run_session, simulate
from runner.session.events import Shown
from tests.kept import known
from tests.runner.every_kind import OnStatus

Study = Any  # tests/conftest.py
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals")

SCREENS = 1 + 6 + 1  # the instructions, the pairs, and the break after four, which has no record of its own
RECORDS = 7


def with_marks(study: Study, *entries: str) -> None:
    study.edit("rig.yaml", "distance_mm: 700", f"distance_mm: 700\ntiming_marks: [{', '.join(entries)}]")


def whole(read: Callable[[float], bytes], within_s: float) -> bytes:
    """Return all that was sent: bytes come in pieces."""
    return read(within_s) + b"".join(iter(lambda: read(0.1), b""))


@contextmanager
def serial_line(study: Study, more: str = "") -> Iterator[tuple[str, Callable[[float], bytes]]]:
    """Let the rig send its marks to a pseudo-terminal."""
    with pseudo_terminal() as pair:
        name, read = known(pair)
        with_marks(study, f"{{kind: serial, port: {name}{more}}}")
        yield name, partial(whole, read)


def run(study: Study, **more: Any) -> tuple[SessionLog, list[str]]:
    said: list[str] = []
    options = SessionOptions(
        study.results, **{"simulate": study.observers, "marks": True, "notify": said.append} | more
    )
    run_session(study.experiment, "01", options)
    (file,) = session_files(study.results)
    return read_session(file), said


def marks_of(log: SessionLog) -> list[dict[str, Any]]:
    return [mark for trial in log.trials for mark in trial.details().get("timing_marks", [])]


def test_each_onset_and_answer_is_a_byte_and_stands_in_its_trial(study: Study) -> None:
    with serial_line(study, ", onset: 17, answer: 34") as (port, read):
        log, said = run(study)
        assert read(5.0) == bytes([17, 34]) * SCREENS
    assert said == []
    assert len(log.trials) == RECORDS
    for trial in log.trials:
        *page, onset, answer = trial.details()["timing_marks"]
        assert [mark["mark"] for mark in page] == (["onset", "answer"] if trial.place == (1, 4) else [])
        assert onset == onset | {"port": f"serial {port}", "mark": "onset", "code": 17}
        assert answer == answer | {"port": f"serial {port}", "mark": "answer", "code": 34}
        assert 0.0 < onset["after_ms"] < 10_000.0
        # A simulated answer is given at once, and its press is as long after the onset as a person would take.
        taken_ms = 1000.0 * (answer["sent_s"] - onset["sent_s"]) + onset["after_ms"]
        assert answer["after_ms"] == pytest.approx(taken_ms - 1000.0 * trial.response_time_s, abs=0.1)  # of two clocks
    sent = [mark["sent_s"] for mark in marks_of(log)]
    assert sent == sorted(sent)
    assert sent[0] > 0.0
    assert sent[-1] < 600.0
    assert log.header.presentation.timing_marks == [
        {"kind": "serial", "port": port, "baud": 115200, "onset": 17, "answer": 34, "pulse_ms": None}
        | {"codes": {}, "trial_byte": False}
    ]
    assert [check.findings for check in check_results(study.results).logs] == [()]


def test_a_simulation_sends_none_unless_asked(study: Study) -> None:
    with serial_line(study) as (_, read):
        log, said = run(study, marks=None)
        simulate(study.experiment, study.observers, ["02"], results=study.results)
        assert read(0.05) == b""
    assert (marks_of(log), said, log.header.remarks) == ([], [], ())
    assert "timing_marks" not in log.header.presentation.given()


def test_a_session_without_its_marks_says_so(study: Study) -> None:
    with_marks(study, "{kind: serial, port: /dev/no_such_port}")
    log, said = run(study, marks=False)
    words = "the rig's timing marks were not sent (--no-marks)"
    assert words in log.header.remarks
    assert f"warning: {words}" in said


def test_events_without_a_code_send_nothing(study: Study) -> None:
    with serial_line(study, ", onset: null") as (_, read):
        log, _ = run(study)
        assert read(5.0) == bytes([2]) * SCREENS
    assert {mark["mark"] for mark in marks_of(log)} == {"answer"}


FAULTS = {
    "{kind: serial, port: /dev/no_such_port}": (5, "serial /dev/no_such_port: there is no such serial port"),
    "{kind: parallel, port: /dev/parport9}": (5, "parallel /dev/parport9: there is no such parallel port"),
    "{kind: lsl}": (5, "lsl cyclopean: marks on LSL need the package pylsl, which is not installed"),
}


@pytest.mark.parametrize("entry", FAULTS)
def test_a_port_that_cannot_be_opened_is_refused_before_anything_is_written(
    study: Study, entry: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pylsl", None)
    with_marks(study, entry)
    told = study.run("--marks", expect=2)
    line, what = FAULTS[entry]
    assert told.stderr.splitlines()[-1].startswith(f"error: {study.folder / 'rig.yaml'}:{line}:")
    assert what in told.stderr
    assert told.stderr.rstrip().endswith(")")  # the remedy
    assert not study.results.exists()
    told = study.cyclopean("check", study.folder / "rig.yaml")
    assert f"warning: {study.folder / 'rig.yaml'}:{line}:" in told.stdout
    assert what in told.stdout
    assert study.cyclopean("check", study.folder / "rig.yaml", "--no-screen").stdout.count(what) == 0


def test_a_port_in_use_is_refused_and_the_others_are_closed_again(study: Study) -> None:
    with pseudo_terminal() as one, pseudo_terminal() as other_one:
        first, second = known(one), known(other_one)
        with_marks(study, *(f"{{kind: serial, port: {name}}}" for name, _ in (first, second)))
        other = SerialMarksSpec(kind="serial", port=second[0]).open_port()
        with pytest.raises(InputError, match=rf"rig.yaml:5:.*serial {second[0]}: .*in use by another program"):
            run(study)
        other.close()
        log, _ = run(study)
        assert whole(first[1], 5.0) == whole(second[1], 5.0) == bytes([1, 2]) * SCREENS
    assert [mark["port"] for mark in log.trials[0].details()["timing_marks"]] == [
        f"serial {name}" for name in (first[0], second[0])
    ] * 2


def test_ports_before_one_that_cannot_be_opened_are_closed(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    with_marks(study, "{kind: serial, port: COM7}", "{kind: serial, port: COM8}")
    port = Failing({})

    def open_first(spec: SerialMarksSpec) -> Failing:
        if spec.port == "COM8":
            raise MarkError(Finding("there is no such serial port", "COM8"))
        return port

    monkeypatch.setattr(SerialMarksSpec, "open_port", open_first)
    with pytest.raises(MarkError, match="serial COM8: "):
        run(study)
    assert port.closed


WRONG = (
    *(
        "{kind: usb}",
        "{kind: serial}",
        "{kind: serial, port: COM3, onset: 256}",
        "{kind: serial, port: COM3, onset: 0}",
    ),
    *("{kind: parallel, pulse_ms: 0}", "{kind: lsl, baud: 9600}", "{kind: lsl, onset: 1}", "{kind: lsl, wait_s: -1}"),
    "{kind: serial, port: COM3, codes: {light=sun: 3}}",
    "{kind: serial, port: COM3, codes: {block=1: 0}}",
    "{kind: lsl, codes: {block=1: 3}}",
    "[{kind: serial, port: COM3}, {kind: serial, port: COM3, onset: 4}]",
    *("[]", "COM3"),
)


@pytest.mark.parametrize("entry", WRONG)
def test_wrong_entries_are_located(study: Study, entry: str) -> None:
    study.edit("rig.yaml", "distance_mm: 700", f"distance_mm: 700\ntiming_marks: {entry}")
    (error,) = check_file(study.folder / "rig.yaml", CheckOptions(screen=False)).errors
    assert (error.file, error.line) == (str(study.folder / "rig.yaml"), 5)


def test_a_missing_extension_is_named(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    with_marks(study, "{kind: lsl}")
    monkeypatch.setattr(MARKS, "_loaded", {})
    monkeypatch.setitem(sys.modules, "extensions.marks.lsl", None)
    (broken,) = check_file(study.folder / "rig.yaml", CheckOptions(screen=False)).errors
    assert "extensions.marks.lsl does not load" in broken.message
    assert known(broken.remedy).endswith("install cyclopean again")


@pytest.mark.parametrize(
    ("more", "told"), [("", ""), (", trial_byte: true", ", after each a byte with the trial's number")]
)
def test_check_names_the_ports_and_their_codes(study: Study, more: str, told: str) -> None:
    with serial_line(study, f", answer: null{more}"):
        (facts,) = json.loads(study.cyclopean("check", study.experiment, "--json", "--no-pictures").stdout)
    assert len(facts["timing_marks"]) == 1
    assert facts["timing_marks"][0].endswith(f" (onset = 1{told})")
    assert not [fault for fault in facts["warnings"] if "serial" in fault["message"]]


@dataclass(slots=True)
class Failing:
    """A port that takes marks until ``faults`` has another one at their number."""

    faults: dict[int, MarkError]
    sent: int = 0
    closed: bool = False
    is_heard: bool = True

    def send(self, code: int | str, event_s: float, trial_byte: int | None = None) -> None:
        self.sent += 1
        if fault := self.faults.get(self.sent):
            raise fault

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def opened(study: Study, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Let the rig have one entry, which opens a port that is given."""

    def prepare(port: Any, entry: str = "{kind: serial, port: COM7}") -> Any:
        with_marks(study, entry)
        for kind in (LslMarksSpec, SerialMarksSpec):
            monkeypatch.setattr(kind, "open_port", lambda spec: port)
        return port

    return prepare


def test_a_port_lost_in_mid_session_costs_its_marks_and_no_answer(study: Study, opened: Any) -> None:
    port = opened(Failing({6: PortLostError(Finding("the port is gone: pulled out", "COM7"))}))
    log, said = run(study)
    assert log.complete
    assert len(log.trials) == RECORDS
    assert port.sent == 6  # it is not tried again
    assert port.closed
    marks = marks_of(log)
    assert len(marks) == 2 * SCREENS
    assert ["sent_s" in mark for mark in marks] == [True] * 5 + [False] * (2 * SCREENS - 5)
    assert {mark["failed"] for mark in marks[5:]} == {"the port is gone: pulled out"}
    (note,) = log.notes
    assert (note.by, note.block, note.trial) == ("program", 1, 1)
    assert "COM7: the port is gone: pulled out" in note.text
    assert ["11 timing marks were not sent" in line for line in said] == [True]


def test_a_port_that_blocks_is_tried_again(study: Study, opened: Any) -> None:
    full = MarkError(Finding("the port takes no more bytes: nothing reads them", "COM7"))
    opened(Failing({4: full, 5: full, 9: full}))
    log, said = run(study)
    assert log.complete
    failed = [number for number, mark in enumerate(marks_of(log), start=1) if "failed" in mark]
    assert failed == [4, 5, 9]
    why = "the port takes no more bytes: nothing reads them"
    lost, *again = (note.text for note in log.notes)
    assert f"COM7: {why}; the next is tried" in lost
    assert ["COM7 again, after 2" in again[0], "COM7 again, after 1" in again[1]] == [True, True]
    assert ["3 timing marks were not sent" in line for line in said] == [True]


def test_the_experimenter_is_told_in_the_line_of_the_session(study: Study, opened: Any) -> None:
    opened(Failing({3: MarkError(Finding("full", "COM7"))}))
    lines: list[str] = []
    run(study, listeners=(OnStatus(lambda status: lines.append(status.line())),))
    told = ["CHECK: timing marks" in line for line in lines]
    assert told == [False, True] + [False] * (RECORDS - 2)


def test_a_resumed_session_goes_on_with_its_marks(study: Study) -> None:
    with serial_line(study) as (port, read):
        log, _ = run(study)
        assert read(5.0) == bytes([1, 2]) * SCREENS
        lines = log.file.read_bytes().splitlines(keepends=True)
        log.file.write_bytes(b"".join(lines[:5]) + lines[5][:200])  # killed while the fifth trial was written
        resumed, said = run(study, resume=True)
        assert said == []
        assert read(5.0) == bytes([1, 2]) * (SCREENS - 4)
    assert resumed.complete
    assert len(resumed.trials) == RECORDS
    assert len(marks_of(resumed)) == 2 * SCREENS
    kept, new = marks_of(resumed)[:8], marks_of(resumed)[8:]
    assert kept == marks_of(log)[:8]
    assert new[0]["sent_s"] > kept[-1]["sent_s"]  # one clock
    assert {mark["port"] for mark in new} == {f"serial {port}"}


@pytest.mark.nightly
def test_a_replay_sends_its_own_marks_if_asked(study: Study) -> None:
    with serial_line(study) as (_, read):
        log, _ = run(study)
        assert read(5.0) == bytes([1, 2]) * SCREENS
        recorded = log.file.read_bytes()
        for marks, expected in ((None, b""), (True, bytes([1, 2]) * SCREENS)):
            options = SessionOptions(study.folder / f"again_{marks}", replay=log.file, marks=marks)
            assert run_session(study.experiment, "01", options).ending == "completed"
            assert read(0.5) == expected
    assert log.file.read_bytes() == recorded


def test_marks_are_checked_when_a_log_is_read(study: Study, unchained: Callable[[Path], None]) -> None:
    with serial_line(study):
        log, _ = run(study)
    unchained(log.file)
    text = log.file.read_text()
    assert check_results(log.file).findings == ()
    for old, new, why in (
        ('"mark":"onset"', '"mark":"offset"', "'timing_marks.0.mark' is \"offset\""),
        ('"after_ms":', '"after":', "should have either 'sent_s' and 'after_ms' or 'failed'"),
        ('"sent_s":', '"failed":"gone","sent_s":', "should have either"),
        ('"code":1,', '"code":-1,', "'timing_marks.0.code"),
    ):
        log.file.write_text(text.replace(old, new, 1))
        assert why in check_results(log.file).findings[0].message


def test_the_export_describes_the_marks(study: Study) -> None:
    from extensions.bids import export_dataset

    with serial_line(study) as (port, _):
        run(study)
    folder = study.folder / "bids"
    export_dataset([study.results], folder)
    (table,) = folder.rglob("*_beh.tsv")
    heads, *rows = [line.split("\t") for line in table.read_text().splitlines()]
    column = heads.index("timing_marks")
    assert all(json.loads(row[column])[0]["mark"] == "onset" for row in rows)
    (columns,) = folder.glob("task-*_beh.json")
    assert "from the start of the session" in json.loads(columns.read_text())["timing_marks"]["Description"]
    (sidecar,) = folder.rglob("sub-*_beh.json")
    assert json.loads(sidecar.read_text())["GraphicsSystem"]["timing_marks"][0]["port"] == port


@pytest.mark.usefixtures("undrawn")
@pytest.mark.nightly
def test_the_report_counts_trials_without_their_marks(study: Study, opened: Any) -> None:
    opened(Failing({5: MarkError(Finding("full", "COM7")), 6: MarkError(Finding("full", "COM7"))}))
    run(study)
    study.cyclopean("report", study.results, "--no-thumbnails")
    page = " ".join((study.results / "report.html").read_text().split())
    assert "Timing marks were not sent in 1 trial" in page


def test_timed_scenes_are_marked_by_name(study: Study) -> None:
    study.edit("small.yaml", "break_every: 4", "fixation_s: 0.1, exposure_s: 0.2")
    with serial_line(study) as (_, read):
        log, _ = run(study)
        assert read(5.0) == b"\x01\x02" + 6 * b"\x01\x01\x01\x02"
    for trial in log.trials[1:]:
        scenes = [(mark["mark"], mark.get("scene")) for mark in trial.details()["timing_marks"]]
        assert scenes == [("onset", "fixation"), ("onset", "pair"), ("onset", None), ("answer", None)]
        assert [timed["what"] for timed in trial.details()["timed"]] == ["fixation", "pair"]


@pytest.fixture
def sunny(study: Study) -> Study:
    """The study, in which two of the four pictures have a level of a factor in common."""
    for name in ("one", "two"):
        study.edit("recipe.yaml", f"file: {name}.exr}}", f"file: {name}.exr, factors: {{light: sun}}}}")
    return study


def test_codes_by_condition_and_a_byte_of_the_trial(sunny: Study) -> None:
    codes = '{"condition.light=sun": 11, "event=answer": 12, "stimuli=four event=onset": 13}'
    with serial_line(sunny, f", codes: {codes}, trial_byte: true") as (_, read):
        log, _ = run(sunny)
        sent = list(read(5.0))
        assert sent == [byte for mark in marks_of(log) for byte in (mark["code"], mark["trial_byte"])]
        log.file.write_bytes(b"".join(log.file.read_bytes().splitlines(keepends=True)[:5]))
        resumed, _ = run(sunny, resume=True)
        assert list(read(5.0)) == sent[-len(sent) + 2 * len([m for trial in log.trials[:4] for m in marks_in(trial)]) :]
    assert marks_of(resumed)[-1]["trial_byte"] == RECORDS - 1
    for done, trial in enumerate(log.trials[1:], start=1):
        shown = {trial.details()["first"], trial.details()["second"]}
        onset = 11 if shown == {"one", "two"} else 13 if "four" in shown else 1
        assert [(mark["code"], mark["trial_byte"]) for mark in marks_in(trial)[-2:]] == [(onset, done), (12, done)]
    assert marks_of(log)[0]["code"] == 1  # the instructions
    assert [check.findings for check in check_results(sunny.results).logs] == [()]


def marks_in(trial: Any) -> list[dict[str, Any]]:
    return list(trial.details()["timing_marks"])


@dataclass(slots=True)
class Stream:
    """A stream that is received from the mark number ``heard_from`` on, or from so many looks on before any mark."""

    heard_from: int
    looks: int = -1
    texts: list[str] = field(default_factory=list)

    @property
    def is_heard(self) -> bool:
        self.looks -= 1
        return len(self.texts) + 1 >= self.heard_from if self.texts or self.looks < -1 else self.looks == -1

    def send(self, code: int | str, event_s: float, trial_byte: int | None = None) -> None:
        self.texts.append(str(code))

    def close(self) -> None:
        pass


def values(text: str) -> dict[str, str]:
    return dict(pair.split("=") for pair in text.split())


def test_a_stream_that_nobody_receives_is_waited_for_and_then_warned_of(study: Study, opened: Any) -> None:
    opened(Stream(10_000), "{kind: lsl, wait_s: 0.2}")
    began_s = time.monotonic()
    log, said = run(study)
    assert time.monotonic() - began_s >= 0.2
    assert log.complete
    assert len(said) == 3  # what is waited for, that nobody came, and how many were lost
    assert [remark in said[1] for remark in log.header.remarks] == [True]
    assert {"failed" in mark for mark in marks_of(log)} == {True}
    assert [check.findings for check in check_results(study.results).logs] == [()]


def test_a_recorder_that_comes_in_time_ends_the_waiting_and_is_no_remark(study: Study, opened: Any) -> None:
    stream = opened(Stream(0, looks=4), "{kind: lsl, wait_s: 600}")
    log, said = run(study)
    assert len(said) == 1
    assert log.header.remarks == ()
    assert ["failed" in mark for mark in marks_of(log)] == [False] * 2 * SCREENS
    assert stream.texts == [mark["code"] for mark in marks_of(log)]


def test_a_recording_that_began_late_is_joined_by_trial(sunny: Study, opened: Any) -> None:
    stream = opened(Stream(6), "{kind: lsl, wait_s: 0, onset: my onset}")
    log, _ = run(sunny)
    received = [values(text) for text in stream.texts[5:]]
    assert [("failed" in mark, mark["code"]) for mark in marks_of(log)] == [
        (number < 5, text) for number, text in enumerate(stream.texts)
    ]
    trials = {trial.place: trial for trial in log.trials}
    for mark in received:
        trial = trials[int(mark["block"]), int(mark["trial"])]
        assert mark["event"] in ("my%20onset", "answer")
        if "stimuli" in mark:
            first, second = trial.details()["first"], trial.details()["second"]
            assert set(mark["stimuli"].split(",")) == {first, second}
            assert (mark.get("condition.light") == "sun") == ({first, second} == {"one", "two"})
    onsets = [mark for mark in received if mark["event"] != "answer" and "stimuli" in mark]
    assert {(int(mark["block"]), int(mark["trial"])) for mark in onsets} == {t.place for t in log.trials[3:]}


class Connecting(Failing):
    """A stream to which a recorder connects while the first mark is sent."""

    def send(self, code: int | str, event_s: float, trial_byte: int | None = None) -> None:
        self.is_heard = True


def test_a_recorder_that_connects_while_a_mark_is_sent_has_not_received_it() -> None:
    marks = OpenMarks(LslMarksSpec(kind="lsl"), Connecting({}, is_heard=False))
    rows = [marks.send(Marked("onset", 0, number), 1.0, number) for number in range(3)]
    assert ["failed" in row for row in rows if row] == [True, False, False]
    assert marks.lost_in_all == 1


@pytest.mark.parametrize(
    ("entry", "heard_after", "warned"),
    [
        ("{kind: lsl, wait_s: 0}", 10_000, True),
        ("{kind: lsl, wait_s: 0}", 3, False),  # a recorder that finds the stream again takes a moment
        ("{kind: lsl, wait_s: 0}", 0, False),
        ("{kind: lsl}", 10_000, False),  # the session waits, and warns itself
        ("{kind: serial, port: COM7}", 0, False),
    ],
)
def test_check_warns_of_a_stream_that_nobody_receives_and_no_session_waits_for(
    study: Study, opened: Any, monkeypatch: pytest.MonkeyPatch, entry: str, heard_after: int, warned: bool
) -> None:
    looks = iter(range(1_000_000))
    monkeypatch.setattr(
        Failing, "is_heard", property(lambda port: next(looks) >= heard_after, lambda port, heard: None)
    )
    monkeypatch.setattr("extensions.marks.session._RECEIVED_WITHIN_S", 0.3)
    opened(Failing({}), entry)
    told = study.cyclopean("check", study.folder / "rig.yaml").stdout
    warnings = [line for line in told.splitlines() if "nobody receives" in line]
    assert len(warnings) == warned
    assert all(f"{study.folder / 'rig.yaml'}:5:" in line and "wait_s" in line for line in warnings)


def test_a_trial_that_is_asked_once_more_says_so() -> None:
    again = Marked("answer", 1, 4, attempt=1, timed="pair", condition={"lamp %": "a=b, c"})
    assert values(again.text)["attempt"] == "1"
    assert values(again.text)["condition.lamp%20%25"] == "a%3Db%2C%20c"
    rules = ("attempt=1", "timed=pair trial=4", "condition.lamp%20%25=a%3Db%2C%20c")
    assert all(again.fits(f"event=answer {rule}") for rule in rules)
    assert not any(again.fits(rule) for rule in ("attempt=1", "event=answer attempt=0", "event=answer stimuli=a"))


def test_an_onset_is_marked_once_however_often_its_scene_is_asked() -> None:
    port = Failing({})
    opened = OpenMarks(SerialMarksSpec(kind="serial", port="COM7"), port)
    marks = TimingMarks((opened,), lambda: 5.0, {}, lambda words, by: None)
    for onset_s in (1.0, 1.0, 2.0):
        marks.hear(SceneShown(Shown(0, 0, 0, "", (), 0), onset_s))
    marks.hear(recording := Recording(0, ()))
    assert len(recording.data["timing_marks"]) == port.sent == 2
