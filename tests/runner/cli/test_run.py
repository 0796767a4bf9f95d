"""`cyclopean run`: whole sessions, resumed ones, and wrong input that leaves nothing behind."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from analysis.records.session_record import read_session, session_files

Study = Any  # tests/conftest.py


def _simulate(study: Study, *more: object, observer: str = "01", expect: int = 0) -> subprocess.CompletedProcess[str]:
    told: subprocess.CompletedProcess[str] = study.cyclopean(
        *("run", study.experiment, "--observer", observer, "--simulate", study.observers),
        *("--results", study.results, "--json", *more),
        expect=expect,
    )
    return told


def test_a_simulated_session_records_every_pair_with_its_facts(study: Study) -> None:
    done = json.loads(_simulate(study).stdout)
    assert (done["ending"], done["answered"], done["trials"]) == ("completed", 6, 6)
    (file,) = session_files(study.results)
    log = read_session(file)
    assert log.complete
    assert log.header.simulated
    assert log.header.display["mode"] == "side-by-side"
    assert set(log.header.hashes) == {"experiment", "stimuli", "display", "rig"}
    assert log.header.presentation["backend"] == "egl"
    pairs = [trial for trial in log.trials if trial.kind == "all_pairs"]
    assert len({frozenset((t.data["first"], t.data["second"])) for t in pairs}) == 6
    for trial in pairs:
        for name in (trial.data["first"], trial.data["second"]):
            assert {"left", "right"} == set(trial.data["clipping"][name])
            assert 0 <= trial.data["clipping"][name]["left"]["percent_any"] <= 100


def test_two_observers_meet_the_same_pairs_in_other_orders(study: Study) -> None:
    for observer in ("02", "03"):
        _simulate(study, observer=observer)
    orders = []
    for file in session_files(study.results):
        trials = [trial for trial in read_session(file).trials if trial.kind == "all_pairs"]
        orders.append([(trial.data["first"], trial.data["second"]) for trial in trials])
    assert orders[0] != orders[1]
    # Observers 2 and 3 share an orientation and take opposite sides of it.
    assert {(second, first) for first, second in orders[0]} == set(orders[1])


def _answered(results: Path) -> list[tuple[str, str]]:
    (file,) = session_files(results)
    trials = [trial for trial in read_session(file).trials if trial.kind == "all_pairs"]
    return [(trial.data["first"], trial.data["second"]) for trial in trials]


def _cut(results: Path, lines: int) -> Path:
    (file,) = session_files(results)
    kept = file.read_bytes().split(b"\n")[:lines]
    file.write_bytes(b"\n".join(kept) + b"\n")
    return file


def test_resume_continues_where_the_session_stopped(study: Study) -> None:
    _simulate(study)
    whole = _answered(study.results)
    _cut(study.results, 5)  # header, instructions, three pairs
    assert _answered(study.results) == whole[:3]
    done = json.loads(_simulate(study, "--resume").stdout)
    assert done["answered"] == 6
    assert _answered(study.results) == whole
    told = _simulate(study, "--resume", expect=2)
    assert "there is no unfinished session to resume" in told.stderr


@pytest.mark.parametrize(
    ("file", "old", "new", "changed"),
    [
        ("small.yaml", "break_every: 4", "break_every: 3", "experiment"),
        ("display.yaml", "gamma: 2.3", "gamma: 2.4", "display"),
        ("rig.yaml", "distance_mm: 700", "distance_mm: 600", "rig"),
        ("recipe.yaml", "name: four, file: four.exr", "name: four, file: three.exr", "stimuli"),
    ],
)
def test_resume_is_refused_when_something_changed(study: Study, file: str, old: str, new: str, changed: str) -> None:
    _simulate(study)
    log = _cut(study.results, 4)
    before = log.read_bytes()
    study.edit(file, old, new)
    told = _simulate(study, "--resume", expect=2)
    assert f"the {changed} changed since this session began" in told.stderr
    assert log.read_bytes() == before


def test_accepted_changes_are_recorded_and_the_session_continues(study: Study) -> None:
    _simulate(study)
    log = _cut(study.results, 4)
    study.edit("display.yaml", "gamma: 2.1", "gamma: 2.15")
    _simulate(study, "--resume", "--accept-changes")
    whole = read_session(log)
    assert whole.complete
    (resumption,) = whole.resumptions
    assert set(resumption.accepted_changes) == {"display"}
    change = resumption.accepted_changes["display"]
    assert change["before"] == whole.header.hashes["display"] != change["now"]


def test_a_change_of_the_trials_already_answered_is_refused_even_if_accepted(study: Study) -> None:
    _simulate(study)
    log = _cut(study.results, 4)
    answers = read_session(log).answers
    study.edit("small.yaml", "break_every: 4", "stimuli: [one, two, three]")
    told = _simulate(study, "--resume", "--accept-changes", expect=2)
    assert "is not the one the experiment now asks" in told.stderr
    assert read_session(log).answers == answers


@pytest.mark.parametrize(
    ("file", "old", "new", "part"),
    [
        ("small.yaml", "question:", "qestion:", "small.yaml:5:1: unknown key 'qestion' (did you mean 'question'?)"),
        ("small.yaml", "recipe.yaml", "recipes.yaml", "small.yaml:4:10: there is no such file: recipes.yaml"),
        ("small.yaml", "rig.yaml", "rigs.yaml", "small.yaml:3:6: there is no such file: rigs.yaml"),
        ("small.yaml", "[20, 10]", "[200, 10]", "small.yaml:6:42: two pictures of 800 x 40 px"),
        (
            "small.yaml",
            "{kind: all_pairs, ",
            "{kind: all_pairs, stimuli: [one, tow], ",
            "small.yaml:9:38: the recipe makes no stimulus 'tow' (did you mean 'two'?)",
        ),
        ("rig.yaml", "side-by-side", "flat", "rig.yaml:3:7: the display was not characterised in the mode 'flat'"),
        ("display.yaml", "gamma: 2.1", "gama: 2.1", "did you mean 'gamma'?"),
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


@pytest.mark.parametrize("observer", ["../02", "a b", "", "sub-01", "é", "x" * 65, "01\n"])
def test_an_observer_id_that_is_no_label_is_refused(study: Study, observer: str) -> None:
    told = _simulate(study, observer=observer, expect=2)
    assert "is no BIDS label" in told.stderr
    assert not study.results.exists()


def test_a_picture_with_nan_is_refused_with_view_and_count(study: Study) -> None:
    oiio = pytest.importorskip("OpenImageIO")
    import numpy as np

    path = study.folder / "one.exr"
    buffer = oiio.ImageBuf(str(path))
    pixels = buffer.get_pixels("float")
    pixels[3, 5:9, 0] = np.nan
    broken = oiio.ImageBuf(buffer.spec())
    broken.set_pixels(buffer.spec().roi, pixels)
    assert broken.write(str(path), "half")
    told = _simulate(study, expect=2)
    assert "one.exr" in told.stderr
    assert "4 pixels" in told.stderr
    assert not study.results.exists()


def test_quad_buffered_without_a_stereo_driver_is_refused(study: Study) -> None:
    told = _simulate(study, "--mode", "quad-buffered", expect=2)
    assert "GL_STEREO is false" in told.stderr
    assert "side-by-side" in told.stderr
    assert not study.results.exists()


def test_a_results_folder_that_cannot_be_made_is_refused(study: Study) -> None:
    study.results.write_text("a file stands where the folder should be")
    told = _simulate(study, expect=2)
    assert "the results folder cannot be written" in told.stderr


def test_killed_while_drawing_for_real(study: Study) -> None:
    """The whole program, killed with SIGKILL at several moments, then resumed to its end."""
    study.edit("small.yaml", "break_every: 4", "break_every: 4, repeats: 40")
    command = [sys.executable, "-c", "from runner.cli.main import main; main()", "run", str(study.experiment)]
    command += ["--observer", "01", "--simulate", str(study.observers), "--results", str(study.results), "--json"]
    seen: list[int] = []
    for more in ([], ["--resume"], ["--resume"]):
        process = subprocess.Popen([*command, *more], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        enough = (seen[-1] if seen else 0) + 5
        until = time.monotonic() + 60
        while time.monotonic() < until and process.poll() is None:
            files = list(session_files(study.results))
            if files and files[0].read_bytes().count(b'"all_pairs"') >= enough:
                break
            time.sleep(0.002)
        process.send_signal(signal.SIGKILL)
        process.wait()
        seen.append(len(_answered(study.results)))
    assert seen[0] < seen[1] < seen[2] < 240
    before = _answered(study.results)
    done = json.loads(_simulate(study, "--resume").stdout)
    assert done["answered"] == 240
    assert _answered(study.results)[: len(before)] == before
    (file,) = session_files(study.results)
    keys = [(trial.block, trial.trial) for trial in read_session(file).trials]
    assert len(keys) == len(set(keys)) == 241


def test_an_uncharacterised_mode_is_refused_unless_allowed_and_then_marks_every_record(study: Study) -> None:
    study.edit("display.yaml", "  side-by-side:\n", "  quad-buffered:\n")
    study.edit("display.yaml", "  quad-buffered: {same_as: side-by-side}\n", "")
    assert "not characterised in the mode 'side-by-side'" in _simulate(study, expect=2).stderr
    told = _simulate(study, "--allow-uncharacterised")
    assert json.loads(told.stdout)["answered"] == 6
    assert "colours are those of 'quad-buffered' and not to be trusted" in told.stderr
    (file,) = session_files(study.results)
    log = read_session(file)
    assert log.header.display["characterised_as"] == "quad-buffered"
    assert any("not to be trusted" in remark for remark in log.header.remarks)
    assert all(trial.data["uncharacterised"] is True for trial in log.trials)


def test_a_graphics_error_ends_the_session_with_everything_recorded(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a lost context does: the driver reports an error at the next draw."""
    from click.testing import CliRunner

    from runner.cli.main import group
    from runner.presenter.errors import GraphicsError
    from runner.presenter.presenter import Presenter

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
    assert "every answer before this is saved" in str(result.exception)
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
