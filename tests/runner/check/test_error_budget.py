"""The error budget of a rig and of an experiment, against what the presenter's framebuffers hold, and as a command."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from devices.budget import Encoding, ErrorBudget, OwnPixels, PathStep
from devices.characterise import fit_display, table_c1_codes, thesis_display
from devices.colour import delta_e_2000, xyz_to_lab
from devices.compensation import Correction
from devices.compensation.crosstalk_cancel import seen_XYZ
from devices.display import ENTRIES, EYES, Crosstalk, Eye, EyeModels, GainMap, PanelSpec, Rig, read_display, read_rig
from devices.readings import Measurements
from documents.arrays import Floats
from runner.check import CheckOptions, check_file, rig_budget
from runner.check.error_budget import SCENE_PX, _scene
from runner.cli.main import group
from runner.presenter.compensated_pass import CompensatedPass
from runner.presenter.surfaces.egl import EglSurface
from tests.choice import nightly

Study = Any  # tests/conftest.py
RIG = Path(__file__).parents[3] / "configs/rigs/asus_vg248qe_3dvision.yaml"
LEAKS = Crosstalk(0.03 * np.eye(3), 0.02 * np.eye(3))


def _rig(**changes: Any) -> Rig:
    rig = read_rig(RIG)
    return replace(rig, spec=rig.spec.model_copy(update=changes))


def _framebuffers(models: EyeModels, correction: Correction, scene: dict[Eye, Floats]) -> dict[Eye, Floats]:
    """Return each eye's codes of ``scene`` as the presenter's pass draws them, (n, 3)."""
    with EglSurface((64, 64)) as surface:
        textures = {
            eye: surface.context.texture(SCENE_PX, 3, xyz.astype(np.float32).tobytes(), alignment=1, dtype="f4")
            for eye, xyz in scene.items()
        }
        found: dict[Eye, Floats] = {}
        for eye, other in (EYES, EYES[::-1]):
            drawn = CompensatedPass(surface.context, models, correction, eye).run(textures[eye], textures[other])
            codes = np.frombuffer(drawn.read(components=3, dtype="f1", alignment=1), np.uint8)
            found[eye] = codes.reshape(SCENE_PX[1], SCENE_PX[0], 3)[::-1].reshape(-1, 3) / 255.0
    return found


@pytest.mark.parametrize("crosstalk", [None, LEAKS])
def test_all_together_is_what_the_framebuffers_hold(crosstalk: Crosstalk | None) -> None:
    models, scene = _rig().models, _scene(_rig())
    codes = _framebuffers(models, Correction(crosstalk), scene)
    seen = seen_XYZ(models, crosstalk, codes["left"], codes["right"])
    steps = {PathStep.GAMUT_CLIP, PathStep.AMBIENT_LIGHT, PathStep.CROSSTALK, PathStep.LOOK_UP_TABLE, PathStep.CODES}
    asked = {eye: view.reshape(-1, 3) for eye, view in scene.items()}
    budgeted = OwnPixels(models, Encoding(255, ENTRIES, dithered=False), Correction(crosstalk)).seen(asked, steps)
    for eye, shown in zip(EYES, seen, strict=True):
        white = models.eye(eye).white_XYZ_cd_m2
        there, here = (
            delta_e_2000(xyz_to_lab(asked[eye], white), xyz_to_lab(xyz, white)) for xyz in (shown, budgeted[eye])
        )
        assert here.mean() > 0.1
        # A picture is uploaded in 32 bits: now and then that rounds to the next code.
        assert np.mean(np.abs(there - here) > 1e-6) < 1e-3
        assert here.mean() == pytest.approx(there.mean(), rel=1e-3)


def test_the_shipped_rig_has_a_number_for_what_is_known_and_none_for_what_is_not() -> None:
    budget = rig_budget(_rig())
    known = {row.step for row in budget.rows if row.eyes is not None}
    computed = "half_floats resampling gamut_clip look_up_table codes all_together"
    assert known == set(computed.split())
    assert budget.row(PathStep.CHARACTERISATION).words == "the display file does not state it"
    assert {budget.row(step).words for step in (PathStep.CROSSTALK, PathStep.GAIN_MAP, PathStep.AMBIENT_LIGHT)} == {
        "not measured"
    }
    eyes = {step: budget.row(step).eyes for step in known}
    together, codes = eyes[PathStep.TOGETHER], eyes[PathStep.CODES]
    assert together is not None
    assert codes is not None
    assert 0.0 < codes["left"].mean < together["left"].mean < codes["left"].mean + 0.2


@pytest.mark.nightly
def test_dither_and_more_bits_cost_less_than_rounding() -> None:
    rounded, dithered, ten = (
        rig_budget(rig, encoding).row(PathStep.CODES).eyes
        for rig, encoding in (
            (_rig(), None),
            (_rig(dither="shared"), None),
            (_rig(), Encoding(1023, 2 * ENTRIES, dithered=False)),
        )
    )
    assert rounded is not None
    assert dithered is not None
    assert ten is not None
    assert dithered["left"].mean < 0.1 * rounded["left"].mean
    assert 0.2 * rounded["left"].mean < ten["left"].mean < 0.3 * rounded["left"].mean


@pytest.mark.nightly
def test_what_a_fit_wrote_on_its_held_out_readings_is_the_residual(tmp_path: Path) -> None:
    codes = table_c1_codes()
    noisy = thesis_display().xyz(codes) * np.random.default_rng(1).normal(1.0, 0.01, (len(codes), 1))
    fit = fit_display(Measurements(codes, noisy), mode="side-by-side", model="gog")
    file = tmp_path / "display.yaml"
    fit.write(file, PanelSpec(resolution_px=(640, 480), pixel_pitch_mm=0.25))
    held_out = fit.eyes["both"].characterisation.chosen.held_out
    (tmp_path / "rig.yaml").write_text(
        "schema_version: 1\ndisplay: display.yaml\nmode: side-by-side\ndistance_mm: 700\n"
    )
    row = rig_budget(read_rig(tmp_path / "rig.yaml")).row(PathStep.CHARACTERISATION)
    assert row.eyes is not None
    assert row.eyes["right"].p95 == round(held_out.p95, 2) > 0.0
    assert row.eyes["left"].mean == round(held_out.mean, 2) > 0.0
    assert set(read_display(file).held_out["side-by-side"]) == set(EYES)


def test_a_nominal_display_has_no_residual_and_says_so(study: Study) -> None:
    study.edit("rig.yaml", "display: display.yaml", "display: {nominal: srgb, white_cd_m2: 100}")
    study.edit(
        "rig.yaml", "white_cd_m2: 100}", "white_cd_m2: 100, panel: {resolution_px: [640, 480], pixel_pitch_mm: 0.25}}"
    )
    row = rig_budget(read_rig(study.folder / "rig.yaml")).row(PathStep.CHARACTERISATION)
    assert (row.words, row.eyes) == ("not measured: nominal sRGB", None)


@pytest.mark.parametrize("mode", ["anaglyph-red-cyan", "side-by-side-half", *nightly("flat")])
def test_every_kind_of_mode_has_a_budget(mode: str) -> None:
    rig = read_rig(RIG, mode, allow_uncharacterised=True)
    budget = rig_budget(rig)
    steps = {row.step for row in budget.rows}
    assert (PathStep.FILTERS in steps) == mode.startswith("anaglyph")
    assert (PathStep.CROSSTALK in steps) == (mode == "side-by-side-half")
    assert ("half a signal" in budget.row(PathStep.TOGETHER).words) == mode.endswith("half")


def _budget(study: Study, *more: str) -> Any:
    words = ["check", str(study.experiment), "--no-screen", "--results", str(study.results), "--budget", *more]
    return CliRunner().invoke(group, words)


def test_the_table_is_printed_with_lines_in_columns(study: Study) -> None:
    lines = _budget(study).stdout.splitlines()
    at = next(n for n, line in enumerate(lines) if "mean left" in line)
    head, first, unknown = lines[at], lines[at + 1], next(line for line in lines if "crosstalk left" in line)
    assert first[: head.index("p95") + 3].split()[-1].replace(".", "").isdigit()
    assert unknown.split("not measured")[0].count("-") == 6


def test_a_file_that_has_no_budget_is_an_error(study: Study) -> None:
    (error,) = check_file(study.folder / "display.yaml", CheckOptions(budget=True)).errors
    assert "a display has no error budget" in error.message
    assert "rig or an experiment" in str(error.remedy)


PAGE = RIG.parents[2] / "docs/diagnose.md"
CORNERS = [[80.0, 90.0, 80.0], [90.0, 100.0, 90.0], [80.0, 90.0, 80.0]]


def _changed(name: str) -> Rig:
    """Return the shipped rig with what a row of the page's second table says."""
    rig = _rig()
    if name == "a panel of 10 bits":
        panel = rig.display.panel.model_copy(update={"bits": 10})
        return replace(rig, display=replace(rig.display, panel=panel))
    if "leaks" in name or "lift_black" in name:
        leaks = {"side-by-side": Crosstalk(0.02 * np.eye(3), 0.02 * np.eye(3))}
        spec = rig.spec.model_copy(update={"lift_black": "lift_black" in name})
        return replace(rig, display=replace(rig.display, crosstalks=leaks), spec=spec)
    if "room" in name:
        light = 0.1 * np.array([0.9505, 1.0, 1.089])
        return replace(rig, models=rig.models.in_room(light, light))
    if "normalise" in name:
        normalise: Any = "minimum" if "minimum" in name else "centre"
        gain_map = GainMap(np.array(CORNERS), rig.display.panel.resolution_px, "corners", normalise)
        return replace(rig, display=replace(rig.display, gain_maps={"side-by-side": gain_map}))
    assert name == "`dither: shared` in the rig"
    return replace(rig, spec=rig.spec.model_copy(update={"dither": "shared"}))


def _tables() -> list[list[list[str]]]:
    """Return the cells of the page's tables of costs, without their heads."""
    tables: list[list[list[str]]] = [[]]
    for line in PAGE.read_text(encoding="utf-8").partition("## What does the shipped rig cost?")[2].splitlines():
        if line.startswith("|"):
            tables[-1].append([cell.strip() for cell in line.strip("|").split("|")])
        elif tables[-1]:
            tables.append([])
    return [table[2:] for table in tables if table]


def _stated(cells: list[str], budget: ErrorBudget, step: str) -> None:
    """Compare a row's mean, 95th percentile and largest, two digits each, with those of the left eye."""
    eyes = budget.row(PathStep(step.replace(" ", "_"))).eyes
    if cells == ["", "", ""]:
        assert eyes is None, step
        return
    assert eyes is not None, step
    for cell, name in zip(cells, ("mean", "p95", "max"), strict=True):
        # Two digits are within 5 % of a number that begins with 1.
        assert float(cell) == pytest.approx(getattr(eyes["left"], name), rel=0.05, abs=1e-6), (step, name)


@pytest.mark.nightly
def test_the_page_states_what_the_shipped_rig_costs() -> None:
    shipped, changed = _tables()
    budget = rig_budget(_rig())
    assert [row[0].replace(" ", "_") for row in shipped] == [str(row.step) for row in budget.rows]
    for step, *cells, _ in shipped:
        _stated(cells, budget, step)
    assert len(changed) == 7
    names = [row[0] for row in changed]
    for name, (_, step, *cells) in zip(names, changed, strict=True):
        before = names[names.index(name) - 1]
        _stated(cells, rig_budget(_changed(f"{before}; {name}" if name.startswith("the same") else name)), step)
