"""`cyclopean display fit` and `convert`, from a table of readings to a display file and through it."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from devices.characterise import choose, display_fit, table_c1_codes, thesis_display
from devices.display import read_display
from devices.errors import DeviceError
from devices.readings import Measurements, write_csv
from tests.example_displays import noisy
from tests.invoked import printed
from tests.kept import kept

CODES = table_c1_codes()
PANEL = ["--panel", "1920x1080,0.2768,120,8"]


@pytest.fixture(scope="module", autouse=True)
def fitted_once() -> Iterator[None]:
    """The same readings are fitted once, however many commands ask for it: only the model that is chosen differs."""

    with pytest.MonkeyPatch.context() as patch:
        for module, name in ((choose, "screen"), (display_fit, "thesis_fits")):
            patch.setattr(module, name, kept(getattr(module, name)))
        yield


@pytest.fixture
def thesis(tmp_path: Path) -> Path:
    path = tmp_path / "thesis.csv"
    _write_thesis(path)
    return path


def _write_thesis(path: Path) -> None:
    write_csv(Measurements(CODES, noisy(thesis_display().xyz(CODES), 0.002, 1), mode="quad-buffered"), path)


@pytest.fixture(scope="module")
def gog_text(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The display file of the thesis's display as a GOG, fitted once."""
    folder = tmp_path_factory.mktemp("fitted")
    _write_thesis(folder / "thesis.csv")
    _run("fit", str(folder / "thesis.csv"), "--model", "gog", "-o", str(folder / "d.yaml"), *PANEL)
    return (folder / "d.yaml").read_text(encoding="utf-8")


@pytest.fixture
def gog(gog_text: str, tmp_path: Path) -> Path:
    """That file in a folder of the test's own."""
    path = tmp_path / "d.yaml"
    path.write_text(gog_text, encoding="utf-8")
    return path


_run = partial(printed, "display")


def test_the_table_names_every_candidate_and_the_chosen(thesis: Path, tmp_path: Path) -> None:
    """JSON holds their held-out figures; both that a model is chosen by stand in ``source`` of the display file."""
    told = _run("fit", str(thesis))
    assert "→ gog" in told
    for name in ("gamma", "ggo", "gogo", "table", "plvc", "residual"):
        assert name in told
    assert "Where it errs:" in told


def test_json_holds_the_held_out_figures_and_the_display_file_how_far_light_is_off(
    thesis: Path, tmp_path: Path
) -> None:
    """Both figures that a model is chosen by stand in ``source``; that of ΔE00 is still read from there."""
    path = tmp_path / "d.yaml"
    told = json.loads(_run("fit", str(thesis), "-o", str(path), "--json", *PANEL))
    found = told["both"]
    assert (told["mode"], found["chosen"]) == ("quad-buffered", "gog")
    assert {c["model"] for c in found["candidates"]} == {"gamma", "gog", "ggo", "gogo", "table", "plvc", "residual"}
    assert found["candidates"][1]["standard_errors"]["red.gamma"] > 0
    assert found["thesis"]["method_2_light_from_code"]["gog"]["red"]["r2"] > 0.999
    chosen = next(each for each in found["candidates"] if each["model"] == found["chosen"])
    worst = max(
        (each for each in chosen["held_out_luminance"] if each["readings"] >= 3), key=lambda e: e["off_percent"]
    )
    display = read_display(path)
    text = path.read_text(encoding="utf-8")
    said = re.search(r"held-out luminance off by ([\d.]+) (%|times)", text)
    assert said is not None
    assert said[2] == "%"
    assert float(said[1]) == pytest.approx(worst["off_percent"], rel=0.1)
    assert display.held_out["quad-buffered"]["left"].mean == pytest.approx(
        chosen["held_out_delta_e_2000"]["mean"], abs=0.005
    )


def test_a_mode_is_added_and_nothing_else_changes(thesis: Path, tmp_path: Path) -> None:
    path = tmp_path / "d.yaml"
    before = (Path(__file__).parents[4] / "configs" / "displays" / "asus_vg248qe.yaml").read_text()
    path.write_text(before)
    _run("fit", str(thesis), "--model", "gog", "--mode", "flat", "-o", str(path))
    after = path.read_text()
    assert after.startswith(before.rstrip("\n"))
    assert set(read_display(path).modes) == {"quad-buffered", "side-by-side", "flat"}
    with pytest.raises(DeviceError, match="for both eyes already"):
        _run("fit", str(thesis), "--model", "gog", "--mode", "flat", "-o", str(path))
    assert path.read_text() == after
    assert not list(tmp_path.glob("*.part"))


def test_the_eyes_come_one_after_the_other(thesis: Path, tmp_path: Path) -> None:
    path = tmp_path / "d.yaml"
    one = _run("fit", str(thesis), "--model", "gog", "--eye", "left", "-o", str(path), *PANEL)
    assert "stands for both" not in one
    assert "before its right eye" in one
    assert read_display(path).lacking == {"quad-buffered": ("right",)}
    _run("fit", str(thesis), "--model", "gogo", "--eye", "right", "-o", str(path))
    assert not read_display(path).lacking
    assert "gogo" in path.read_text()
    with pytest.raises(DeviceError, match="of the left eye already"):
        _run("fit", str(thesis), "--model", "gog", "--eye", "left", "-o", str(path))
    _run("fit", str(thesis), "--model", "table", "--eye", "left", "-o", str(path), "--replace")
    text = path.read_text()
    assert "table fitted" in text
    assert "gogo fitted" in text
    assert "gog fitted" not in text


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ("red,green,blue\n300,0,0\n", "300"),
        ("red,green\n1,2\n", "no blue"),
        ("red,green,blue\n1,2,x\n", "'x'"),
        ("", "has no rows"),
    ],
)
def test_convert_names_what_is_wrong(gog: Path, given: str, says: str) -> None:
    with pytest.raises(DeviceError, match=says):
        _run("convert", "--display", str(gog), "--mode", "quad-buffered", "--to", "xyz", text=given)


def test_colours_outside_the_gamut_are_counted(gog: Path, cyclopean: Callable[..., Any]) -> None:
    words = ("display", "convert", "--display", gog, "--mode", "quad-buffered", "--to", "code")
    assert "1 of 2 colours" in cyclopean(*words, text="X,Y,Z\n100,0,0\n1,1,1\n").stderr


def test_tagged_readings_give_parts_and_those_of_no_use_are_told(gog_text: str, tmp_path: Path) -> None:
    display = thesis_display()
    grey, dark = [0.5] * 3, display.xyz([0, 0, 0])
    rows = [
        ("white@30deg", [1] * 3, display.xyz([1] * 3), "left"),
        ("gray@no-glasses", grey, 5 * display.xyz(grey), "both"),
    ]
    rows += [("gray", grey, display.xyz(grey), "both")]
    rows += [(f"gray@r{r}c{c}", grey, display.xyz(grey), "left") for r in (1, 2) for c in (1, 2)]
    for eye in ("left", "right"):
        rows += [("white", [1] * 3, display.xyz([1] * 3), eye), ("black", [0] * 3, dark, eye)]
        rows += [("black@other=white", [0] * 3, dark + 0.03 * (display.xyz([1] * 3) - dark), eye)]
    names, codes, XYZ, eyes = zip(*rows, strict=True)
    file, path = tmp_path / "tagged.csv", tmp_path / "d.yaml"
    write_csv(Measurements(np.array(codes), np.array(XYZ), names, eye=eyes, mode="quad-buffered"), file)
    told = _run("fit", str(file), "--model", "none")
    assert "Most leaks into the" in told
    assert "2 × 2 places" in told
    assert "left eye: At code 128 128 128" in told
    assert "1 reading at angles" in told
    with pytest.raises(DeviceError, match="no such display file yet"):
        _run("fit", str(file), "--model", "none", "-o", str(path), *PANEL)
    path.write_text(gog_text, encoding="utf-8")
    written = _run("fit", str(file), "--model", "none", "-o", str(path), "--json")
    assert json.loads(written)["parts"]["crosstalk"]["value"] == pytest.approx(3)
    display_file = read_display(path)
    assert display_file.crosstalk("quad-buffered") is not None
    assert display_file.gain_map("quad-buffered") is not None
    assert "tagged.csv" in path.read_text()


def test_the_tables_of_the_thesis_and_standard_errors_are_printed_unless_brief(thesis: Path) -> None:
    told = _run("fit", str(thesis), "--model", "gogo")
    for number in ("3.3", "3.4", "3.5", "3.6"):
        assert f"(as Table {number})" in told
    assert "condition" in told
    assert "± " in told
    brief = _run("fit", str(thesis), "--brief", "--model", "gogo")
    assert "Table" not in brief
    assert "Its black (code 0), in cd/m²: X 0.0" in brief


def test_readings_that_say_their_panel_need_no_option(thesis: Path, tmp_path: Path) -> None:
    path = tmp_path / "d.yaml"
    text = thesis.read_text()
    with pytest.raises(DeviceError, match="needs --panel"):
        _run("fit", str(thesis), "--model", "gog", "-o", str(path))
    thesis.write_text("# panel: 1920x1080;0.2768\n" + text)
    with pytest.raises(DeviceError, match=r"thesis\.csv: the panel that was measured is '1920x1080;0.2768'"):
        _run("fit", str(thesis), "--model", "gog", "-o", str(path))
    assert not path.exists()
    thesis.write_text("# panel: 1920x1080,0.2768,120,10\n" + text)
    told = _run("fit", str(thesis), "--model", "gog", "-o", str(path))
    assert "measured: 1920x1080,0.2768,120,10" in told
    assert read_display(path).panel.text == "1920x1080,0.2768,120,10"
    other = tmp_path / "other.yaml"
    assert "that was measured" not in _run("fit", str(thesis), "--model", "gog", "-o", str(other), *PANEL)
    assert read_display(other).panel.text == PANEL[1]
    # A file that is there has its panel already.
    told = _run("fit", str(thesis), "--model", "gog", "-o", str(other), "--mode", "more")
    assert "that was measured" not in told
    assert read_display(other).panel.text == PANEL[1]


def test_what_a_new_display_file_lacks_is_said_at_once_before_the_fit(tmp_path: Path) -> None:
    path = tmp_path / "readings.csv"
    path.write_text("red,green,blue,X,Y,Z\n0,0,0,0,0,0\n255,255,255,95,100,109\n")  # too few to be fitted
    with pytest.raises(DeviceError, match="a new one needs --panel") as refused:
        _run("fit", str(path), "-o", str(tmp_path / "new.yaml"))
    assert len(refused.value.findings) == 2
    assert "give --mode" in str(refused.value)
