"""`cyclopean display report`: the page in a browser, escaping, JSON, and what is said of wrong input."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from devices.diagnostics import MeasuredSet, PlotAxes, Trace, Verdicts, examine
from devices.errors import DeviceError
from devices.readings import write_csv
from documents.pages import page_html
from runner.cli.main import group
from runner.reports import draw_panel, short
from runner.reports.display.figure import COLOURS, looks
from runner.reports.display.page import page_of, typeset
from tests.choice import nightly
from tests.devices.diagnostics.simulated import MODEL, characterisation, crosstalk_readings
from tests.invoked import invoked
from tests.pages import Page, works_and_runs_nothing

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
QUIET = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"]
DISPLAY = """\
schema_version: 1
panel: {resolution_px: [1920, 1080], pixel_pitch_mm: 0.2768}
modes:
  quad-buffered:
    black_XYZ_cd_m2: [0.02, 0.021, 0.03]
    primaries_XYZ_cd_m2: {red: [10.83, 5.62, 0.54], green: [9.67, 18.65, 1.63], blue: [5.68, 2.20, 29.18]}
    curve: {kind: gamma, red: {gamma: 1.8132}, green: {gamma: 1.7649}, blue: {gamma: 1.7156}}
  flat: {same_as: quad-buffered}
"""
HOSTILE = '<script>alert(1)</script> $x^2$ & "quotes" 漢字'


@pytest.fixture(scope="module")
def verdicts() -> Verdicts:
    """Of both sets; every fourth of the figures, which take long, is drawn, once."""
    clipped = characterisation(2, light=lambda codes: MODEL.xyz(np.minimum(codes, 0.9)))
    hostile = replace(clipped, name=tuple(f"{HOSTILE} {name}" for name in clipped.name))
    special = crosstalk_readings({"left": 0.02, "right": 0.08})
    found = examine([MeasuredSet("panel.csv", hostile), MeasuredSet("special.csv", special)])
    first = {one.name: one for one in reversed(found)}
    drawn = [one for one in found if one is first[one.name] and one.series]
    found = tuple(one if one in drawn[::4] else replace(one, series=()) for one in found)
    return Verdicts("panel.csv, special.csv", found, ("<b>codes</b> were assumed",))


@pytest.fixture(scope="module")
def page(verdicts: Verdicts) -> str:
    return page_html(page_of(verdicts))


@pytest.fixture
def files(tmp_path: Path) -> Path:
    (tmp_path / "display.yaml").write_text(DISPLAY, encoding="utf-8")
    write_csv(replace(characterisation(), mode="quad-buffered"), tmp_path / "panel.csv")
    write_csv(characterisation(5, light=lambda codes: MODEL.xyz(codes) / 0.15), tmp_path / "bare.csv")
    write_csv(characterisation(5, light=lambda codes: MODEL.xyz(np.minimum(codes, 0.9))), tmp_path / "clipped.csv")
    return tmp_path


_run = partial(invoked, "display", "report")


def test_the_page_needs_nothing_but_itself(page: str) -> None:
    assert "http:" not in page.replace("http://www.w3.org/1999/xlink", "")
    assert "https:" not in page
    assert "@import" not in page
    assert not re.search(r"url\((?!#)", page)
    for tag, attributes in Page(page).tags:
        assert tag not in ("script", "iframe", "object", "embed", "base", "img")
        for name in ("src", "href", "xlink:href"):
            assert (attributes.get(name) or "#").startswith(("#", "data:,"))


def test_what_people_wrote_is_text(page: str) -> None:
    assert "<script" not in page
    assert "<b>codes</b>" not in page
    text = Page(page).text
    assert "<b>codes</b> were assumed" in text
    assert HOSTILE[:24] in text


def test_names_inside_the_page_are_its_own(page: str) -> None:
    names = [attributes["id"] for _, attributes in Page(page).tags if "id" in attributes]
    assert len(names) == len(set(names))
    for _, attributes in Page(page).tags:
        for name in ("href", "xlink:href"):
            target = attributes.get(name) or ""
            if target.startswith("#"):
                assert target[1:] in names
    for target in re.findall(r"url\(#([^)]+)\)", page):
        assert target in names


def test_verdicts_come_first_and_each_check_has_its_section(page: str, verdicts: Verdicts) -> None:
    parsed = Page(page)
    sections = [attributes["id"] for tag, attributes in parsed.tags if tag == "section" and "id" in attributes]
    assert sections == ["verdicts", *(f"check-{number}" for number in range(1, len(verdicts.diagnoses) + 1))]
    rows = parsed.text.count("Failed")
    assert rows == 2 * verdicts.failed > 0
    assert "crosstalk:" in parsed.text
    assert verdicts.sentence in parsed.text


@pytest.mark.nightly
def test_it_opens_and_runs_nothing(page: str, tmp_path: Path) -> None:
    works_and_runs_nothing(page, tmp_path)


@pytest.mark.parametrize("width", [pytest.param(1280, marks=pytest.mark.stress), *nightly(390)])
def test_the_page_fits_its_window(page: str, width: int, tmp_path: Path) -> None:
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed: the page is not opened in a browser")
    file = tmp_path / "page.html"
    frame = f'<iframe src="page.html" style="width:{width}px;height:800px;border:0"></iframe>'
    file.write_text(page, encoding="utf-8")
    outer = tmp_path / "outer.html"
    tell = "document.title = frames[0].document.documentElement.scrollWidth + ' of ' + frames[0].innerWidth"
    outer.write_text(f"<title>-</title>{frame}<script>onload = () => {{ {tell} }}</script>", encoding="utf-8")
    options = ["--dump-dom", "--allow-file-access-from-files", f"--user-data-dir={tmp_path / 'profile'}"]
    command = [CHROMIUM, *QUIET, *options, outer.as_uri()]
    shown = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True).stdout
    found = re.search(r"<title>(\d+) of (\d+)</title>", shown)
    assert found, shown[:300]
    assert int(found[2]) == width
    assert int(found[1]) <= width


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
def test_the_command_writes_the_page_and_tells_the_verdicts(files: Path) -> None:
    told = _run(files / "panel.csv", "--display", files / "display.yaml", "--without-glasses", files / "bare.csv")
    assert told.exit_code == 0, told.output
    assert (files / "panel.html").exists()
    assert "Failed" not in told.output
    assert re.search(r"Channel independence +Passed +[\d.]+ +at most 2 +%", told.output)
    assert "All " in told.output


def _error(*words: object) -> DeviceError:
    told = _run(*words)
    assert isinstance(told.exception, DeviceError), told.output
    return told.exception


def test_wrong_input_is_told_for_all_files_at_once(files: Path) -> None:
    (files / "bad.csv").write_text("# codes: 0..255\nred,green,blue,X,Y,Z\n0,0,0,1,x,1\n", encoding="utf-8")
    error = _error(files / "bad.csv", files / "none.csv")
    assert [finding.file and Path(finding.file).name for finding in error.findings] == ["bad.csv", "none.csv"]
    assert error.findings[0].line == 3
    twice = _error(files / "panel.csv", files / "." / "panel.csv")
    assert "named twice" in str(twice)


@pytest.mark.usefixtures("undrawn")
def test_a_mode_is_never_guessed(files: Path) -> None:
    error = _error(files / "bare.csv", "--display", files / "display.yaml")
    assert "--mode" in str(error)
    assert "--display" in str(_error(files / "bare.csv", "--mode", "flat"))
    unknown = _error(files / "bare.csv", "--display", files / "display.yaml", "--mode", "anaglyph")
    assert "not characterised" in str(unknown)


@pytest.mark.usefixtures("undrawn")
def test_a_failed_check_says_why_in_the_terminal_and_json_holds_every_diagnosis(files: Path) -> None:
    asked = (
        files / "clipped.csv",
        "--display",
        files / "display.yaml",
        "--mode",
        "flat",
        "-o",
        files / "out/page.html",
    )
    told, answer = _run(*asked), json.loads(_run(*asked, "--json").output)
    assert answer["report"].endswith("page.html")
    assert {"value", "limit", "unit", "source", "words", "series", "table"} <= answer["diagnoses"][0].keys()
    failed = [one for one in answer["diagnoses"] if one["passed"] is False]
    assert "headroom" in [one["name"] for one in failed]
    assert answer["failed"] == len(failed)
    words = " ".join(told.output.split())
    for one in failed:
        assert " ".join(one["words"].split()) in words
        assert f"The limit: {one['source']}." in words
    assert told.output.count("Failed") == len(failed)


def test_series_of_a_panel_are_told_apart_without_colour() -> None:
    """Patches that are read again and again are points in ink, each."""
    lines = [Trace(f"patch {number}", (1.0, 2.0), (1.0, 2.0), "ink", "points") for number in range(6)]
    lines += [
        Trace("", (1.0, 2.0), (1.0, 1.0), "soft", "line"),
        Trace("trend", (1.0, 2.0), (2.0, 1.0), "accent", "line"),
    ]
    lines += [Trace("other", (1.0, 2.0), (2.0, 2.0), "accent", "line")]
    found = looks(lines)
    points = found[:6]
    assert len({look.marker for look in points}) == len({look.colour for look in points}) == 6
    assert points[0].marker == "o"
    assert points[0].colour == COLOURS["ink"]
    assert found[7].dashes == "-" != found[8].dashes
    svg = draw_panel(PlotAxes("", "x", "y", tuple(lines)), "words").svg
    # The legend and the panel use each marker's outline.
    assert len(set(re.findall(r'<path id="(m[0-9a-f]+)"', svg))) >= 6


def test_figures_are_the_same_each_time() -> None:
    panel = PlotAxes("title", "x", "y", (Trace("a", (0.0, 1.0), (1.0, 2.0)),), (1.5,), x_names=("one",))
    assert draw_panel(panel, "words").svg == draw_panel(panel, "words").svg
    assert 'aria-label="&lt;&#34;"' in draw_panel(panel, '<"').svg


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (None, "–"),
        (0.0, "0"),
        (-1.25, "−1.25"),
        (123456.0, "123456"),
        (1e-9, "1.0e−09"),
        (0.99876, "0.9988"),
    ],
)
def test_numbers_are_short(value: float | None, words: str) -> None:
    assert short(value) == words


def test_minus_signs_stand_before_numbers_only() -> None:
    assert typeset("-5 % to +3, gray@-10deg, 8-bit") == "−5 % to +3, gray@-10deg, 8-bit"


@pytest.mark.usefixtures("undrawn")
def test_a_measurement_is_read_as_it_was_kept(files: Path) -> None:
    words = ["--mode", "flat", "--instrument", "simulated", "--backend", "null", "--settle", "0", "--set", "grey"]
    options = ["--instrument-option", "noise=0.001", "-o", str(files / "panel.jsonl")]
    small = DISPLAY.replace("[1920, 1080]", "[64, 48]")
    (files / "small.yaml").write_text(small, encoding="utf-8")
    measured = CliRunner().invoke(group, ["display", "measure", str(files / "small.yaml"), *words, *options])
    assert measured.exit_code == 0, measured.output
    answers = [
        json.loads(_run(files / name, "--json", "-o", files / "page.html").output)["diagnoses"]
        for name in ("panel.jsonl", "panel.csv")
    ]
    kept, exported = ({one["name"]: one["value"] for one in answer} for answer in answers)
    assert kept["repeatability"] is not None
    for name in ("repeatability", "drift", "tone_response", "headroom"):
        assert kept[name] == pytest.approx(exported[name], rel=1e-6, abs=1e-9)
