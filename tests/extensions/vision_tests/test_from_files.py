"""Screening in an experiment file: what is wrong with it, and sessions of simulated observers who see less."""

from __future__ import annotations

import json
from typing import Any

import pytest

from analysis.records import SessionLog, read_session, session_files
from documents import InputError
from extensions.vision_tests import VisionOutcomeRecord, screened
from runner.check import CheckOptions, CheckReport, check_file
from runner.protocol import read_experiment

Study = Any  # tests/conftest.py
SCREENING = """\
blocks:
  - kind: screening
    on_fail: stop
    tests:
      - {test: stereo_acuity, levels_arcsec: [400], repeats: 2, required: 2}
      - {test: colour_vision, levels_delta_uv: [0.03], repeats: 2, required: 2, controls: 1}
      - {test: near_acuity, levels_logmar: [0.4], repeats: 2, required: 2}
  - {kind: all_pairs}
"""


def screen(study: Study, old: str = "", new: str = "") -> None:
    """Give the study a screening, with ``old`` replaced in it."""
    told = study.experiment.read_text()
    assert old in SCREENING
    study.experiment.write_text(told[: told.index("blocks:")] + SCREENING.replace(old, new))


def faults(study: Study) -> str:
    with pytest.raises(InputError) as refused:
        read_experiment(study.experiment)
    return str(refused.value)


def simulate(study: Study, observer: str, psychometric: str = "{}", *more: str) -> str:
    """Run a simulated observer and return what was printed; ``psychometric`` says what it can see."""
    told = study.observers.read_text()
    observers = study.folder / f"observers-{observer}.yaml"
    observers.write_text(told.replace("kind: bradley_terry\n", f"kind: bradley_terry\npsychometric: {psychometric}\n"))
    return str(study.run(*more, simulate=observers, observer=observer).stdout)


def log_of(study: Study, observer: str) -> SessionLog:
    (file,) = session_files(study.results / "small" / f"sub-{observer}")
    return read_session(file)


def test_who_sees_well_continues_and_who_does_not_is_screened_out(study: Study) -> None:
    screen(study)
    done = json.loads(simulate(study, "01", "{}", "--json"))
    assert (done["ending"], done["answered"]) == ("completed", done["trials"])
    good = log_of(study, "01")
    assert [one.passed for one in good.of(VisionOutcomeRecord)] == [True, True, True]
    assert sum(trial.kind == "all_pairs" for trial in good.trials) == 6
    facts = next(trial.details()["screen"] for trial in good.trials if "outcome" in trial.details())
    assert facts["one_pixel_arcsec"] == pytest.approx(73.5, abs=0.5)
    assert facts["finest_arcsec"] == pytest.approx(0.2 * facts["one_pixel_arcsec"], rel=0.01)

    told = simulate(study, "02", "{stereo_acuity: {threshold: 1e6}}")
    assert "pass mark 140 arcsec" in told
    assert "(on_fail: stop), and is complete" in told
    assert "Continue:" not in told
    bad = log_of(study, "02")
    assert bad.complete
    assert json.loads(bad.file.read_text().splitlines()[-1])["screened_out"] is True
    assert bad.trials[-1].details()["screened_out"] is True
    assert not any(trial.kind == "all_pairs" for trial in bad.trials)
    assert screened([good, bad]) == (good,)


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
def test_who_failed_is_named_at_the_end_of_run_and_in_the_report_with_what_becomes_of_the_answers(study: Study) -> None:
    screen(study, "on_fail: stop", "on_fail: continue")
    assert "vision test" not in simulate(study, "01")
    told = simulate(study, "02", "{near_acuity: {threshold: 1e6}}")
    assert "Observer 02 failed a vision test: near acuity: no level passed, pass mark 0.2 logMAR." in told
    assert "--passed near_acuity" in told
    report = study.cyclopean("report", study.results, "--no-thumbnails").stdout
    note = "Not passed by 02 (no level passed, pass mark 0.2 logMAR). Their answers are included."
    assert note in " ".join(report.split())
    page = (study.results / "report.html").read_text()
    assert note in page
    assert "their answers are included: 02 (near acuity)." in page


@pytest.mark.nightly
def test_a_simulated_protan_fails_that_axis_alone(study: Study) -> None:
    screen(study, "on_fail: stop", "on_fail: continue")
    simulate(study, "03", "{colour_vision_protan: {threshold: 10}}")
    log = log_of(study, "03")
    (told,) = (
        trial.details()
        for trial in log.trials
        if trial.details().get("test") == "colour_vision" and "outcome" in trial.details()
    )
    assert [told["by_series"][axis]["passed"] for axis in ("protan", "deutan", "tritan")] == [False, True, True]
    assert [one.passed for one in log.of(VisionOutcomeRecord)] == [True, False, True]
    assert sum(trial.kind == "all_pairs" for trial in log.trials) == 6


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("levels_arcsec: [400]", "pass_arcsec: 3", "not the pass mark of 3 arcsec"),
        ("levels_logmar: [0.4]", "pass_logmar: -0.2", "not the pass mark of -0.2"),
        ("levels_delta_uv: [0.03]", "pass_delta_uv: 0.3", "not the pass mark of 0.3"),
        ("repeats: 2, required: 2, controls", "repeats: 2, required: 3, controls", "'required' is 3 of only 2"),
        ("test: near_acuity", "test: near_accuity", "near_accuity"),
        ("{test: near_acuity, levels_logmar: [0.4], ", "{test: stereo_acuity, ", "'stereo_acuity' stands twice"),
        ("levels_arcsec: [400]", "levels_arcsec: [-4]", "a number above 0"),
    ],
)
def test_what_cannot_be_is_said_before_anyone_sits_down(study: Study, old: str, new: str, words: str) -> None:
    screen(study, old, new)
    assert words in faults(study)


def test_modes_that_cannot_show_a_test(study: Study) -> None:
    screen(study)
    study.edit("display.yaml", "quad-buffered:", "flat:")
    study.edit("rig.yaml", "mode: side-by-side", "mode: flat")
    assert "'flat' cannot show stereo_acuity" in faults(study)
    study.edit("display.yaml", "flat:", "anaglyph-red-cyan:")
    study.edit("rig.yaml", "mode: flat", "mode: anaglyph-red-cyan")
    assert "cannot show colour_vision" in faults(study)


@pytest.mark.parametrize(
    ("mode", "grain"),
    [("side-by-side", 1), ("side-by-side-half", 2), ("column-interleaved", 2), ("checkerboard", 2)],
)
def test_modes_of_fewer_pixels_have_a_coarser_finest_disparity(study: Study, mode: str, grain: int) -> None:
    screen(study, "levels_logmar: [0.4]", "levels_logmar: [0.4], pass_logmar: 0.4")
    study.edit("display.yaml", "quad-buffered:", f"{mode if grain > 1 else 'quad-buffered'}:")
    study.edit("rig.yaml", "mode: side-by-side", f"mode: {mode}")
    block = read_experiment(study.experiment).blocks("01")[0]
    facts = block.facts["stereo_acuity"]
    assert facts["finest_px"] == pytest.approx(0.2 * grain)
    assert facts["finest_arcsec"] == pytest.approx(facts["finest_px"] * facts["one_pixel_arcsec"], rel=0.01)


def checked(study: Study, **options: Any) -> CheckReport:
    return check_file(study.experiment, CheckOptions(results=study.results, screen=False, **options))


def test_screening_is_a_sentence_and_its_outcome_no_trial(study: Study) -> None:
    study.edit("display.yaml", "[640, 480]", "[1920, 1080]")
    study.edit("display.yaml", "quad-buffered: {same_as", "anaglyph-red-cyan: {same_as")
    tests = "[{test: near_acuity, pass_logmar: 0.5, levels_logmar: [0.6, 0.5, -0.9]}, {test: stereo_acuity}]"
    study.edit("small.yaml", "blocks:\n", f"blocks:\n  - {{kind: screening, tests: {tests}}}\n")
    assert checked(study, pictures=False).facts["blocks"][0]["trials"] == 2 * 5 + 8 * 4
    said = study.cyclopean("check", study.experiment, "--no-pictures", "--no-screen").stdout
    words = " ".join(said.split())
    assert "shown from 0.6 to 0.5; this screen cannot show -0.9" in words
    assert "passed at 140 arcsec or finer" in words
    assert "colour gives the square away" not in words
    study.edit("rig.yaml", "mode: side-by-side", "mode: anaglyph-red-cyan")
    (warning,) = [w for w in checked(study, pictures=False).warnings if "stereo acuity" in w.message]
    assert "colour gives the square away" in warning.message
    assert warning.line == 8
