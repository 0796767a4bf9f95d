"""Names, places and texts made to do harm: `cyclopean compare` writes nothing where it should not."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner

from documents import InputError
from runner.cli.compare import _pair
from runner.cli.main import group
from runner.reports.comparison.experiment import checked_name
from runner.reports.comparison.report import check_page
from tests.stimuli.comparison.scenes import PLATE, RIG, Cyclopean, few, written


@pytest.mark.parametrize(
    "name",
    ["", ".", "..", "../up", "/etc/x", "a/b", "a\\b", "a.yaml", "-x", "A", "é", "a b", "a\n", "a\x00", "x" * 61]
    + ["con", "prn", "aux", "nul", "com1", "lpt9", "\u202ea"],
)
def test_an_experiment_s_name_cannot_lead_elsewhere(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="an experiment cannot be called") as caught:
        checked_name(name, tmp_path)
    assert str(caught.value).isprintable()


@pytest.mark.parametrize("name", ["a", "0", "console", "com10", "nul-1", "x" * 60])
def test_names_that_are_like_them_are_right(tmp_path: Path, name: str) -> None:
    checked_name(name, tmp_path)


@pytest.mark.parametrize("place", ["experiments/a.yaml", "configs/stimuli/a.yaml", "configs/stimuli/a"])
@pytest.mark.parametrize("there", ["file", "folder", "link that leads nowhere"])
def test_nothing_is_written_over_or_through(tmp_path: Path, place: str, there: str) -> None:
    path = tmp_path / place
    path.parent.mkdir(parents=True)
    if there == "file":
        path.write_text("mine")
    elif there == "folder":
        path.mkdir()
    else:
        path.symlink_to(tmp_path / "outside.yaml")
    with pytest.raises(InputError, match=re.escape(f"{place}: it is there already")):
        checked_name("a", tmp_path)


def test_an_empty_name_is_no_name(tmp_path: Path) -> None:
    file = tmp_path / "a.exr"
    words = ["compare", str(file), str(file), "--regions", str(PLATE), "--rig", str(RIG), "--experiment", ""]
    with pytest.raises(InputError, match="cannot be called ''"):
        CliRunner().invoke(group, words, catch_exceptions=False)


def _folder(path: Path) -> Path:
    (path / "a.html").mkdir()
    return path / "a.html"


def _below_a_file(path: Path) -> Path:
    (path / "file").write_text("")
    return path / "file" / "more" / "a.html"


@pytest.mark.parametrize("place", [_folder, _below_a_file])
def test_where_no_page_can_be_is_told_before_anything_is_written(tmp_path: Path, place: Callable[[Path], Path]) -> None:
    output = place(tmp_path)
    with pytest.raises(InputError) as caught:
        check_page(output, [])
    assert str(caught.value).startswith(str(output))


@pytest.mark.parametrize("text", ["nan,1", "1,inf", "1e308,1", "1", "1,2,3", ""])
def test_corners_are_numbers_that_a_picture_has(text: str) -> None:
    with pytest.raises(Exception, match="a corner is"):
        _pair(text)


BAD = "<img src=x onerror=alert(1)>&\"'"


@pytest.mark.nightly
def test_text_from_people_stays_text(tmp_path: Path, cyclopean: Cyclopean) -> None:
    folder = tmp_path / "<b>x"
    folder.mkdir()
    file = written(folder / "<script>alert(1)<!--.exr", few())
    regions = folder / "<i>r.yaml"
    region = json.dumps({"kind": "rectangle", "name": BAD, "box": [20, 20, 60, 80]})
    other = json.dumps({"kind": "rectangle", "name": "=HYPERLINK(1)\n</svg><script>", "box": [90, 20, 80, 80]})
    regions.write_text(f"schema_version: 1\nregions: [{region}, {other}]\n", encoding="utf-8")
    page = tmp_path / "out.html"
    done = cyclopean("compare", file, file, "--regions", regions, "-o", page, "--json", expect=None)
    assert done.returncode in (0, 1), done.stderr
    html = page.read_text(encoding="utf-8")
    assert "onerror" in html
    for tag in ("<script", "<img src=x", "<b>x", "<i>r", "<!--."):
        assert tag not in html
