"""`cyclopean run`: whole sessions, resumed ones, and wrong input that leaves nothing behind."""

from __future__ import annotations

import json
import shlex
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from filelock import FileLock

from analysis.records import read_results, read_session, session_files
from analysis.report.notes import on_sessions
from documents.files import whole_file
from documents.files.chain import EMPTY, sealed
from runner.blocks import Draw
from runner.blocks.incomplete_pairs import PLACES, place_of
from runner.errors import SessionError, UsedCodeError
from runner.session import SessionOptions, run_session
from runner.session.folders import only_session
from tests.runner.every_kind import OnStatus

Study = Any  # tests/conftest.py


def _simulate(study: Study, *more: object, observer: str = "01", expect: int = 0) -> subprocess.CompletedProcess[str]:
    told: subprocess.CompletedProcess[str] = study.cyclopean(
        *("run", study.experiment, "--observer", observer, "--simulate", study.observers),
        *("--results", study.results, "--json", *more),
        expect=expect,
    )
    return told


def _answered(results: Path) -> list[tuple[str, str]]:
    (file,) = session_files(results)
    trials = [trial for trial in read_session(file).trials if trial.kind == "all_pairs"]
    return [(trial.details()["first"], trial.details()["second"]) for trial in trials]


def _cut(results: Path, lines: int) -> Path:
    (file,) = session_files(results)
    kept = file.read_bytes().split(b"\n")[:lines]
    file.write_bytes(b"\n".join(kept) + b"\n")
    return file


@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL")
def test_what_a_killed_session_left_of_a_draft_goes_with_the_observers_next_session(study: Study) -> None:
    left = study.results / "small" / "sub-01" / "ses-20260101T000000abcdefghij" / "session.jsonl"
    code = "import os, signal, sys; from pathlib import Path; from documents.files import whole_file\n"
    code += "with whole_file(Path(sys.argv[1])) as draft: draft.touch(); os.kill(os.getpid(), signal.SIGKILL)"
    with whole_file(left.with_name("page.html")) as ours:
        done = subprocess.run([sys.executable, "-c", code, str(left)], cwd=Path(__file__).parents[3], check=False)
        assert done.returncode == -signal.SIGKILL
        ours.touch()
        assert len(list(left.parent.iterdir())) == 2
        _simulate(study)
        assert list(left.parent.iterdir()) == [ours]


def _typed(study: Study, told: str, after: str) -> list[str]:
    """Return the words of the command that ``told`` says to type."""
    (line,) = (line for line in told.splitlines() if after in line)
    program, *words = shlex.split(line.partition(after)[2].strip())
    assert program == "cyclopean"
    return words


@pytest.mark.usefixtures("undrawn")
def test_a_second_session_is_refused_before_anything_is_drawn_and_what_it_says_to_type_works(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    from runner.session.station import Station

    study = replace(study, folder=study.folder.rename(study.folder.with_name("Ann's & Bob's study")))
    _simulate(study)
    log = _cut(study.results, 4)  # header, instructions, two pairs
    before = log.read_bytes()
    with monkeypatch.context() as patch:
        patch.setattr(Station, "open", lambda *_, **__: pytest.fail("a window was opened"))
        told = _simulate(study, expect=2)
        assert f"{log}: observer 01 has an unfinished session of 'small', with 2 answers, begun 20" in told.stderr
        with FileLock(log.parent / ".lock"):
            running = _simulate(study, expect=2)
        assert "another process is running" in running.stderr
        assert "--resume" not in running.stderr
    assert log.read_bytes() == before
    study.cyclopean(*_typed(study, told.stderr, "counts the answers of both), type:"))
    first, second = (read_session(file) for file in session_files(study.results))
    assert (first.complete, len(first.trials), second.complete) == (False, 3, True)
    report = study.cyclopean("report", study.results, "--no-thumbnails")
    assert "1 session was not completed" in report.stdout
    assert "8 comparisons" in report.stdout  # as the offer said
    (study.results / "small/sub-01" / second.file.parent.name).rename(study.folder / "apart")
    study.cyclopean(*_typed(study, told.stderr, "to resume it, type:"))
    assert read_session(log).complete
    _simulate(study, "--again")  # nothing is unfinished now


@pytest.mark.nightly
def test_a_session_that_stopped_before_its_first_answer_is_no_obstacle(study: Study) -> None:
    _simulate(study)
    _cut(study.results, 2)  # header, instructions
    assert json.loads(_simulate(study).stdout)["ending"] == "completed"


@pytest.mark.nightly
def test_many_simulated_observers_with_unfinished_sessions_are_named(study: Study) -> None:
    from runner.session import simulate

    folders = simulate(study.experiment, study.observers, 3, results=study.results).folders
    for folder in folders[1:]:
        file = folder / "session.jsonl"
        file.write_bytes(b"".join(file.read_bytes().splitlines(keepends=True)[:4]))
    with pytest.raises(SessionError, match=r"these observers have an unfinished session of 'small': 02, 03 .*--resume"):
        simulate(study.experiment, study.observers, 3, results=study.results)
    assert len(list(session_files(study.results))) == 3


def test_resuming_nothing_names_what_there_is(study: Study) -> None:
    told = _simulate(study, "--resume", expect=2)
    assert f"there is no folder {study.results}: is it another one, with --results?" in told.stderr
    _simulate(study)
    _simulate(study, observer="02")
    told = _simulate(study, "--resume", expect=2)
    assert "observer 01 has 1 session here" in told.stderr
    log = study.results / "small/sub-02"
    (file,) = session_files(log)
    file.write_bytes(b"".join(file.read_bytes().splitlines(keepends=True)[:5]))
    told = _simulate(study, "--resume", observer="3", expect=2)
    assert "of the observers 02 (3 answers)" in told.stderr
    study.edit("small.yaml", "name: small", "name: other")
    told = _simulate(study, "--resume", observer="02", expect=2)
    assert "observer 02 has an unfinished" in told.stderr
    assert "unfinished session of" not in _simulate(study, "--resume", observer="01", expect=2).stderr


def test_a_simulated_session_is_not_resumed_by_a_person_nor_the_other_way(study: Study) -> None:
    _simulate(study)
    _cut(study.results, 4)
    words = ("run", study.experiment, "--observer", "01", "--results", study.results, "--resume")
    assert "of a simulated observer" in study.cyclopean(*words, expect=2).stderr
    assert "give only one" in study.cyclopean(*words, "--new", expect=2).stderr


@pytest.mark.parametrize(
    ("file", "old", "new", "part"),
    [
        ("small.yaml", "question:", "qestion:", "small.yaml:5:1: unknown key 'qestion' (did you mean 'question'?)"),
        ("small.yaml", "[20, 10]", "[200, 10]", "small.yaml:6:42: two pictures of 800 x 40 px"),
        ("recipe.yaml", "one.exr", "none.exr", "recipe.yaml:4:23: the picture 'none.exr' cannot be read"),
        ("observers.yaml", "one: ", "onne: ", "observers.yaml:4:3: no score is given for one"),
    ],
)
def test_wrong_files_are_one_clear_message_and_nothing_is_written(
    study: Study, file: str, old: str, new: str, part: str
) -> None:
    study.edit(file, old, new)
    told = _simulate(study, expect=2)
    assert part in told.stderr
    assert "Traceback" not in told.stderr
    assert not study.results.exists()


def test_a_results_folder_that_cannot_be_made_is_refused(study: Study) -> None:
    study.results.write_text("a file stands where the folder should be")
    told = _simulate(study, expect=2)
    assert "results is no folder" in told.stderr


@pytest.mark.promise("measured-mode")
def test_an_uncharacterised_mode_is_refused_unless_allowed_and_then_marks_every_record(study: Study) -> None:
    study.edit("display.yaml", "  side-by-side:\n", "  quad-buffered:\n")
    study.edit("display.yaml", "  quad-buffered: {same_as: side-by-side}\n", "")
    assert "not characterised in the mode 'side-by-side'" in _simulate(study, expect=2).stderr
    told = _simulate(study, "--allow-uncharacterised")
    assert json.loads(told.stdout)["answered"] == 6
    assert "those of 'quad-buffered'" in told.stderr
    (file,) = session_files(study.results)
    log = read_session(file)
    assert log.header.display.characterised_as == "quad-buffered"
    assert any("not to be trusted" in remark for remark in log.header.remarks)
    assert all(trial.details()["uncharacterised"] is True for trial in log.trials)


def test_a_graphics_error_ends_the_session_with_everything_recorded(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a lost context does: the driver reports an error at the next draw."""
    from click.testing import CliRunner

    from runner.cli.main import group
    from runner.presenter import GraphicsError, Presenter

    show, drawn = Presenter.show, 0

    def fails_at_the_fifth(self: Presenter, scene: Any) -> float:
        nonlocal drawn
        drawn += 1
        if drawn == 5:
            raise GraphicsError("the graphics driver reports GL_CONTEXT_LOST (a renderer)")
        return show(self, scene)

    monkeypatch.setattr(Presenter, "show", fails_at_the_fifth)
    words = ["run", study.experiment, "--observer", "01", "--simulate", study.observers, "--results", study.results]
    result = CliRunner().invoke(group, [str(word) for word in words])
    assert isinstance(result.exception, GraphicsError)
    assert "Continue: cyclopean run" in str(result.exception)
    assert str(result.exception).endswith("--resume")
    (file,) = session_files(study.results)
    log = read_session(file)
    assert not log.complete
    assert len(log.answers) == 4  # the page and three pairs
    (note,) = log.notes
    assert note.by == "program"
    assert "GL_CONTEXT_LOST" in note.text
    monkeypatch.undo()
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(study.folder / "cache"))
    _simulate(study, "--resume")
    assert read_session(file).complete


def _resealed(file: Path, without: tuple[str, ...] = (), **header: Any) -> None:
    """Change the keys of a log's lines, with right checksums."""
    lines, before = [], EMPTY
    for number, text in enumerate(file.read_text("utf-8").splitlines(), start=1):
        record = {key: value for key, value in json.loads(text).items() if key not in ("line", "chain", *without)}
        line, before = sealed(record | (header if number == 1 else {}), number, before)
        lines.append(line + b"\n")
    file.write_bytes(b"".join(lines))


@pytest.mark.usefixtures("undrawn")
def test_an_old_session_is_resumed_and_replayed_in_its_old_order(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr("runner.session.station.Draw", lambda sitting: Draw(1, sitting))
        run_session(study.experiment, "02", SessionOptions(study.results, simulate=study.observers))
    (file,) = session_files(study.results)
    _resealed(file, without=("order_rule", "sitting"))  # as older versions wrote it
    old = _answered(study.results)
    _cut(study.results, 5)
    run_session(study.experiment, "02", SessionOptions(study.results, simulate=study.observers, resume=True))
    assert _answered(study.results) == old
    assert read_session(file).header.order_rule == 1
    run_session(study.experiment, "02", SessionOptions(study.folder / "replayed", replay=file))
    assert _answered(study.folder / "replayed") == old
    run_session(study.experiment, "02", SessionOptions(study.folder / "new", simulate=study.observers))
    assert _answered(study.folder / "new") != old


@pytest.mark.usefixtures("undrawn")
def test_one_observer_has_one_session_at_a_time_and_no_window_opens_over_it(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    from runner.session.station import Station

    twice: list[SessionError] = []
    options = SessionOptions(study.results, simulate=study.observers)
    opened: list[str] = []
    really = Station.open

    def open_(*given: Any, **named: Any) -> Station:
        opened.append("a window")
        return really(*given, **named)

    def begin(observer: str, **more: Any) -> None:
        with pytest.raises(SessionError, match="another process is running") as told:
            run_session(study.experiment, observer, replace(options, **more))
        twice.append(told.value)

    def meanwhile(*_: Any) -> None:
        if not twice:
            begin("01")
            begin("01", resume=True)
            begin("01", new=True)
            begin("01", replay=study.results, simulate=None)
            with only_session(study.results, "small", "02"):  # another observer may
                pass

    monkeypatch.setattr(Station, "open", open_)
    done = run_session(study.experiment, "01", replace(options, listeners=(OnStatus(meanwhile),)))
    assert (done.ending, len(twice), len(opened)) == ("completed", 4, 1)
    (file,) = session_files(study.results)
    assert read_session(file).complete
    assert not (study.results / "small" / "sub-02").exists()


@pytest.mark.usefixtures("undrawn")
def test_a_session_that_never_began_leaves_no_folder(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    from runner.session.station import Station

    def refuse(*_: Any, **__: Any) -> None:
        assert (study.results / "small" / "sub-01" / ".lock").exists()
        raise SessionError("no screen")

    monkeypatch.setattr(Station, "open", refuse)
    with pytest.raises(SessionError, match="no screen"):
        run_session(study.experiment, "01", SessionOptions(study.results, simulate=study.observers))
    assert not study.results.exists()


def _person(study: Study, monkeypatch: pytest.MonkeyPatch, answer: str | None, *more: str) -> Any:
    """Run `run --observer 88` as for a person who would not sit: what is asked is read, and no window opens."""
    from click.testing import CliRunner

    from runner.cli.main import group
    from runner.session.station import Station

    def never(*_: Any, **__: Any) -> None:
        raise SessionError("a window was opened")

    with monkeypatch.context() as patch:
        patch.setattr(Station, "open", never)
        patch.setattr("runner.session.console.at_a_terminal", lambda: answer is not None)
        words = ["run", str(study.experiment), "--observer", "88", "--results", str(study.results), *more]
        return CliRunner().invoke(group, words, input=answer)


def _sat(study: Study, observer: str, **more: Any) -> None:
    run_session(study.experiment, observer, SessionOptions(study.results, simulate=study.observers, **more))


@pytest.mark.usefixtures("undrawn")
def test_a_code_that_was_used_is_asked_about_before_a_window_opens(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = "a window was opened"
    assert opened in str(_person(study, monkeypatch, None).exception)  # nobody sat: no question
    _sat(study, "88")
    assert opened in str(_person(study, monkeypatch, None).exception)  # what was simulated is no person's
    (file,) = session_files(study.results)
    _resealed(file, simulated=False)
    refused = _person(study, monkeypatch, None).exception
    assert isinstance(refused, UsedCodeError)
    assert str(file) in str(refused)
    assert "with 6 answers" in refused.what
    assert "--observer 88" in str(refused)
    assert str(refused).endswith("--again")  # to be copied
    declined = _person(study, monkeypatch, "n\n")
    assert refused.what in declined.output
    assert isinstance(declined.exception, UsedCodeError)
    assert opened in str(_person(study, monkeypatch, "y\n").exception)
    assert opened in str(_person(study, monkeypatch, None, "--again").exception)
    assert len(list(session_files(study.results))) == 1


@pytest.mark.usefixtures("undrawn")
def test_a_further_sitting_has_an_order_of_its_own_the_other_sides_and_a_note_in_the_report(study: Study) -> None:
    _sat(study, "88")
    with pytest.raises(UsedCodeError, match="--again"):
        _sat(study, "88")
    with pytest.raises(UsedCodeError):
        _sat(study, "88", new=True)  # that is for what is unfinished
    _sat(study, "88", again=True)
    first, second = (read_session(file) for file in session_files(study.results))
    assert (first.header.sitting, second.header.sitting) == (1, 2)
    orders = [
        [(trial.details()["first"], trial.details()["second"]) for trial in log.trials if trial.kind == "all_pairs"]
        for log in (first, second)
    ]
    assert {(right, left) for left, right in orders[0]} == set(orders[1])
    assert [{*pair} for pair in orders[0]] != [{*pair} for pair in orders[1]]
    second.file.write_bytes(b"".join(second.file.read_bytes().splitlines(keepends=True)[:5]))
    _sat(study, "88", resume=True)  # in the order of its sitting
    resumed = read_session(second.file)
    pairs = [
        (trial.details()["first"], trial.details()["second"]) for trial in resumed.trials if trial.kind == "all_pairs"
    ]
    assert (pairs, resumed.header.sitting) == (orders[1], 2)
    run_session(study.experiment, "88", SessionOptions(study.folder / "replayed", replay=second.file))
    assert _answered(study.folder / "replayed") == orders[1]
    notes = " ".join(on_sessions([first, resumed]))
    assert f"Observer 88 has 2 sittings ({first.header.session}, {second.header.session})" in notes
    assert "sittings" not in " ".join(on_sessions([first]))


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
def test_codes_that_differ_in_leading_zeros_are_noted(study: Study) -> None:
    said: list[str] = []
    _sat(study, "1", notify=said.append)
    _sat(study, "10", notify=said.append)
    assert not any("somebody else" in line for line in said)
    _sat(study, "01", notify=said.append)
    assert sum("01 counts as somebody else" in line for line in said) == 1
    (note,) = (note for note in on_sessions(read_results(study.results)) if "leading zeros" in note)
    assert "The codes 01 and 1 differ" in note


def test_a_further_sitting_takes_other_pairs_of_an_incomplete_design() -> None:
    places = [place_of("7", sitting) for sitting in range(1, PLACES + 1)]
    assert (places[0], len(set(places))) == (place_of("7"), PLACES)
    assert not {place_of(str(number), 2) for number in range(1, 40)} & {place_of(str(n)) for n in range(1, 40)}
