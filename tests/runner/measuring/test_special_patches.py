"""Patches that are more than a full screen: where they stand, what the person is asked, and that all of it is kept."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from devices.diagnostics import plain
from devices.display import read_display
from devices.readings import (
    GridCell,
    MeasurementLog,
    Patch,
    PatchSet,
    Simulated,
    find_sets,
    read_csv,
    read_session,
    step_facts,
    steps,
)
from runner.cli.main import group
from runner.measuring.code_screen import CodeScreen
from runner.measuring.keys import Keys
from runner.measuring.take_readings import take_readings
from runner.ports import KeyPress
from runner.presenter import MODES, Codes, PresentationError, Surface, find_mode, open_surface
from tests.choice import nightly
from tests.runner.families import by_family
from tests.runner.measuring.displays import DISPLAY as SMALL
from tests.runner.measuring.displays import HEADER

SIZE = (96, 72)
OFFSCREEN = [name for name in MODES if name != "quad-buffered"]
APART = [name for name in OFFSCREEN if name != "flat" and "anaglyph" not in name]
WHITE = (1.0, 1.0, 1.0)
BLACK = (0.0, 0.0, 0.0)
DISPLAY = SMALL + "  side-by-side: {same_as: row-interleaved}\n  flat: {same_as: row-interleaved}\n"
SIMULATED = ["--instrument", "simulated", "--backend", "egl", "--settle", "0"]


def _open(mode: str) -> Surface:
    try:
        return open_surface("egl", SIZE, windows=find_mode(mode).windows)
    except PresentationError as error:
        pytest.skip(str(error))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    _open("flat").close()
    (tmp_path / "display.yaml").write_text(DISPLAY)
    return tmp_path


def _measure(folder: Path, *more: str, typed: str | None = None, mode: str = "row-interleaved") -> Result:
    arguments = ["display", "measure", str(folder / "display.yaml"), "--mode", mode,
                 "-o", str(folder / "m.jsonl"), *SIMULATED, *more]  # fmt: skip
    return CliRunner().invoke(group, arguments, input=typed)


@pytest.mark.parametrize("mode", by_family(APART))
@pytest.mark.parametrize("eye", ["left", *nightly("right")])
def test_the_other_eye_sees_its_own_codes(mode: str, eye: str) -> None:
    patch = Patch("black@other=red", (0.2, 0.2, 0.2), other=(1.0, 0.0, 0.0), eye="left" if eye == "left" else "right")
    with _open(mode) as surface, CodeScreen(surface, find_mode(mode)) as screen:
        shown = screen.show_patch(patch, "both")
        seen = {name: screen.seen_by(name) for name in ("left", "right")}
    assert np.all(seen[eye] == 51)
    assert np.all(seen["right" if eye == "left" else "left"] == (255, 0, 0))
    assert (shown.own, shown.other) == (patch.codes, patch.other)


@pytest.mark.parametrize("mode", by_family(OFFSCREEN))
@pytest.mark.parametrize("place", [*nightly(GridCell(2, 2)), GridCell(1, 3)])
def test_a_place_is_a_cell_of_the_panel(mode: str, place: GridCell) -> None:
    """What is lit, once squeezed views are stretched back, is the cell and nothing else."""
    with _open(mode) as surface, CodeScreen(surface, find_mode(mode)) as screen:
        shown = screen.show_patch(Patch("white@r1c1", WHITE, place=place), "both")
        pictures = screen.capture()
        lit = next(iter(pictures.values()))[..., 0] > 0
        squeeze = find_mode(mode).areas(SIZE)[0].squeeze
    width, height = SIZE
    if squeeze != (1, 1):  # each half holds the whole panel
        lit = lit[: height // squeeze[1], : width // squeeze[0]].repeat(squeeze[0], axis=1).repeat(squeeze[1], axis=0)
    expected = np.zeros((height, width), dtype=bool)
    rows, columns = (place.row - 1) * 24, (place.column - 1) * 32
    expected[rows : rows + 24, columns : columns + 32] = True
    np.testing.assert_array_equal(lit, expected)
    assert shown.place == place.centre


@pytest.mark.parametrize("mode", [*nightly("flat"), "row-interleaved", *nightly("side-by-side-half")])
def test_a_surround_is_around_the_middle(mode: str) -> None:
    with _open(mode) as surface, CodeScreen(surface, find_mode(mode)) as screen:
        screen.show_patch(Patch("grey@on-white", (0.2, 0.2, 0.2), around=WHITE), "both")
        seen = screen.seen_by("left")[:, 0]
    assert set(seen) == {51.0, 255.0}
    assert (seen == 51).mean() == pytest.approx(1 / 9, abs=0.02)


@pytest.mark.parametrize("mode", ["flat", *nightly("checkerboard")])
@pytest.mark.parametrize("area", [*nightly(0.04), 0.25, *nightly(0.64)])
def test_a_patch_fills_its_area_and_black_is_around_it(mode: str, area: float) -> None:
    with _open(mode) as surface, CodeScreen(surface, find_mode(mode)) as screen:
        screen.show_patch(Patch("white", WHITE, area=area), "both")
        seen = screen.seen_by("left")[:, 0]
    assert set(seen) == {0.0, 255.0}
    assert (seen == 255).mean() == pytest.approx(area, abs=0.03)


def test_what_a_patch_names_before_it_stands_first(tmp_path: Path) -> None:
    order = steps(PatchSet("s", (Patch("black", BLACK, before=WHITE, area=0.25),), characterisation=False), 1)
    looks: list[float] = []
    with _open("flat") as surface, CodeScreen(surface, find_mode("flat")) as screen:
        whole, swap = screen.surface.size_px[0] * screen.surface.size_px[1], surface.swap

        def shown() -> None:
            looks.append(float((screen.seen_by("left")[:, 0] == 255).sum() / whole))
            swap()

        surface.swap = shown  # type: ignore[method-assign]  # looks at what is shown
        instrument = Simulated(read_display(Path("configs/displays/asus_vg248qe.yaml")).models("quad-buffered").left)
        with MeasurementLog.create(tmp_path / "m.jsonl", {"steps": step_facts(order)}) as log:
            outcome = take_readings(screen, instrument, log, order, "both", 0.0, lambda: 1.0)
    assert outcome.taken == 1
    assert looks == [1.0, 0.0]


@pytest.mark.parametrize("mode", ["side-by-side-half", *nightly("flat", "checkerboard", "frame-sequential")])
@pytest.mark.parametrize("bits", [8, *nightly(10)])
def test_words_stand_on_the_screen_until_a_key_and_then_no_longer(mode: str, bits: int) -> None:
    try:
        surface = open_surface("egl", (320, 240), bits=8 if bits == 8 else 10)
    except PresentationError as error:
        pytest.skip(str(error))
    with surface, CodeScreen(surface, find_mode(mode)) as screen:
        said: list[str] = []
        looks: list[dict[str, Codes]] = []

        def presses() -> tuple[KeyPress, ...]:
            looks.append(dict(screen.capture()))
            if len(looks) == 2:
                return (KeyPress("space", 0.0),)  # from before the words
            later_s = time.monotonic() + 1.0
            return (KeyPress("space", later_s), KeyPress("space", later_s + 0.05)) if len(looks) == 3 else ()

        screen.show_patch(Patch("black", BLACK), "both")
        surface.poll_keys = presses  # type: ignore[method-assign]  # stands in for the real one
        keys = Keys(screen, said.append)
        assert keys.ask("Point the instrument at the patch.")
        assert not keys.paused
        after = screen.capture()
    assert said == ["Point the instrument at the patch. Space continues."]
    for name, picture in looks[0].items():
        lit = (picture[..., 0] > 0).mean()
        assert 0.001 < lit < 0.1
        assert not picture[: picture.shape[0] // 2].any()
        assert not after[name].any()


def test_what_is_special_of_a_patch_comes_back_from_the_log(tmp_path: Path) -> None:
    order = steps(find_sets(("all",)), 1)
    with MeasurementLog.create(tmp_path / "m.jsonl", {**HEADER, "steps": step_facts(order)}):
        pass
    assert read_session(tmp_path / "m.jsonl").steps == order


def test_a_person_at_the_terminal_says_when_the_instrument_stands(folder: Path) -> None:
    """Without a window, the end of a line continues; where nobody answers, it stops, and resumes later."""
    result = _measure(folder, "--set", "uniformity", typed="\n" * 4)
    assert result.exit_code == 1
    assert result.stderr.count("Then press Enter") == 5
    assert "nobody says that the instrument stands; 4 readings are safe" in str(result.exception)
    result = _measure(folder, "--set", "uniformity", "--resume", typed="\n" * 5)
    assert result.exit_code == 0, result.output
    assert sorted(read_csv(folder / "m.csv").name) == [f"white@r{row}c{column}" for row in "123" for column in "123"]


def test_sets_that_a_mode_cannot_show_are_told(folder: Path) -> None:
    named = _measure(folder, "--set", "crosstalk", mode="flat")
    assert "'crosstalk' cannot be measured: 'flat' shows both eyes the same pixels" in str(named.exception)
    named = _measure(folder, "--set", "glasses", mode="flat")
    assert "'glasses' cannot be measured: 'flat' needs no glasses" in str(named.exception)
    parts = _measure(folder, "--set", "uniformity", "--eye", "left", mode="side-by-side")
    assert "--eye both" in str(parts.exception)
    assert not (folder / "m.jsonl").exists()
    arguments = ["display", "patches", str(folder / "display.yaml"), "--mode", "flat", "--set", "all", "--list"]
    everything = CliRunner().invoke(group, arguments)
    assert everything.exit_code == 0, everything.output
    assert "note: 'crosstalk' cannot be measured" in everything.stderr
    assert "white@r3c3" in everything.stdout
    assert "@other=" not in everything.stdout


def test_the_warm_up_waits_between_its_readings(folder: Path) -> None:
    result = _measure(folder, "--set", "warm-up", "--every", "0.05")
    assert result.exit_code == 0, result.output
    table = read_csv(folder / "m.csv")
    assert table.time_s is not None
    assert len(table) == 31
    assert np.all(np.diff(table.time_s) >= 0.049)


def test_patches_of_one_area_on_one_grey_are_measured_and_fitted(folder: Path) -> None:
    """A display that limits bright pictures: full-screen patches mislead, those on the session's mean level do not."""
    limit = ("--instrument-option", "picture_level_limit=0.5", "--instrument-option", "noise=0.0005")
    result = _measure(folder, "--set", "grey", "--area", "0.1", "--surround", "0.5", *limit)
    assert result.exit_code == 0, result.output
    table = read_csv(folder / "m.csv")
    assert set(table.filled) == {0.1}
    np.testing.assert_allclose(table.around, 128 / 255)
    assert len(plain(table)) == len(table)
    white = table.XYZ[np.all(table.codes == 1, axis=1), 1].mean()
    (folder / "m.jsonl").unlink()
    assert _measure(folder, "--set", "grey", *limit).exit_code == 0
    dim = read_csv(folder / "m.csv")
    assert dim.area is None
    assert dim.XYZ[np.all(dim.codes == 1, axis=1), 1].mean() == pytest.approx(0.5 * white, rel=0.01)
