"""A picture of sRGB on the nominal display of its white: the framebuffer holds its own codes, in every mode."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from devices.display import EYES, Eye, EyeModels, Nominal, NominalKind
from runner import Picture, Scene
from runner.presenter import MODES, ModeOptions, Presenter, Surface, find_mode, open_surface
from stimuli.build import StimulusSet, build_set
from stimuli.pictures import StereoImage

# All grey levels, then colours drawn at random, in rows.
COLUMNS, RANDOM = 128, 10_000
SIZE_PX = COLUMNS, -(-(256 + RANDOM) // COLUMNS)
Codes = NDArray[np.uint8]


def _codes(seed: int) -> Codes:
    greys = np.repeat(np.arange(256)[:, np.newaxis], 3, axis=1)
    colours = np.random.default_rng(seed).integers(0, 256, (RANDOM, 3))
    every = np.concatenate([greys, colours])
    filled = np.resize(every, (-(-len(every) // COLUMNS) * COLUMNS, 3))
    return filled.reshape(-1, COLUMNS, 3).astype(np.uint8)


@pytest.fixture(scope="module")
def two_windows() -> Iterator[Surface]:
    with open_surface("egl", (4 * COLUMNS, 420), windows=2) as surface:
        yield surface


def _shown(
    surface: Surface,
    mode: str,
    models: EyeModels,
    image: StereoImage,
    size_px: tuple[int, int],
    options: ModeOptions | None = None,
) -> Iterator[tuple[Eye, Codes, NDArray[np.bool_]]]:
    """Yield, by eye, the codes (rows, columns, 3) of the picture's ``size_px`` and which of them are the eye's."""
    with Presenter(surface, find_mode(mode, options), models, lambda _: image) as presenter:
        presenter.show(Scene((Picture("sRGB"),)))
        for eye in EYES:
            area = next(area for area in presenter.areas if eye in area.eyes)
            view = presenter.eye_view(eye)
            mine = np.ones(view.shape[:2], bool) if area.weave is None else area.weave.mask(*view.shape[:2])
            left, top = ((v - p) // 2 for v, p in zip((view.shape[1], view.shape[0]), size_px, strict=True))
            inside = slice(top, top + size_px[1]), slice(left, left + size_px[0])
            yield eye, view[inside].astype(np.uint8), mine[inside]


WHOLE = [
    name for name, mode in MODES.items() if not mode.needs_stereo and "half" not in name and "anaglyph" not in name
]


def _built(folder: Path, colour_space: str) -> StimulusSet:
    """Two PNG files as a recipe makes stimuli of them: as a pair, and the left one flat."""
    for name, seed in (("it_L", 1), ("it_R", 2)):
        Image.fromarray(_codes(seed)).save(folder / f"{name}.png")
    (folder / "recipe.yaml").write_text(
        f"schema_version: 1\nkind: pictures\ncolour_space: {colour_space}\nwhite_luminance_cd_m2: 100\nstimuli:\n"
        "  - {name: pair, left: it_L.png, right: it_R.png}\n  - {name: one, file: it_L.png}\n"
    )
    return build_set(folder / "recipe.yaml", 0.3)


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, StimulusSet]]:
    """The same PNG files as pictures of sRGB and of Display P3."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CYCLOPEAN_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield {space: _built(tmp_path_factory.mktemp(space), space) for space in ("srgb", "display-p3")}


@pytest.mark.parametrize(
    ("mode", "kind"),
    [*((mode, "srgb") for mode in WHOLE), ("side-by-side", "display-p3"), ("checkerboard", "display-p3")],
)
def test_every_grey_and_ten_thousand_colours_of_a_PNG_come_back_exactly(
    mode: str, kind: NominalKind, two_windows: Surface, built: dict[str, StimulusSet]
) -> None:
    model = Nominal.of(kind, 100.0).model()
    codes = {"left": _codes(1), "right": _codes(1) if mode == "flat" else _codes(2)}
    image = built[kind].load("one" if mode == "flat" else "pair")
    pictures = {"left": image.left, "right": image.right}
    seen = 0
    for eye, shown, mine in _shown(two_windows, mode, EyeModels(model, model), image, SIZE_PX):
        assert np.array_equal(shown[mine], codes[eye][mine])
        assert not model.clipping(pictures[eye]).any_channel
        seen += int(mine.sum())
    assert seen >= codes["left"][..., 0].size


@pytest.mark.parametrize("kind", get_args(NominalKind))
def test_the_codes_of_each_kind_come_back_from_the_light_of_each_kind(kind: NominalKind, two_windows: Surface) -> None:
    model = Nominal.of(kind, 250.0).model()
    codes = _codes(5)
    image = StereoImage.flat(model.xyz(codes / 255.0).astype(np.float32))
    for _, shown, _ in _shown(two_windows, "flat", EyeModels(model, model), image, SIZE_PX):
        assert np.array_equal(shown, codes)
