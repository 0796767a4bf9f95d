"""What `check` tells of an experiment beyond its schema."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.records import new_header
from runner.check import TRIED_OBSERVERS, CheckOptions, CheckReport, check_file
from runner.check.machine import NO_DISPLAY
from runner.presenter import monitors
from runner.protocol import read_experiment
from runner.session import Recorder
from stimuli.pictures import StereoImage, write_exr
from tests.choice import nightly

Study = Any  # tests/conftest.py
HEADER = new_header("small", "07", "s", "2026-01-01T00:00:00.000+00:00", question="Which?", simulated=True)


def _check(study: Study, **options: Any) -> CheckReport:
    return check_file(study.experiment, CheckOptions(**{"results": study.results, "screen": False, **options}))


def _messages(checked: CheckReport) -> str:
    return "\n".join(map(str, checked.warnings))


def test_each_block_has_its_trials_minutes_and_keys(study: Study) -> None:
    facts = _check(study).facts
    assert facts["trials"] == 6
    blocks = read_experiment(study.experiment).blocks("01")
    assert facts["minutes"] == round(sum(block.expected_s for block in blocks) / 60, 1)
    words, pairs = facts["blocks"]
    assert (words["kind"], words["trials"], words["keys"]["space"]) == ("instructions", 0, "continue")
    assert (pairs["kind"], pairs["trials"], pairs["breaks"]) == ("all_pairs", 6, 1)
    assert (pairs["keys"]["up"], pairs["keys"]["down"]) == ("first", "second")
    assert facts["keys"]["escape"] == "pause"
    assert facts["keys"]["n"] == "note in the pause's menu"
    assert facts["keys"]["backspace"] == "erase in a note"
    assert facts["keys"]["enter"] == "accept in a note"


def test_repeats_ties_catch_trials_and_ratings_are_told(study: Study) -> None:
    study.edit(
        "small.yaml",
        "break_every: 4",
        "break_every: 4, repeats: 2, ties: not_sure, catch: {every: 4, pairs: [[four, one]]}, "
        "ratings: [{name: sure, question: How sure}]",
    )
    assert not _check(study).errors
    pairs = _check(study).facts["blocks"][1]
    assert (pairs["trials"], pairs["repeats"], pairs["breaks"]) == (15, 2, 3)
    assert (pairs["ties"], pairs["catch_trials"], pairs["ratings"]) == ("not_sure", 3, ["sure"])


def test_a_picture_that_eyes_do_not_take_in_is_warned_of_at_its_size(study: Study) -> None:
    """What a screen shows from an ordinary distance is not: 41.6° from 532 mm at 700 mm."""
    study.edit("rig.yaml", "distance_mm: 700", "distance_mm: 100")
    assert "turning the head" not in _messages(_check(study))
    study.edit("rig.yaml", "distance_mm: 100", "distance_mm: 15")
    (warning,) = [warning for warning in _check(study).warnings if "turning the head" in warning.message]
    assert "a picture covers 67.4°" in warning.message
    assert "millimetres" in str(warning.remedy)
    assert (warning.line, warning.column) == (6, 42)


def test_pixels_that_can_be_seen_are_warned_of_with_the_distance_from_which_not(study: Study) -> None:
    # 0.25 mm at 700 mm: 48.9 pixels per degree; 120 from 1719 mm.
    assert "48.9 pixels per degree" in _messages(_check(study))
    assert "172 cm" in _messages(_check(study))
    study.edit("rig.yaml", "distance_mm: 700", "distance_mm: 1725")
    assert "pixels per degree" not in _messages(_check(study))


def test_settings_of_the_monitor_that_differ_from_those_measured_with_are_warned_of(study: Study) -> None:
    study.edit("display.yaml", "    source:", "    monitor_settings: {brightness_percent: 35}\n    source:")
    assert "measured with brightness_percent 35" in _check(study).facts["monitor_settings"]
    assert "settings of the monitor" not in _messages(_check(study))
    with (study.folder / "rig.yaml").open("a") as rig:
        rig.write("monitor_settings: {brightness_percent: 40, dynamic_contrast: true}\n")
    warned = _messages(_check(study))
    assert "brightness_percent 35, not 40" in warned
    assert "dynamic contrast is on" in warned
    assert _messages(check_file(study.folder / "rig.yaml", CheckOptions(screen=False))).count("settings of the") == 1
    assert check_file(study.folder / "display.yaml").facts["monitor_settings"]


def test_pictures_smaller_than_their_place_are_warned_of(study: Study) -> None:
    assert "smaller than the aperture" not in _messages(_check(study))
    write_exr(study.folder / "two.exr", StereoImage.flat(np.ones((40, 79, 3), np.float32)))
    (warning,) = [warning for warning in _check(study).warnings if "aperture" in warning.message]
    assert "80 x 40 px: two" in warning.message
    assert warning.line == 6


def test_pictures_of_which_only_the_middle_is_seen_are_warned_of(study: Study) -> None:
    write_exr(study.folder / "two.exr", StereoImage.flat(np.ones((41, 82, 3), np.float32)))
    assert "aperture" not in _messages(_check(study))  # 95 % of it is seen
    write_exr(study.folder / "two.exr", StereoImage.flat(np.ones((50, 100, 3), np.float32)))
    (warning,) = [warning for warning in _check(study).warnings if "aperture" in warning.message]
    assert "1 stimulus: two" in warning.message
    assert "64 % of its area" in warning.message
    assert warning.line == 6


def test_clipping_is_warned_of_beyond_the_limit_only(study: Study) -> None:
    worst = max(max(eyes) for eyes in _check(study).facts["clipped_percent"].values())
    assert worst > 0.3
    assert "outside the gamut in" in _messages(_check(study))
    assert "outside the gamut in" not in _messages(_check(study, clip_limit_percent=worst))
    assert "outside the gamut in 1 of 4" in _messages(_check(study, clip_limit_percent=worst - 1e-9))


def test_without_pictures_nothing_is_built(study: Study) -> None:
    checked = _check(study, pictures=False)
    assert not checked.errors
    assert "clipped_percent" not in checked.facts
    assert not (study.folder / "cache").exists()


def test_long_sessions_and_sessions_without_a_question_are_warned_of(study: Study) -> None:
    study.edit("small.yaml", "break_every: 4", "break_every: 4, repeats: 100")
    assert "a session takes about 50 minutes" in _messages(_check(study))
    study.edit("small.yaml", "  - {kind: all_pairs, break_every: 4, repeats: 100}\n", "")
    assert "no block asks anything" in _messages(_check(study))


def test_faults_of_every_file_are_told_although_the_experiment_is_wrong(study: Study) -> None:
    study.edit("small.yaml", "question:", "qestion:")
    study.edit("rig.yaml", "distance_mm: 700", "distance_mm: -7")
    study.edit("recipe.yaml", "file: two.exr", "file: too.exr")
    study.edit("display.yaml", "gamma: 2.1", "gama: 2.1")
    told = [str(error).removeprefix(f"{study.folder}/") for error in _check(study).errors]
    for part in ("small.yaml:5:1: unknown key", "rig.yaml:4:14: 'distance_mm' is -7", "the picture 'too.exr'"):
        assert any(part in one for one in told), (part, told)
    assert len(told) == len(set(told))
    study.edit("rig.yaml", "distance_mm: -7", "distance_mm: 700")
    assert any("did you mean 'gamma'?" in str(error) for error in _check(study).errors)


def test_a_results_folder_that_is_a_file_is_an_error(study: Study) -> None:
    study.results.write_text("")
    (error,) = _check(study).errors
    assert "a file stands where" in error.message


def test_unfinished_and_running_sessions_are_told_and_a_left_over_lock_is_none(study: Study) -> None:
    folder = study.results / "small" / "sub-07" / "ses-20260101T000000abcd"
    with Recorder.create(folder, HEADER):
        facts = _check(study).facts
        assert facts["sessions_running_of"] == ["07"]
        assert "unfinished_sessions_of" not in facts
    (folder / ".lock").touch()
    facts = _check(study).facts
    assert facts["unfinished_sessions_of"] == ["07"]
    assert "sessions_running_of" not in facts
    recorder, _ = Recorder.reopen(folder)
    with recorder:
        recorder.end({})
    assert "unfinished_sessions_of" not in _check(study).facts


def test_without_a_display_the_screen_is_passed_over_unless_it_must_do(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    checked = _check(study, screen=None)
    assert checked.facts["screen"] == NO_DISPLAY
    assert not checked.errors
    assert "there is no display here" in str(_check(study, screen=True).errors[0])


def test_the_screen_is_held_against_the_rig(study: Study, xvfb: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", xvfb)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert [monitor.size_px for monitor in monitors()] == [(1920, 1080)]
    checked = _check(study, screen=None)
    assert checked.facts["screen"]["mode_possible"] is True
    assert "640 × 480 px (there: 1920 × 1080)" in _messages(checked)
    assert not checked.errors
    assert "no screen shows" in "\n".join(map(str, _check(study, screen=True).errors))
    study.edit("display.yaml", "[640, 480]", "[1920, 1080]")
    assert "no screen shows" not in _messages(_check(study, screen=None))
    study.edit("display.yaml", "pixel_pitch_mm: 0.25", "pixel_pitch_mm: 0.25, bits: 10, refresh_hz: 144")
    study.edit("rig.yaml", "mode: side-by-side", "mode: quad-buffered")
    checked = _check(study, screen=True)
    told = "\n".join(map(str, checked.errors))
    assert "'quad-buffered' cannot be shown" in told
    assert checked.facts["screen"]["mode_possible"] is False


def test_a_camera_file_is_told_with_its_exposure_and_zone(tmp_path: Path) -> None:
    shipped = Path(__file__).parents[3] / "configs/cameras/nikon_d800.yaml"
    checked = check_file(shipped)
    assert not checked.errors + checked.warnings
    assert checked.facts["exposure"] == "1/15 s, f/8, ISO 800"
    assert checked.facts["safe_luminance_cd_m2"] == [9.41, 120.8]
    text = shipped.read_text(encoding="utf-8").replace("safe_luminance_cd_m2: [9.41, 120.8]", "name: again")
    (tmp_path / "twice.yaml").write_text(text, encoding="utf-8")
    assert "name" in str(check_file(tmp_path / "twice.yaml").errors[0])
    (tmp_path / "blind.yaml").write_text(text.replace("name: again", ""), encoding="utf-8")
    (warning,) = check_file(tmp_path / "blind.yaml").warnings
    assert "safe luminance zone is not known" in warning.message


def test_a_file_of_regions_is_told_with_its_areas(tmp_path: Path) -> None:
    checked = check_file(Path(__file__).parents[3] / "configs/regions/plate.yaml")
    assert not checked.errors + checked.warnings
    assert checked.facts == {"kind": "regions", "regions": ["plate (plate)"], "limit_delta_e_00": 1.4}
    (tmp_path / "regions.yaml").write_text(
        "schema_version: 1\nregions:\n  - {kind: rectangle, name: lid, bx: [0, 0, 5, 5]}\n", encoding="utf-8"
    )
    assert "did you mean 'box'" in "\n".join(map(str, check_file(tmp_path / "regions.yaml").errors))


def test_files_that_are_named_have_no_detour_in_their_path(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = study.experiment.parent
    (folder / "experiments").mkdir()
    moved = folder / "experiments" / "small.yaml"
    text = study.experiment.read_text()
    moved.write_text(text.replace("rig: ", "rig: ../").replace("stimuli: ", "stimuli: ../"))
    study.edit("rig.yaml", "distance_mm: 700", "distance_mm: -700")
    study.edit("recipe.yaml", "schema_version: 1", "schema_version: 2")
    monkeypatch.chdir(folder)
    found = check_file(Path("experiments/small.yaml"), CheckOptions(results=study.results, screen=False))
    assert {error.file for error in found.errors} == {"rig.yaml", "recipe.yaml"}


@pytest.mark.parametrize(
    ("name", "content", "what", "remedy"),
    [
        ("photo.png", b"\x89PNG\r\n\x1a\n", "a picture (PNG)", "cyclopean new my_study"),
        ("photo.jpg", b"\xff\xd8\xff\xe0", "a picture (JPEG)", "cyclopean show"),
        ("answers.csv", b"winner,loser\na,b\n", "a table", "cyclopean scores"),
        ("session.jsonl", b"{}\n", "the record of a session", "cyclopean report"),
        ("nothing", None, "a folder", "check reads YAML files"),
        ("photos/", b"plate_L.JPG", "a folder of pictures", "cyclopean new my_study"),
        ("study/", b"x.yaml", "a folder", "study/small.yaml"),
        ("results/", b"session.jsonl", "a folder of results", "cyclopean report"),
    ],
)
def test_what_is_no_yaml_is_named_with_the_command_that_takes_it(
    tmp_path: Path, name: str, content: bytes | None, what: str, remedy: str
) -> None:
    path = tmp_path / name
    if content is None or name.endswith("/"):
        path.mkdir()
        if content:
            (path / content.decode().replace("x.yaml", "small.yaml")).touch()
    else:
        path.write_bytes(content)
    (error,) = check_file(path).errors
    assert (error.message, error.file) == (f"this is {what}", str(path))
    assert remedy in str(error.remedy)


def test_a_missing_file_is_named_with_where_it_was_looked_for(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(study.folder)
    (error,) = check_file(Path("smal.yaml")).errors
    assert error.remedy == f"looked for {study.folder}/smal.yaml; did you mean 'small.yaml'?"


def test_another_mode_than_the_rigs_can_be_checked(study: Study) -> None:
    assert _check(study, mode="quad-buffered").facts["mode"] == "quad-buffered"
    assert "not characterised in the mode 'flat'" in str(_check(study, mode="flat").errors[0])
    rig = check_file(study.folder / "rig.yaml", CheckOptions(screen=False, mode="quad-buffered"))
    assert rig.facts["mode"] == "quad-buffered"
    checked = _check(study, mode="top-bottom", allow_uncharacterised=True)
    assert not checked.errors


def test_stereo_pictures_in_the_mode_flat_are_an_error(study: Study) -> None:
    study.edit("display.yaml", "quad-buffered: {same_as", "flat: {same_as")
    study.edit("rig.yaml", "mode: side-by-side", "mode: flat")
    (error,) = _check(study).errors
    assert "2 stimuli have a view for each eye: one, two" in error.message
    assert (error.file, error.line) == (str(study.experiment), 3)
    study.edit("recipe.yaml", "  - {name: one, file: one.exr}\n  - {name: two, file: two.exr}\n", "")
    assert not _check(study).errors


LONG = "Which of the two pictures is closer to the plate on the table beside you in the way it shines? "


def test_a_question_that_is_drawn_over_the_pictures_is_an_error_with_the_letters_that_fit(study: Study) -> None:
    study.edit("display.yaml", "[640, 480]", "[1920, 1080]")
    study.edit("small.yaml", "size_mm: [20, 10]", "size_mm: [20, 100]")
    study.edit("small.yaml", "Which is closer?", (LONG * 4)[:290])
    (error,) = _check(study).errors
    assert "in block 2 (all_pairs)" in error.message
    assert error.message.endswith("are drawn over a picture")
    assert error.line == 5
    fitting = int(str(error.remedy).split()[1])
    study.edit("small.yaml", (LONG * 4)[:290], (LONG * 4)[:fitting])
    assert not _check(study).errors


def test_instructions_that_leave_the_view_are_an_error(study: Study) -> None:
    study.edit("small.yaml", "text: Look at the two pictures.", f"text: {'|'.join('line' for _ in range(45))}")
    study.edit("small.yaml", "line|", "line\\n")
    study.edit("small.yaml", "text: line", 'text: "line')
    study.edit("small.yaml", "line}", 'line"}')
    (error,) = _check(study).errors
    assert "in block 1 (instructions)" in error.message
    assert "do not fit" in error.message
    assert error.line == 8


def test_a_mode_that_does_not_exist_is_found_in_a_display_file(study: Study) -> None:
    study.edit("display.yaml", "quad-buffered:", "quad-bufferd:")
    (error,) = check_file(study.folder / "display.yaml").errors
    assert (error.line, error.column) == (9, 3)
    assert str(error).endswith("(did you mean 'quad-buffered'?)")


@pytest.mark.parametrize(("observers", "camps"), [(3, 4), *nightly((5, 16), (6, None)), (30, None)])
def test_a_design_that_finds_nothing_with_the_observers_planned_is_warned_of(
    study: Study, observers: int, camps: int | None
) -> None:
    checked = _check(study, observers=(observers,))
    (found,) = checked.facts["smallest_difference"]
    nothing = found["nats"] is None
    assert (found["observers"], found["one_camp_in"]) == (observers, camps)
    assert nothing == {3: True, 30: False}.get(observers, nothing)
    said = [warning for warning in checked.warnings if warning.message in found["warnings"]]
    assert len(said) == len(found["warnings"]) == nothing + bool(camps)
    assert all((warning.file, warning.line) == (str(study.experiment), 9) for warning in said)
    assert all("cyclopean power" in str(warning.remedy) for warning in said)
    assert ("no difference" in _messages(checked)) == nothing
    assert ("two camps" in _messages(checked)) == bool(camps)


def test_without_a_planned_number_several_are_told_and_nothing_is_warned_of_if_some_find_a_difference(
    study: Study,
) -> None:
    checked = _check(study, observers=(3, *TRIED_OBSERVERS))
    found = checked.facts["smallest_difference"]
    assert [one["observers"] for one in found] == [3, 5, 10, 15, 30]
    assert [one["nats"] is None for one in found][0::4] == [True, False]
    assert not {words for one in found for words in one["warnings"]} & {w.message for w in checked.warnings}
    study.edit("small.yaml", "break_every: 4", "break_every: 4, repeats: 3")
    more = _check(study, observers=(30,)).facts["smallest_difference"]
    assert more[-1]["nats"] < found[-1]["nats"]


def test_what_is_not_asked_is_not_computed_and_what_was_computed_is_kept(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = _check(study, observers=(12,)).facts["smallest_difference"]

    def again(*_: Any, **__: Any) -> None:
        raise AssertionError("simulated again")

    monkeypatch.setattr("analysis.simulation.smallest._smallest", again)
    assert _check(study, observers=(12,)).facts["smallest_difference"] == found
    assert "smallest_difference" not in _check(study).facts
    study.edit("small.yaml", "break_every: 4", "break_every: 4, repeats: 2")
    with pytest.raises(AssertionError, match="simulated again"):
        _check(study, observers=(12,))


def test_the_smallest_difference_is_printed_and_in_json(study: Study) -> None:
    words = ("check", study.experiment, "--results", study.results, "--no-screen", "--no-pictures")
    printed = study.cyclopean(*words).stdout
    (checked,) = json.loads(study.cyclopean(*words, "--json").stdout)
    for one in checked["smallest_difference"]:
        assert one["size"].split(" (")[0] in printed
    assert "80 % of studies" in printed
    (five,) = json.loads(study.cyclopean(*words, "--observers", "5", "--json").stdout)
    assert [one["observers"] for one in five["smallest_difference"]] == [5]
    study.cyclopean(*words, "--observers", "1", expect=2)


def test_where_no_block_compares_all_pairs_nothing_is_said_of_differences(study: Study) -> None:
    study.edit("small.yaml", "kind: all_pairs", "kind: active_pairs")
    study.edit("small.yaml", "break_every: 4", "break_every: 4, comparisons: 12")
    assert "smallest_difference" not in _check(study, observers=(12,)).facts


def test_warnings_alone_leave_the_status_at_0_and_errors_make_it_2(study: Study) -> None:
    words = ("check", study.experiment, "--no-screen", "--results", study.results)
    told = study.cyclopean(*words).stdout
    assert "valid, 2 warnings" in told
    assert ["session", "6", "trials,"] in [line.split()[:3] for line in told.splitlines()]
    study.edit("small.yaml", "question:", "qestion:")
    assert "did you mean 'question'?" in study.cyclopean(*words, expect=2).stderr
