"""`cyclopean display fit` and `convert`, from a table of readings to a display file and through it."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from devices.characterise import choose, display_fit, table_c1_codes, thesis_display
from devices.colour import delta_e_2000, xyz_to_lab
from devices.display import EYES, GammaTable, Plvc, read_display
from devices.errors import DeviceError
from devices.readings import Measurements, read_measurements, write_csv
from devices.readings.ti3 import write_ti3
from runner.cli.main import group
from runner.presenter import LoadedTable
from runner.presenter.gamma_check import compare_tables
from tests.choice import nightly
from tests.example_displays import liquid_crystal_XYZ, noisy
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


def _run(*arguments: str, given: str | None = None) -> str:
    result = CliRunner().invoke(group, ["display", *arguments], input=given)
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result.stdout


def _there_and_back(display: Path, codes: str) -> list[list[str]]:
    """Return the cells of a table of codes, converted to XYZ and back by the only mode of a display file."""
    XYZ = _run("convert", "--display", str(display), "--to", "xyz", given=codes)
    told = _run("convert", "--display", str(display), "--to", "code", given=XYZ)
    return [line.split(",") for line in told.splitlines()]


def test_the_table_names_every_candidate_and_the_chosen(thesis: Path, tmp_path: Path) -> None:
    """JSON holds their held-out figures; both that a model is chosen by stand in ``source`` of the display file."""
    told = _run("fit", str(thesis))
    assert "→ gog" in told
    for name in ("gamma", "ggo", "gogo", "table", "plvc", "residual"):
        assert name in told
    assert "Where it errs:" in told


@pytest.mark.parametrize("model", nightly("gamma", "gog", "ggo", "gogo", "table"))
def test_a_display_file_gives_the_model_back_and_converts(thesis: Path, tmp_path: Path, model: str) -> None:
    path = tmp_path / "d.yaml"
    told = _run("fit", str(thesis), "--model", model, "-o", str(path), *PANEL)
    assert "wrote" in told
    display = read_display(path)
    assert model in display.sources["quad-buffered"]
    assert "ΔE00" in display.sources["quad-buffered"]
    head, *rows = _there_and_back(path, "name,red,green,blue\na,60,120,200\nb,255,255,255\n")
    assert head == ["name", "red", "green", "blue"]
    np.testing.assert_allclose([float(v) for v in rows[0][1:]], [60, 120, 200], atol=1e-4)


@pytest.mark.nightly
@pytest.mark.parametrize("model", ["gog", *nightly("gamma", "ggo", "table")])
def test_the_black_that_is_printed_is_the_light_of_code_0(tmp_path: Path, model: str) -> None:
    """A GOG has its black in the curves' offsets: its own term is 0."""
    file = tmp_path / "lit.csv"
    light = thesis_display().xyz(CODES) + [0.095, 0.1, 0.109]
    write_csv(Measurements(CODES, light, mode="quad-buffered"), file)
    said = _run("fit", str(file), "--model", model, "--brief")
    (line,) = (line for line in said.splitlines() if line.startswith("Its black"))
    by_model, as_read = (float(value) for value in re.findall(r"Y ([\d.]+)", line))
    black = light[np.all(CODES == 0, axis=1)].mean(axis=0)
    assert as_read == pytest.approx(black[1], abs=1e-4)
    if model == "gamma":
        assert by_model == 0.0  # it has none, and both are said
    else:
        assert by_model == pytest.approx(black[1], rel=0.3)


@pytest.mark.nightly
@pytest.mark.parametrize("observer", ["CIE 1964 10", "CIE 1931 2"])
def test_the_observer_of_readings_is_said(tmp_path: Path, observer: str) -> None:
    file = tmp_path / "r.ti3"
    write_ti3(Measurements(CODES, thesis_display().xyz(CODES), mode="flat", observer=observer), file)
    assert f"Colorimetric observer: {observer}°" in _run("fit", str(file), "--model", "gog", "--brief")


@pytest.mark.nightly
def test_a_ti3_is_fitted_and_converted(thesis: Path, tmp_path: Path) -> None:
    file, path = tmp_path / "thesis.ti3", tmp_path / "d.yaml"
    readings = replace(read_measurements(thesis), eye=("left",) * 120)
    write_ti3(readings, file)
    told = _run("fit", str(file), "--model", "gog", "-o", str(path), *PANEL)
    assert "the left lens stands for both eyes" in told
    model = read_display(path).models("quad-buffered").left
    for target, columns, given, found in (
        ("xyz", "X,Y,Z", readings.codes, model.xyz),
        ("code", "red,green,blue", readings.XYZ, lambda XYZ: 255 * model.code(XYZ)),
    ):
        told = _run("convert", str(file), "--display", str(path), "--mode", "quad-buffered", "--to", target)
        head, *rows = [line.split(",") for line in told.splitlines()]
        assert head == ["name", *columns.split(",")]
        assert [row[0] for row in rows] == list(readings.name)
        np.testing.assert_allclose(np.array([row[1:] for row in rows], dtype=float), found(given), rtol=1e-8)


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


@pytest.mark.nightly
def test_a_calibrated_display_whose_calibration_ends_low_is_fitted_with_its_table(tmp_path: Path) -> None:
    """Readings through dispread -k: the codes stay as sent, and the calibration becomes the mode's gamma table."""
    calibration = GammaTable.from_shares(np.linspace(0.0, 1.0, 256)[:, None] * [0.97, 0.746, 0.68])
    light = noisy(thesis_display().xyz(calibration.at(CODES)), 0.002, 1)
    file, path = tmp_path / "calibrated.ti3", tmp_path / "d.yaml"
    write_ti3(Measurements(CODES, light, mode="flat", gamma_table=calibration), file)
    told = _run("fit", str(file), "--model", "gog", "-o", str(path), *PANEL)
    assert "only while this calibration is loaded" in told
    display = read_display(path)
    held = display.gamma_table("flat", "left")
    assert held.same_as(calibration)
    # What run and check compare: that calibration is right, and an identity table is another one.
    for loaded, right in ((calibration, True), (GammaTable.identity(256), False)):
        verdict = compare_tables(display.gamma_tables["flat"], dict.fromkeys(EYES, LoadedTable("DP-1", loaded)))
        assert (not verdict.refusal) is right
    model, white = display.models("flat").left, light.max(axis=0)
    apart = delta_e_2000(xyz_to_lab(model.xyz(CODES), white), xyz_to_lab(light, white))
    assert apart.mean() < 0.3


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


@pytest.mark.nightly
def test_plvc_is_written_and_read_and_converts_as_it_was_fitted(tmp_path: Path) -> None:
    file, path = tmp_path / "lcd.csv", tmp_path / "d.yaml"
    XYZ = liquid_crystal_XYZ(CODES)
    write_csv(Measurements(CODES, XYZ, mode="flat"), file)
    told = json.loads(_run("fit", str(file), "--model", "plvc", "--json", "-o", str(path), *PANEL))
    assert told["both"]["chosen"] == "plvc"
    model = read_display(path).models("flat").left
    assert isinstance(model, Plvc)
    white = model.white_XYZ_cd_m2
    off = delta_e_2000(xyz_to_lab(model.xyz(CODES), white), xyz_to_lab(XYZ, white))
    held = next(one for one in told["both"]["candidates"] if one["model"] == "plvc")["fitted_delta_e_2000"]
    assert off.mean() == pytest.approx(held["mean"], abs=0.01)
    found = _there_and_back(path, "red,green,blue\n200,100,50\n10,20,30\n")[1:]
    np.testing.assert_allclose(np.array(found, dtype=float), [[200, 100, 50], [10, 20, 30]], atol=1e-6)


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
        _run("convert", "--display", str(gog), "--mode", "quad-buffered", "--to", "xyz", given=given)


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
