"""Previews: equal screens are drawn once, no more is written than was asked, and contact sheets show each screen."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from runner.errors import SessionError
from runner.presenter import Presenter
from runner.presenter.surfaces.egl import EglSurface
from runner.reports import preview
from runner.reports.screens import ALONE_PX, COLUMNS, PAIR_PX, ROWS, Tile, write_sheets
from tests.choice import nightly

Study = Any  # tests/conftest.py


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What was read from the framebuffer."""
    reads: list[str] = []
    read = EglSurface.read

    def counting(self: EglSurface, eye: Any = None) -> Any:
        reads.append(str(eye))
        return read(self, eye)

    monkeypatch.setattr(EglSurface, "read", counting)
    return reads


def test_equal_screens_are_drawn_once_and_written_as_if_each_were_drawn(study: Study, drawn: list[str]) -> None:
    study.edit("small.yaml", "break_every: 4", "fixation_s: 0.5")
    files = preview(study.experiment, study.folder / "out")
    # The page, then for each of 6 pairs a cross and the pair, and the end: the cross is the same each time.
    assert len(files) == 2 * (1 + 2 * 6 + 1)
    assert len(drawn) == 1 + 1 + 6 + 1
    crosses = {file.read_bytes() for file in files if "block-02" in file.name and int(file.name[16:19]) % 2}
    assert len(crosses) == 1
    drawn.clear()
    study.edit("rig.yaml", "mode:", "mode_options: {photodiode_corner: bottom-right}\nmode:")
    for file in preview(study.experiment, study.folder / "square"):
        same = np.array_equal(np.asarray(Image.open(file)), np.asarray(Image.open(study.folder / "out" / file.name)))
        assert same is (file.name.endswith("left.png") or not _lit(file))
    assert len(drawn) == 14  # its square changes with every screen


def _lit(file: Path) -> bool:
    return bool(np.asarray(Image.open(file))[-1, -1].any())


@pytest.mark.parametrize("first", [*nightly(1), 3, *nightly(99)])
def test_the_first_trials_alone_are_drawn_and_written(study: Study, drawn: list[str], first: int) -> None:
    files = preview(study.experiment, study.folder / "out", first=first)
    # The page, the pairs, the break after four, the end after all.
    assert len(drawn) == 1 + min(first, 6) + (first > 4) + (first > 6)
    assert sorted(files) == sorted((study.folder / "out").iterdir())
    assert len(files) == 2 * len(drawn)


def test_no_trials_are_refused(study: Study) -> None:
    with pytest.raises(SessionError, match="give 1 or more"):
        preview(study.experiment, study.folder / "out", first=0)


@pytest.mark.parametrize(
    "mode", ["row-interleaved", "flat", *nightly("side-by-side", "checkerboard", "side-by-side-half")]
)
def test_a_sheet_holds_each_screen_once_in_the_light_that_the_eye_gets(
    study: Study, mode: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    study.edit("display.yaml", "  quad-buffered:", f"  {mode}x: {{same_as: side-by-side}}\n  quad-buffered:")
    study.edit("display.yaml", f"  {mode}x:", f"  {mode}:" if mode != "side-by-side" else "  top-bottom:")
    study.edit("small.yaml", "break_every: 4", "fixation_s: 0.5" + (", stimuli: [three, four]" * (mode == "flat")))
    tiles: list[Tile] = []
    means: list[float] = []
    views = Presenter.eye_views

    def kept(self: Presenter) -> Any:
        seen = views(self)
        area = self.areas[0]
        own = area.weave.mask(*seen["left"].shape[:2]) if area.weave else np.s_[:]
        means.append(float(seen["left"][own].mean()))
        return seen

    monkeypatch.setattr(Presenter, "eye_views", kept)

    def keep_tiles(gathered: list[Tile], folder: Path) -> list[Path]:
        tiles.extend(gathered)
        return []

    monkeypatch.setattr("runner.reports.screens.write_sheets", keep_tiles)
    preview(study.experiment, study.folder / "out", mode=mode, sheet=True, first=2)
    assert [tile.title for tile in tiles[:2]] == ["instructions", "all pairs"]
    assert tiles[1].places[0] == "block 2, trial 1"
    assert len(tiles) == 4  # the page, the cross, and the pairs, or the pair and the end
    if mode != "flat":
        assert tiles[1].places == ["block 2, trial 1", "block 2, trial 2"]
    for tile, mean in zip(tiles, means, strict=True):
        view = np.asarray(tile.views[0], dtype=float)
        assert view.mean() == pytest.approx(mean, abs=0.4 + 0.02 * mean)
        box_px = PAIR_PX if len(tile.views) == 2 else ALONE_PX
        assert max(a / b for a, b in zip(view.shape[1::-1], box_px, strict=True)) == pytest.approx(1.0, abs=0.01)
        wide = {"side-by-side": 320 / 480}.get(mode, 640 / 480)
        assert view.shape[1] / view.shape[0] == pytest.approx(wide, rel=0.02)


def test_sheets_hold_as_many_as_fit_and_no_more_is_written(study: Study) -> None:
    files = preview(study.experiment, study.folder / "out", sheet=True)
    assert [file.name for file in files] == ["sheet-1.png"] == [file.name for file in (study.folder / "out").iterdir()]
    view = Image.new("RGB", (90, 60), (200, 10, 10))
    tiles = [Tile((view,), "all pairs", [f"block 1, trial {number}"]) for number in range(COLUMNS * ROWS + 1)]
    first, second = write_sheets(tiles, study.folder)
    wide, narrow = Image.open(first), Image.open(second)
    assert wide.width > 3 * narrow.width
    assert (np.asarray(wide)[..., 0] == 200).sum() == COLUMNS * ROWS * 90 * 60
    assert (np.asarray(narrow)[..., 0] == 200).sum() == 90 * 60


def test_places_of_a_screen_that_comes_often_are_counted() -> None:
    tile = Tile((Image.new("RGB", (9, 9)),), "all pairs", [f"block 2, trial {number}" for number in range(1, 7)])
    assert tile.words() == (
        "all pairs, both eyes",
        "block 2, trial 1, block 2, trial 2, block 2, trial 3 and 3 more",
    )


def test_the_command_writes_sheets_and_the_first_trials(study: Study) -> None:
    told = study.cyclopean("preview", study.experiment, "-o", study.folder / "out", "--sheet", "--first", "1")
    assert "1 picture is in" in told.stdout
    assert "Usage" in study.cyclopean("preview", study.experiment, "-o", "x", "--first", "0", expect=2).stderr
