"""`cyclopean compare --measures`: the table in the terminal, in JSON and on the page, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from stimuli.comparison import CompareOptions, compare_pictures
from stimuli.measures import ViewingConditions
from tests.stimuli.comparison.scenes import PLATE, RIG, Cyclopean, compared, few, written

NAMES = "delta-e-2000,s-cielab,pu-ssim,pu-psnr"


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
def test_a_pair_has_a_row_for_each_measure_and_a_figure_for_each_eye(tmp_path: Path, cyclopean: Cyclopean) -> None:
    photo = written(tmp_path / "a.exr", few(), few(1.0))
    other = written(tmp_path / "b.exr", few(gain=1.02), few(1.0, gain=1.04))
    page = tmp_path / "out.html"
    words = ("--regions", PLATE, "--rig", RIG, "--measures", "delta-e-2000", "--measures", NAMES, "-o", page)
    found = compared(cyclopean, photo, other, *words, expect=None)
    rows = {row["name"]: row for row in found["measures"]}
    assert list(rows) == NAMES.split(",")
    for eye in ("left", "right"):
        # One engine: the mean over the same pixels.
        assert rows["delta-e-2000"][eye] == pytest.approx(found["eyes"][eye]["per_pixel"]["mean"], abs=1e-5)
        assert rows["s-cielab"][eye] == pytest.approx(found["eyes"][eye]["as_seen"]["mean"], abs=1e-5)
    for name in ("delta-e-2000", "s-cielab", "pu-ssim"):
        assert rows[name]["binocular"] == pytest.approx((rows[name]["left"] + rows[name]["right"]) / 2, rel=1e-12)
    assert rows["delta-e-2000"]["left"] < rows["delta-e-2000"]["right"]
    assert rows["pu-psnr"]["left"] > rows["pu-psnr"]["binocular"] > rows["pu-psnr"]["right"]
    assert "both eyes</th>" in page.read_text(encoding="utf-8")


def test_the_terminal_prints_the_table(tmp_path: Path, cyclopean: Cyclopean) -> None:
    photo, other = written(tmp_path / "a.exr", few()), written(tmp_path / "b.exr", few(gain=1.02))
    told = cyclopean("compare", photo, other, "--regions", PLATE, "--rig", RIG, "--measures", NAMES, expect=None)
    lines = told.stdout.splitlines()
    at = lines.index("Measures:")
    assert lines[at + 1].split() == ["measure", "value"]
    assert [line.split()[0] for line in lines[at + 2 : at + 6]] == ["ΔE00", "S-CIELAB", "PU21-SSIM", "PU21-PSNR"]


def test_identical_pictures_have_no_number_for_infinity(tmp_path: Path, cyclopean: Cyclopean) -> None:
    photo = written(tmp_path / "a.exr", few())
    found = compared(cyclopean, photo, photo, "--regions", PLATE, "--rig", RIG, "--measures", NAMES)
    assert [row["both"] for row in found["measures"]] == [0.0, 0.0, 1.0, None]


def test_only_pixels_that_count_are_measured(tmp_path: Path) -> None:
    light = few()
    spoilt = few(gain=1.02).copy()
    spoilt[:40] *= 3.0
    regions = tmp_path / "regions.yaml"
    height, width = light.shape[:2]
    middle = f"{{kind: rectangle, name: middle, box: [20, 60, {width - 40}, {height - 80}]}}"
    regions.write_text(f"schema_version: 1\nregions:\n  - {middle}\n", encoding="utf-8")
    photo = written(tmp_path / "a.exr", light)
    viewing = ViewingConditions(45.0, np.array([95.0, 100.0, 108.9]))
    options = CompareOptions(register="none", viewing=viewing, measures=("delta-e-2000", "pu-ssim"))
    values = {}
    for name, other in (("plain", few(gain=1.02)), ("spoilt", spoilt)):
        table = compare_pictures(photo, written(tmp_path / f"{name}.exr", other), regions, options).measures
        assert table is not None
        values[name] = [row.eyes["both"].value for row in table.rows]
    assert values["spoilt"] == values["plain"]


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--rig", RIG, "--measures", "flipp"), "there is no measure 'flipp' (did you mean 'flip'?)"),
        (("--measures", "pu-ssim"), "give --rig RIG.yaml"),
        (("--rig", RIG, "--measures", ","), "no measure is named"),
    ],
)
def test_what_cannot_be_measured_is_refused_in_one_line(
    tmp_path: Path, cyclopean: Cyclopean, words: tuple[object, ...], complaint: str
) -> None:
    files = tmp_path / "no.exr", tmp_path / "no.exr"
    told = cyclopean("compare", *files, "--regions", PLATE, "-o", tmp_path / "o.html", *words, expect=2)
    assert complaint in told.stderr
    assert len(told.stderr.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_a_missing_package_is_named(tmp_path: Path, cyclopean: Cyclopean, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stimuli.measures.measure.find_spec", lambda name: None)
    photo = written(tmp_path / "a.exr", few())
    told = cyclopean("compare", photo, photo, "--regions", PLATE, "--rig", RIG, "--measures", "flip", expect=2)
    assert "pip install '.[measures]'" in told.stderr
    assert len(told.stderr.splitlines()) == 1


@pytest.mark.nightly
def test_measures_make_a_table_and_do_not_change_the_verdict(tmp_path: Path, cyclopean: Cyclopean) -> None:
    photo, other = written(tmp_path / "a.exr", few()), written(tmp_path / "b.exr", few(gain=1.05))
    words = ("--regions", PLATE, "--rig", RIG)
    plain = compared(cyclopean, photo, other, *words, expect=None)
    measured = compared(cyclopean, photo, other, *words, "--measures", NAMES, expect=None)
    assert measured["verdict"] == plain["verdict"]
    assert measured["measures"] is not None
    assert plain["measures"] is None
