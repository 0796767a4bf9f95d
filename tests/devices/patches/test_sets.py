"""The sets of patches, and patches from a person's own file."""

from __future__ import annotations

from pathlib import Path

import pytest

from devices.errors import DeviceError
from devices.patches import Patch, PatchSet, find_patches
from devices.patches.sets import CHARACTERISATIONS


def test_table_c1_holds_the_thesis_patches() -> None:
    patches = {patch.name: patch.codes for patch in find_patches("table_c1").patches}
    assert len(patches) == 120
    names = [name.rstrip("0123456789") for name in patches]
    counts = {name: names.count(name) for name in set(names)}
    assert counts == {
        "red": 26, "green": 26, "blue": 26, "gray": 25, "yellow": 5, "cyan": 5, "magenta": 5, "black": 1, "white": 1,
    }  # fmt: skip
    assert patches["red250"] == (250 / 255, 0, 0)
    assert patches["cyan150"] == (0, 150 / 255, 150 / 255)
    assert patches["gray120"] == (120 / 255,) * 3
    assert patches["white"] == (1, 1, 1)


@pytest.mark.parametrize("name", list(CHARACTERISATIONS))
def test_every_set_has_black_and_white_and_no_colour_twice(name: str) -> None:
    codes = [patch.rounded(255).codes for patch in find_patches(name).patches]
    assert len(set(codes)) == len(codes)
    assert (0.0, 0.0, 0.0) in codes
    assert (1.0, 1.0, 1.0) in codes


def test_half_of_the_dark_set_lies_in_the_lowest_quarter_of_codes() -> None:
    codes = [max(patch.codes) for patch in find_patches("dark").patches]
    assert sum(code <= 0.25 for code in codes) >= len(codes) / 2


def test_the_nearest_name_is_told() -> None:
    with pytest.raises(DeviceError, match="did you mean 'table_c1'"):
        find_patches("table_c")


def _file(tmp_path: Path, text: str) -> str:
    (tmp_path / "own.csv").write_text(text, encoding="utf-8")
    return str(tmp_path / "own.csv")


def test_a_file_declares_its_range(tmp_path: Path) -> None:
    own = find_patches(_file(tmp_path, "# codes: 0..1023\nname,red,green,blue\na,1023,0,512\nb,0,3,0\n"))
    assert own.patches == (Patch("a", (1.0, 0.0, 512 / 1023)), Patch("b", (0.0, 3 / 1023, 0.0)))


def test_the_option_goes_before_what_the_file_says(tmp_path: Path) -> None:
    file = _file(tmp_path, "# codes: 0..1023\nname,red,green,blue\na,200,0,0\n")
    assert find_patches(file, "0..200").patches[0].codes == (1.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("text", "finding"),
    [
        ("name,red,green,blue\na,12,3,4\n", "declare it"),
        ("# codes: 0..255\nname,red,green,blue\na,256,0,0\n", "own.csv:3:2: the code 256 lies outside"),
        ("# codes: 0..255\nname,red,green,blue\na,1,x,0\n", "own.csv:3:3: green is 'x'"),
        ("# codes: 0..255\nname,red,green,blue\na,1,nan,0\n", "own.csv:3:3: green is 'nan'"),
        ("# codes: 0..255\nname,red,green,blue\na,1,2,0\nb,1,2\n", "own.csv:4: the line has 3 fields"),
        ("# codes: 0..255\nname,red,green,blue\na,1,2,0\na,1,2,1\n", "own.csv:4: 'a' stands in line 3 too"),
        ("# codes: 0..255\nname,red,green\na,1,2\n", "own.csv:2: the header has no blue"),
        ("# codes: up\nname,red,green,blue\na,1,2,3\n", "own.csv:1: 'up' is no range"),
        ("", "has no rows"),
    ],
)
def test_a_wrong_file_names_its_place(tmp_path: Path, text: str, finding: str) -> None:
    with pytest.raises(DeviceError) as caught:
        find_patches(_file(tmp_path, text))
    assert finding in str(caught.value)


def test_a_patch_is_rounded_to_codes_of_the_surface() -> None:
    assert Patch("a", (0.1, 0.5, 1.0)).rounded(255).codes == (26 / 255, 128 / 255, 1.0)
    assert Patch("a", (0.1, 0.5, 1.0)).rounded(1023).codes == (102 / 1023, 512 / 1023, 1.0)


@pytest.mark.parametrize(("name", "code"), [("a#2", 0.5), ("", 0.5), ("a", 1.1), ("a", -0.1), ("a", float("nan"))])
def test_a_patch_refuses_what_cannot_be(name: str, code: float) -> None:
    with pytest.raises(DeviceError):
        Patch(name, (code, 0.0, 0.0))


def test_a_set_refuses_a_name_twice_and_no_patches() -> None:
    with pytest.raises(DeviceError, match="called 'a'"):
        PatchSet("s", (Patch("a", (0.0, 0.0, 0.0)), Patch("a", (0.1, 0.0, 0.0))))
    with pytest.raises(DeviceError, match="no patches"):
        PatchSet("s", ())
