"""Pairs are compared eye by eye and in depth; faults that only two eyes see are found and named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.records import read_session
from stimuli.comparison import CompareOptions, Comparison, compare_pictures
from stimuli.comparison.binocular import measure_binocular
from stimuli.comparison.binocular_reasons import BinocularEvidence, binocular_reasons
from stimuli.comparison.disparities import EyesPair
from stimuli.comparison.eye_identity import identify_eyes
from stimuli.comparison.verdict import Limits
from stimuli.pictures import read_exr
from tests.kept import kept, known
from tests.stimuli.comparison.scenes import PLATE, RIG, ROOT, Cyclopean, coloured, compared, few, said, written
from tests.stimuli.comparison.two_eye_scenes import Pair, Relief, Scene, Sparkles, contrasted, rendered


# Pairs are compared eye by eye, and in depth; and become an experiment.
@pytest.mark.nightly
def test_depth_is_compared(tmp_path: Path, cyclopean: Cyclopean) -> None:
    photo = written(tmp_path / "a.exr", few(), few(1.0))
    same, deeper = (written(tmp_path / f"{name}.exr", few(0.3), few(0.3 + d)) for name, d in (("b", 1.0), ("c", 3.0)))
    found = compared(cyclopean, photo, same, "--regions", PLATE)
    assert found["decision"] == "validated"
    assert list(found["eyes"]) == ["left", "right"]
    found = compared(cyclopean, photo, deeper, "--regions", PLATE, expect=1)
    assert found["disparity"]["difference_px"] == pytest.approx([2.0, 0.0], abs=0.05)
    assert [line for line in said(found, "fails") if "disparity" not in line] == []
    assert any(line.startswith("both eyes: disparity across differs by ") for line in said(found, "fails"))
    shifts = [found["eyes"][eye]["registration"]["shift_px"][0] for eye in ("left", "right")]
    assert shifts == pytest.approx([0.3, 2.3], abs=0.02)


def test_both_eyes_have_one_luminance_factor_and_one_white(tmp_path: Path, cyclopean: Cyclopean) -> None:
    """A rendering has one unit: an eye that is darker than the other in it stays darker."""
    photo = written(tmp_path / "a.exr", few(), few(1.0))
    uneven = written(tmp_path / "b.exr", few(gain=2.0), few(1.0, gain=1.6))
    found = compared(cyclopean, photo, uneven, "--regions", PLATE, "--luminance", "mean_ratio", expect=None)
    tables = [found["eyes"][eye]["regions"] for eye in ("left", "right")]
    assert [table["scaled_by"] for table in tables] == pytest.approx([(1 / 2.0 + 1 / 1.6) / 2] * 2, rel=1e-3)
    assert tables[0]["factor"]["mean_ratio"] == pytest.approx(1 / 2.0, rel=1e-3)
    assert tables[0]["white_XYZ"] == tables[1]["white_XYZ"]
    assert tables[0]["rows"][0]["delta_e"] > 2
    assert tables[1]["rows"][0]["delta_L"] * tables[0]["rows"][0]["delta_L"] < 0


@pytest.mark.nightly
@pytest.mark.parametrize("stereo", [pytest.param(True, marks=pytest.mark.nightly), False])
def test_an_experiment_follows(
    tmp_path: Path, cyclopean: Cyclopean, monkeypatch: pytest.MonkeyPatch, stereo: bool
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "configs").mkdir()
    for name in ("rigs", "displays"):
        (tmp_path / "configs" / name).symlink_to(ROOT / "configs" / name)
    rig = Path("configs/rigs") / RIG.name
    words = tuple(
        written(tmp_path / name, few(gain=gain), few(1.0, gain=gain) if stereo else None)
        for name, gain in (("a b.exr", 1.0), ("b.exr", 1.02))
    )
    found = compared(
        cyclopean, *words, "--regions", PLATE, "--rig", rig, "--experiment", "study", "--luminance", "mean_ratio"
    )
    assert found["written"]["experiment"][0] == "experiments/study.yaml"
    photo, rendering = (read_exr(Path(f"configs/stimuli/study/{name}.exr")) for name in ("photograph", "rendering"))
    assert photo.is_flat != stereo
    np.testing.assert_allclose(photo.left, few(), rtol=1e-3)
    np.testing.assert_allclose(rendering.left, photo.left, rtol=2e-3)  # the factor was undone
    words_told = Path("experiments/study.yaml").read_text(encoding="utf-8")
    assert "Up arrow: the upper image is closer." in words_told or "Left arrow: the left image is closer." in words_told
    assert "rendering" in cyclopean("check", "experiments/study.yaml", "--json").stdout
    views = ("-stereo", "-flat") if stereo else ("",)
    stimuli = [f"{name}{view}" for name in ("photograph", "rendering") for view in views]
    lines = ["schema_version: 1", "kind: bradley_terry", "source: made up", "median_response_time_s: 1.0", "stimuli:"]
    lines += [f"  {name}: {{score: 1}}" for name in stimuli]
    Path("observers.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    ran = cyclopean("run", "experiments/study.yaml", "--observer", "01", "--simulate", "observers.yaml", "--json")
    assert ran.returncode == 0
    (answers,) = Path("results").rglob("session.jsonl")
    pairs = len(stimuli) * (len(stimuli) - 1) // 2
    asked = [trial for trial in read_session(answers).trials if trial.kind == "all_pairs"]
    assert len(asked) == 10 * pairs
    again = cyclopean("compare", *words, "--regions", PLATE, "--rig", rig, "--experiment", "study", expect=2)
    assert "experiments/study.yaml: it is there already" in again.stderr


# Faults that only two eyes see are found and named; a rendering without them is validated, also with relief.

RELIEF, PAINT = Relief(shape=(200, 260)), Sparkles()
SMALL_RELIEF, SMALL_PAINT = Relief(shape=(150, 200)), Sparkles(count=330, shape=(140, 200))
FAULTS: dict[str, tuple[Callable[[], Pair], Scene, str]] = {
    "eyes swapped, relief": (lambda: rendered(RELIEF).views()[::-1], RELIEF, "the rendering's eyes are exchanged"),
    "eyes swapped, sparkles": (lambda: rendered(PAINT).views()[::-1], PAINT, "the rendering's eyes are exchanged"),
    "left view twice, relief": (lambda: (rendered(RELIEF).views()[0],) * 2, RELIEF, "show the left view"),
    "right view twice, sparkles": (lambda: (rendered(PAINT).views()[1],) * 2, PAINT, "show the right view"),
    "contrast 2, relief": (lambda: contrasted(rendered(RELIEF).views(), 2.0), RELIEF, "times the left eye's contrast"),
    "contrast 2, sparkles": (lambda: contrasted(rendered(PAINT).views(), 2.0), PAINT, "times the left eye's contrast"),
    "base 1.2": (lambda: replace(rendered(RELIEF), base=1.2).views(), RELIEF, "times the photograph's, more than"),
    "depth inverted": (lambda: replace(rendered(RELIEF), base=-1.0).views(), RELIEF, "depth is inverted"),
    "sparkles shuffled": (lambda: Sparkles(shuffled=1.0, noise=1).views(), PAINT, "right eye has its sparkles"),
    "roll of 1°": (lambda: replace(rendered(RELIEF), roll_deg=1.0).views(), RELIEF, "right view is turned by"),
}


def fails_of(result: Comparison) -> list[str]:
    return [reason.sentence for reason in result.verdict.having("fails")]


@kept
def evidence(photo: Pair, rendering: Pair) -> BinocularEvidence:
    everywhere = np.ones(photo[0].shape, dtype=np.bool_)
    eyes = measure_binocular(photo, rendering, everywhere, everywhere)
    return BinocularEvidence(eyes.measures, identify_eyes(photo, rendering), (eyes.photo.used, eyes.rendering.used))


def fails(photo: Pair, rendering: Pair) -> list[str]:
    return [one.sentence for one in binocular_reasons(evidence(photo, rendering), Limits()) if one.outcome == "fails"]


def compare(folder: Path, photo: Pair, rendering: Pair) -> Comparison:
    first, second = (
        written(folder / "a.exr", *map(coloured, photo)),
        written(folder / "b.exr", *map(coloured, rendering)),
    )
    return compare_pictures(first, second, PLATE)


# Told of sparkles, or of the other eye.
TOLD_ELSEWHERE = (
    "eyes swapped, relief",
    "eyes swapped, sparkles",
    "left view twice, relief",
    "contrast 2, sparkles",
    "base 1.2",
    "roll of 1°",
)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.nightly) if name in TOLD_ELSEWHERE else name for name in FAULTS]
)
def test_a_planted_fault_is_named(name: str) -> None:
    rendering, photo, words = FAULTS[name]
    found = fails(photo.views(), rendering())
    assert any(words in sentence for sentence in found), found


def test_sizes_are_measured() -> None:
    """Of the roll, the base and the contrast that were planted."""
    photo = RELIEF.views()
    rolled = evidence(photo, replace(rendered(RELIEF), roll_deg=1.0).views()).measures["roll"]
    assert rolled.difference == pytest.approx(1.0, abs=0.05)
    deeper = evidence(photo, replace(rendered(RELIEF), base=1.2).views()).measures["depth scale"]
    assert deeper.rendering == pytest.approx(1.2, abs=0.02)
    stronger = evidence(photo, contrasted(rendered(RELIEF).views(), 2.0)).measures["eye contrast"]
    assert np.exp(stronger.difference) == pytest.approx(2.0, rel=0.05)


@pytest.mark.parametrize("photo", [RELIEF, PAINT])
def test_other_noise_is_no_fault(photo: Scene) -> None:
    assert fails(photo.views(), rendered(photo).views()) == []


@pytest.mark.nightly
def test_identical_pictures_differ_by_nothing(tmp_path: Path) -> None:
    views = SMALL_PAINT.views()
    result = compare(tmp_path, views, views)
    assert result.verdict.decision == "validated"
    for name, pair in known(result.disparity).eyes.measures.items():
        assert pair.difference == 0, name
        assert pair.standard_error == 0, name


def test_exchanged_eyes_are_changed_back_for_all_else(tmp_path: Path) -> None:
    result = compare(tmp_path, SMALL_RELIEF.views(), rendered(SMALL_RELIEF).views()[::-1])
    (reason,) = result.verdict.having("fails")
    assert reason.measure == "exchanged"
    assert result.rendering.notes == ("its eyes are exchanged, and were changed back for all that follows",)
    for eye in result.eyes.values():
        assert eye.per_pixel.mean < 1.4


def test_nothing_to_measure_depth_by() -> None:
    """Without texture in either picture depth decides nothing, and in one alone it is not known."""
    both, one = (binocular_reasons(BinocularEvidence({}, None, squares), Limits()) for squares in ((0, 0), (20, 1)))
    assert [reason.outcome for reason in both] == ["noted"]
    assert [reason.outcome for reason in one] == ["cannot say"]


@pytest.mark.parametrize(
    ("difference", "error", "outcome"),
    [(0.05, 0.01, "passes"), (0.15, 0.01, "fails"), (0.15, 0.03, "cannot say"), (0.0, 0.2, "cannot say")],
)
def test_a_measure_fails_beyond_its_limit_by_three_errors(difference: float, error: float, outcome: str) -> None:
    pair = EyesPair(0.5, 0.5 + difference, difference, error)
    reasons = binocular_reasons(BinocularEvidence({"one-eyed share": pair}, None, (0, 0)), Limits())
    assert reasons[0].outcome == outcome


@pytest.mark.nightly
def test_a_shift_of_both_eyes_is_no_fault(tmp_path: Path) -> None:
    left, right = rendered(SMALL_PAINT).views()
    shifted = (np.roll(left, (3, 5), axis=(0, 1)), np.roll(right, (3, 5), axis=(0, 1)))
    assert fails_of(compare(tmp_path, SMALL_PAINT.views(), shifted)) == []


@pytest.mark.nightly
def test_eyes_are_exchanged_in_a_turned_rendering(tmp_path: Path) -> None:
    from scipy.ndimage import rotate

    left, right = (rotate(view, 3.0, reshape=False, mode="nearest") for view in rendered(SMALL_PAINT).views())
    result = compare(tmp_path, SMALL_PAINT.views(), (right, left))
    assert any("eyes are exchanged" in line for line in fails_of(result))
    assert result.eyes["left"].alignment.rotation_deg == pytest.approx(-3.0, abs=0.05)


def test_views_without_any_texture(tmp_path: Path) -> None:
    """Nothing in two even pictures can differ but their light."""
    even = np.full((100, 140), 20.0, np.float32)
    files = [written(tmp_path / name, coloured(even), coloured(even)) for name in ("a.exr", "b.exr")]
    result = compare_pictures(files[0], files[1], PLATE, CompareOptions(register="none"))
    assert result.verdict.decision == "validated"
    assert any("neither picture has enough texture" in reason.sentence for reason in result.verdict.having("noted"))


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
def test_limits_can_be_set(tmp_path: Path, cyclopean: Cyclopean) -> None:
    regions = tmp_path / "regions.yaml"
    text = "schema_version: 1\nregions:\n  - {kind: plate}\nlimits: {depth_scale: 0.5, registration_residual_px: 2}\n"
    regions.write_text(text, encoding="utf-8")
    scene = Relief(shape=(200, 310))
    photo = written(tmp_path / "a.exr", *map(coloured, scene.views()))
    deeper = written(tmp_path / "b.exr", *map(coloured, replace(rendered(scene), base=1.2).views()))
    found = compared(cyclopean, photo, deeper, "--regions", regions, "-o", tmp_path / "page.html", expect=None)
    assert any("times the photograph's, within 50 %" in line for line in said(found, "passes"))
    measures = found["disparity"]["measures"]
    assert measures["depth scale"]["rendering"] == pytest.approx(1.2, abs=0.02)
    assert len(found["disparity"]["squares"]) > 20
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "As two eyes see it" in page
    assert "Disparities of squares at the same places" in page
