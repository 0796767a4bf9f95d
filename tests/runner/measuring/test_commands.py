"""`display patches`, `measure` and `verify` from end to end, headless, with a simulated instrument; and killed."""

from __future__ import annotations

import json
import os
import shutil
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

from devices.display import MonitorSettings, read_display
from devices.readings import find_patches, read_csv, read_measurements, read_session
from documents import InputError
from runner.cli.main import group
from runner.presenter import MODES
from tests.choice import nightly
from tests.forked import Server
from tests.invoked import invoked
from tests.runner.families import by_family
from tests.runner.measuring.displays import DISPLAY as SMALL
from tests.runner.measuring.displays import write_rig

DISPLAY = SMALL + "  flat: {same_as: row-interleaved}\n"
SIMULATED = ["--instrument", "simulated", "--backend", "egl", "--settle", "0"]


pytestmark = pytest.mark.usefixtures("egl")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_rig(tmp_path, DISPLAY)


@pytest.fixture(scope="module")
def measured_once(egl: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the greys have been measured."""
    folder = write_rig(tmp_path_factory.mktemp("measured"), DISPLAY)
    assert _measure(folder, "--set", "grey").exit_code == 0
    return folder


@pytest.fixture
def measured(measured_once: Path, tmp_path: Path) -> Path:
    """That folder, copied for a test that goes on from there."""
    return Path(shutil.copytree(measured_once, tmp_path / "measured"))


_run = partial(invoked, "display")


def _measure(folder: Path, *more: str, file: str = "m.jsonl", target: str = "rig.yaml", backend: str = "egl") -> Result:
    simulated = [backend if word == "egl" else word for word in SIMULATED]
    return _run("measure", folder / target, "-o", folder / file, *simulated, *more)


def _lines(file: Path, kind: str) -> list[dict[str, Any]]:
    return [line for line in map(json.loads, file.read_text().splitlines()) if line["record"] == kind]


def test_a_measurement_from_a_rig_is_the_model_with_noise(folder: Path) -> None:
    result = _measure(folder, "--eye", "left", "--table", str(folder / "t.csv"), "--table", str(folder / "t.ti3"))
    assert result.exit_code == 0, result.output
    assert not (folder / "m.csv").exists()
    table, ti3 = (read_measurements(folder / name) for name in ("t.csv", "t.ti3"))
    for one in ("name", "eye", "mode", "instrument"):
        assert getattr(table, one) == getattr(ti3, one)
    for one in ("XYZ", "time_s"):
        np.testing.assert_array_equal(getattr(table, one), getattr(ti3, one))
    np.testing.assert_allclose(table.codes, ti3.codes, atol=1e-12)
    assert len(table) == 140
    assert table.mode == "row-interleaved"
    assert set(table.eye) == {"left"}
    assert set(table.name) == {patch.name for patch in find_patches("table_c1").patches}
    assert table.time_s is not None
    assert np.all(np.diff(table.time_s) >= 0)
    light = read_display(folder / "display.yaml").models("row-interleaved").left.xyz(table.codes)
    share = table.XYZ / light - 1.0
    assert share.std() == pytest.approx(0.002, rel=0.25)
    assert "140/140" in result.stderr
    assert "left)" in result.stderr


def test_a_measurement_gone_on_with_by_another_instrument_says_so(folder: Path) -> None:
    arguments = ["display", "measure", str(folder / "rig.yaml"), "-o", str(folder / "m.jsonl"), "--backend", "egl",
                 "--settle", "0", "--set", "grey"]  # fmt: skip
    CliRunner().invoke(group, [*arguments, "--instrument", "manual"], input="1 2 3\n")
    result = CliRunner().invoke(group, [*arguments, "--instrument", "simulated", "--resume"])
    assert result.exit_code == 0, result.output
    assert "began with typed by hand and is resumed with simulated (seed 1)" in result.output
    assert len(_lines(folder / "m.jsonl", "note")) == 1


def test_the_measurement_says_what_it_is_of(folder: Path) -> None:
    with (folder / "rig.yaml").open("a") as rig:
        rig.write("monitor_settings: {brightness_percent: 35, preset: Standard}\n")
    _measure(folder, "--set", "grey", "--eye", "right", "--seed", "5", "--notes", "right lens")
    for file in ("m.csv", "m.jsonl"):
        settings = MonitorSettings.parse(read_measurements(folder / file).monitor_settings)
        assert settings.stated == {"preset": "Standard", "brightness_percent": 35}
    assert read_csv(folder / "m.csv").notes.startswith("right lens; grey (33 greys")
    header = _lines(folder / "m.jsonl", "header")[0]
    assert header["mode"] == "row-interleaved"
    assert header["eye"] == "right"
    assert header["set"] == "grey"
    assert header["display"] == "display.yaml"
    assert header["instrument"] == "simulated (seed 5)"
    assert len(header["display_sha256"]) == 64
    assert header["surface"]["backend"] == "egl"
    assert header["surface"]["arithmetic"].startswith(("doubles: ", "two-floats"))


def test_a_display_without_modes_can_be_measured_but_not_simulated(folder: Path) -> None:
    (folder / "new.yaml").write_text(DISPLAY.split("modes:")[0])
    result = _run("patches", folder / "new.yaml", "--mode", "checkerboard", "--set", "grey", "--backend", "egl",
                  "--each", "0.001", "--settle", "0", "--json")  # fmt: skip
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["shown"] == 39
    result = _measure(folder, "--mode", "checkerboard", target="new.yaml")
    assert isinstance(result.exception, InputError)
    assert "no display model to simulate" in str(result.exception)
    assert not (folder / "m.jsonl").exists()


@pytest.mark.parametrize("mode", by_family(mode for mode in MODES if mode != "quad-buffered"))
@pytest.mark.parametrize("eye", [*nightly("both"), "left"])
def test_patches_are_shown_in_every_mode(folder: Path, mode: str, eye: str) -> None:
    (folder / "own.csv").write_text("# codes: 0..255\nname,red,green,blue\na,10,20,30\nb,30,20,10\n")
    result = _run("patches", folder / "display.yaml", "--mode", mode, "--eye", eye, "--set", folder / "own.csv",
                  "--backend", "egl", "--each", "0.001", "--settle", "0", "-o", folder / "shown.csv")  # fmt: skip
    if (mode, eye) == ("flat", "left"):
        assert "has no picture of its own for an eye" in str(result.exception)
        return
    assert result.exit_code == 0, result.output
    rows = (folder / "shown.csv").read_text().splitlines()
    assert rows[:3] == ["# codes: 0..255", f"# mode: {mode}", "name,red,green,blue,X,Y,Z,time_s,eye"]
    assert sorted(row.split(",")[0] for row in rows[3:]) == ["a", "b", "black", "black", "white", "white"]
    assert ("hold the left filter" in result.stderr) == (eye == "left" and mode.startswith("anaglyph"))


@pytest.mark.nightly
def test_the_list_is_what_is_measured(folder: Path) -> None:
    listed = _run("patches", folder / "rig.yaml", "--set", "dark", "--seed", "3", "--list").stdout
    _measure(folder, "--set", "dark", "--seed", "3")
    steps = read_session(folder / "m.jsonl").steps
    assert [line.split(",")[:4] for line in listed.splitlines()[3:]] == [
        [step.patch.name, *(f"{round(255 * code)}" for code in step.patch.codes)] for step in steps
    ]


@pytest.mark.parametrize(
    "words",
    [
        ["display", "patches", "configs/rigs/asus_vg248qe_3dvision.yaml", "--set", "grey", "--list"],
        ["power", "experiments/dynamic_range.yaml", "--observers", "2", "--replicates", "2", "--workers", "1"],
    ],
)
def test_a_seed_beyond_a_billion_is_taken_and_counts(words: list[str]) -> None:
    told = [CliRunner().invoke(group, [*words, "--seed", seed]) for seed in ("10000000000001", "10000000000002")]
    assert [one.exit_code for one in told] == [0, 0], told[0].output
    assert told[0].stdout != told[1].stdout


def test_patches_can_be_begun_in_the_middle(folder: Path) -> None:
    listed = _run("patches", folder / "rig.yaml", "--set", "grey", "--start", "white#2", "--list").stdout.splitlines()
    assert listed[3].startswith("white,")
    assert len(listed) == 3 + 39 - 15
    wrong = _run("patches", folder / "rig.yaml", "--set", "grey", "--start", "white#9", "--list")
    assert "no patch 'white#9'" in str(wrong.exception)


def test_an_out_of_range_patch_is_measured_on_resuming(folder: Path) -> None:
    typed = iter(["1 2 3"] * 5 + ["skip"] + ["1 2 3"] * 33)
    arguments = ["measure", str(folder / "rig.yaml"), "-o", str(folder / "m.jsonl"), "--instrument", "manual",
                 "--backend", "egl", "--settle", "0", "--set", "grey", "--accept-readings"]  # fmt: skip
    result = CliRunner().invoke(group, ["display", *arguments], input="\n".join(typed) + "\n")
    assert result.exit_code == 1
    assert "1 patch could not be read" in str(result.exception)
    missing = read_session(folder / "m.jsonl").missing
    assert [step.position for step in missing] == [5]
    result = CliRunner().invoke(group, ["display", *arguments, "--resume", "--json"], input="7 8 9\n")
    assert result.exit_code == 0, result.output
    done = json.loads(result.stdout)
    assert (done["readings"], done["missing"], done["taken"]) == (39, [], 1)
    assert read_session(folder / "m.jsonl").readings[5].reading.XYZ_cd_m2 == (7, 8, 9)


def test_again_reads_the_named_patches_alone(measured: Path) -> None:
    before = read_session(measured / "m.jsonl")
    result = _measure(measured, "--set", "grey", "--again", "white#2", "--again", "grey250",
                      "--instrument-option", "noise=0", "--instrument-option", "drift_per_hour=1000",
                      "--accept-readings")  # fmt: skip
    assert result.exit_code == 0, result.output
    after = read_session(measured / "m.jsonl")
    changed = {
        after.steps[place].label
        for place in after.readings
        if after.readings[place].reading != before.readings[place].reading
    }
    assert changed == {"white#2", "grey250"}
    assert len(read_csv(measured / "m.csv")) == 39
    wrong = _measure(measured, "--set", "grey", "--again", "whit")
    assert "did you mean 'white'" in str(wrong.exception)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ([], "exists already"),
        (["--resume", "--eye", "left"], "other 'eye': it was 'both', not 'left'"),
        *nightly((["--resume", "--seed", "2"], "'seed'"), (["--resume", "--set", "dark"], "'set'")),
    ],
)
def test_another_measurement_is_not_gone_on_with(measured: Path, more: list[str], words: str) -> None:
    before = (measured / "m.jsonl").read_bytes()
    result = _measure(measured, "--set", "grey", *more)
    assert isinstance(result.exception, InputError)
    assert words in str(result.exception)
    assert (measured / "m.jsonl").read_bytes() == before


def test_what_was_finished_has_nothing_left_to_resume(measured: Path) -> None:
    result = _measure(measured, "--set", "grey", "--resume", "--json")
    assert result.exit_code == 0
    assert json.loads(result.stdout)["taken"] == 0


def test_a_display_file_needs_a_mode(folder: Path) -> None:
    result = _measure(folder, target="display.yaml")
    assert "add --mode" in str(result.exception)


def test_verify_fails_a_display_that_is_not_as_described(folder: Path) -> None:
    result = _run("verify", "--display", folder / "display.yaml", "--mode", "row-interleaved", *SIMULATED,
                  "-o", folder / "v.jsonl", "--limit", "0.5",
                  "--instrument-option", "interaction=0.05")  # fmt: skip
    assert result.exit_code == 1
    assert "above the limit of 0.5" in str(result.exception)
    assert "* outside the display's gamut" in result.output


def test_verify_of_a_mode_measured_per_eye_asks_for_an_eye(folder: Path) -> None:
    model = DISPLAY.split("row-interleaved:\n")[1].split("  flat:")[0]
    deeper = "".join(f"  {line}\n" for line in model.splitlines())
    text = DISPLAY.split("modes:")[0] + f"modes:\n  row-interleaved:\n    left:\n{deeper}    right:\n{deeper}"
    (folder / "per_eye.yaml").write_text(text)
    arguments: tuple[str | Path, ...] = ("verify", "--display", folder / "per_eye.yaml", "--mode", "row-interleaved")
    arguments += tuple(SIMULATED)
    assert "--eye left" in str(_run(*arguments).exception)
    assert _run(*arguments, "--eye", "right").exit_code == 0
    assert (folder / "per_eye-row-interleaved-right-verify.jsonl").exists()


def test_from_patches_to_a_display_file_that_holds(folder: Path) -> None:
    """Measure a display of which nothing but the panel is known, fit it, and verify the fit on the display itself."""
    (folder / "new.yaml").write_text(DISPLAY.split("modes:")[0])
    looking = ["--instrument-option", f"display={folder / 'display.yaml'}"]
    result = _measure(folder, "--mode", "row-interleaved", *looking, target="new.yaml")
    assert result.exit_code == 0, result.output
    result = _run("fit", folder / "m.csv", "--model", "gog", "--brief", "-o", folder / "fitted.yaml")
    assert result.exit_code == 0, result.output
    assert "the panel is the one that was measured: 64x48,0.25,60,8" in result.output
    assert read_display(folder / "fitted.yaml").panel == read_display(folder / "display.yaml").panel
    result = _run("verify", "--display", folder / "fitted.yaml", "--mode", "row-interleaved", *SIMULATED, *looking,
                  "-o", folder / "v.jsonl", "--limit", "0.5", "--json")  # fmt: skip
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["delta_e_00"]["mean"] < 0.5


def test_killed_no_reading_is_lost_or_doubled(measured: Path, forked: Server) -> None:
    """At random moments, again and again: tests/stress. A patch's noise depends on the seed and its place alone."""
    whole, file = read_session(measured / "m.jsonl").readings, measured / "killed.jsonl"
    words = ["display", "measure", str(measured / "rig.yaml"), *SIMULATED, "--set", "grey", "-o", str(file)]
    slowly = ["--instrument-option", "takes_s=0.02"]
    process = forked.start("from runner.cli.main import main; main()", [*words, *slowly], {**os.environ})
    until_s = time.monotonic() + 60
    while process.poll() is None and time.monotonic() < until_s:
        if file.exists() and file.read_bytes().count(b'"reading"') > 9:
            process.kill()
        time.sleep(0.002)
    process.communicate()
    before = read_session(file).readings
    assert 9 < len(before) < 39
    assert _measure(measured, "--set", "grey", "--resume", file="killed.jsonl").exit_code == 0
    after = read_session(file).readings
    assert {place: after[place] for place in before} == before
    assert {place: kept.reading for place, kept in after.items()} == {n: kept.reading for n, kept in whole.items()}
    assert len(_lines(file, "reading")) == len(read_csv(measured / "killed.csv")) == 39
