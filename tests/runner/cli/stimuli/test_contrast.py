"""`cyclopean stimuli contrast` on a small plate."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import pytest

from documents import InputError
from tests.invoked import invoked

ROOT = Path(__file__).parents[4]


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))


@pytest.fixture
def recipe(tmp_path: Path) -> Path:
    text = (ROOT / "configs/stimuli/manitoba_gray.yaml").read_text(encoding="utf-8")
    small = tmp_path / "small.yaml"
    small.write_text(text.replace("size_mm: [150, 100]", "size_mm: [15, 10]"), encoding="utf-8")
    return small


run = partial(invoked, "stimuli", "contrast")


@pytest.mark.nightly
def test_the_stereo_pictures_that_were_not_scaled_are_measured(recipe: Path, tmp_path: Path) -> None:
    figure = tmp_path / "contrast.svg"
    rig = ROOT / "configs/rigs/asus_vg248qe_3dvision.yaml"
    result = run(recipe, "--rig", rig, "-o", figure)
    assert result.exit_code == 0, result.output
    lines = result.output.splitlines()
    assert [line.split()[0] for line in lines[1:4]] == ["1.1-stereo", "2.1-stereo", "3.1-stereo"]
    assert all("on the display" in line for line in lines[1:4])
    svg = figure.read_text()
    assert "1/15" in svg
    assert "on the display" in svg
    assert "mathdefault" not in svg
    found = json.loads(run(recipe, "--rig", rig, "--json", "--mean", 5).output)
    assert [row["mean_luminance_cd_m2"] for row in found["exposures"]] == pytest.approx([5, 5, 5], rel=1e-5)
    assert found["exposures"][0]["as_shown"]["weber_contrast"]["value"] > 1
    assert run(recipe, "--pixel-pitch-mm", 0.2768, "-o", tmp_path / "contrast.pdf").exit_code == 0
    assert (tmp_path / "contrast.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--stimuli", "1.1-stereo,2.1-sterio"), "there is no stimulus '2.1-sterio'"),
        (("--stimuli", "1.1-stereo,1.1-flat"), "'1.1-stereo' and '1.1-flat' have one exposure, 0.0666667 s"),
        (("--stimuli", "1.1-stereo"), "two exposures or more; there is one"),
        (("-o", "contrast.png"), "the figure is no .svg or .pdf file"),
    ],
)
def test_wrong_input_is_named(recipe: Path, words: tuple[str, ...], message: str) -> None:
    result = run(recipe, "--pixel-pitch-mm", 0.2768, *words)
    assert isinstance(result.exception, InputError)
    assert message in str(result.exception)
