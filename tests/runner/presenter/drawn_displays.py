"""What a colour pass draws on a display drawn at random, against the float64 model: in codes of 8 or 10 bits."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from unittest.mock import patch

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.compensation import Correction, Mixture, cancel_crosstalk
from devices.display import EYES, Eye, EyeModels
from documents.arrays import Floats
from runner import Picture, Scene
from runner.presenter import Codes, ColourPass, PresentationError, Presenter, Surface, open_surface
from runner.presenter.arithmetic_choice import VARIABLE
from runner.presenter.code_pass import release_codes
from runner.presenter.colour_pass import MixedPass
from runner.presenter.compensated_pass import CompensatedPass
from runner.presenter.depth import Bits, CodeFormat, highest_code
from runner.presenter.modes.mode import Mode, Weave
from stimuli.pictures import StereoImage
from tests.displays import picture_of

SIZE_PX = (48, 36)
WORDS: tuple[str, ...] = ("doubles", "two-floats")
# Codes: half for rounding, and a thousandth for what is computed.
WITHIN_CODES = 0.501


def worst_of_an_eye(
    surface: Surface,
    models: EyeModels,
    correction: Correction | None,
    eye: Eye,
    bits: Bits,
    seed: int,
    words: Sequence[str] = WORDS,
) -> dict[str, float]:
    """Return the largest error of ``eye``'s codes, by arithmetic, of ``words``; views are drawn by ``seed``."""
    views: dict[Eye, NDArray[np.float32]] = {
        "left": picture_of(models.left, SIZE_PX, seed),
        "right": picture_of(models.right, SIZE_PX, seed + 1),
    }
    model = models.eye(eye)
    light = views[eye].astype(np.float64)
    if correction is not None and correction.crosstalk is not None:
        done = cancel_crosstalk(models, correction.crosstalk, views["left"], views["right"], correction.lift_share)
        sent = done.left_linear if eye == "left" else done.right_linear
        light = model.dark_XYZ_cd_m2 + sent @ model.primaries_XYZ_cd_m2.T
    if correction is not None and correction.gain_map is not None:
        x, y = np.meshgrid(np.arange(SIZE_PX[0]) + 0.5, np.arange(SIZE_PX[1]) + 0.5)
        light = correction.gain_map.corrected(light, correction.gain_map.gain(x, y), model.ambient_XYZ_cd_m2)
    wanted = model.code(light) * highest_code(bits)
    found = {}
    for word in words:
        with patch.dict(os.environ, {VARIABLE: word}):
            if correction is None:
                own: ColourPass | CompensatedPass = ColourPass(surface.context, model, bits=bits)
                pictures = [views[eye]]
            else:
                own = CompensatedPass(surface.context, models, correction, eye, bits=bits)
                pictures = [views[eye], views["right" if eye == "left" else "left"]]
            found[word] = _worst(surface, own, pictures, wanted, bits)
    return found


def worst_of_a_mixture(
    surface: Surface, models: EyeModels, mixture: Mixture, bits: Bits, seed: int
) -> dict[str, float]:
    """Return the largest error of the codes of both views in one picture, by arithmetic."""
    pictures = [picture_of(models.left, SIZE_PX, seed), picture_of(models.right, SIZE_PX, seed + 1)]
    wanted = mixture.code(*pictures) * highest_code(bits)
    found = {}
    for word in WORDS:
        with patch.dict(os.environ, {VARIABLE: word}):
            found[word] = _worst(surface, MixedPass(surface.context, mixture, bits=bits), pictures, wanted, bits)
    return found


def _worst(
    surface: Surface,
    drawing: ColourPass | CompensatedPass | MixedPass,
    pictures: Sequence[NDArray[np.float32]],
    wanted: Floats,
    bits: Bits,
) -> float:
    uploaded = [surface.context.texture(SIZE_PX, 3, picture.tobytes(), alignment=1, dtype="f4") for picture in pictures]
    # As the framebuffer has them. Codes of 10 bits are read unrounded: not every driver has RGB10_A2.
    kind: CodeFormat = "f1" if bits == 8 else "f4"
    first, last = uploaded[0], uploaded[-1]
    codes = drawing.run(first, kind) if isinstance(drawing, ColourPass) else drawing.run(first, last, dtype=kind)
    read = codes.read(components=3, dtype=kind, alignment=1)
    exact = np.frombuffer(read, np.uint8 if bits == 8 else np.float32).astype(np.float64)
    shown = exact if bits == 8 else np.floor(exact * highest_code(bits) + 0.5)
    shown = shown.reshape(SIZE_PX[1], SIZE_PX[0], 3)[::-1]
    release_codes(codes)
    drawing.release()
    for texture in uploaded:
        texture.release()
    return float(np.abs(shown - wanted).max())


def worst_in_a_mode(surface: Surface, mode: Mode, models: EyeModels, seed: int) -> dict[str, float]:
    """Return the largest error of what ``mode`` shows of a picture as large as its areas, by arithmetic."""
    areas = {eye: next(area for area in mode.areas(surface.size_px) if eye in area.eyes) for eye in EYES}
    sizes = {
        eye: (area.rectangle.width * area.squeeze[0], area.rectangle.height * area.squeeze[1])
        for eye, area in areas.items()
    }
    assert sizes["left"] == sizes["right"]
    views = {eye: picture_of(models.eye(eye), sizes[eye], seed + number) for number, eye in enumerate(EYES)}
    flat = any(len(area.eyes) > 1 for area in areas.values()) and mode.mixture(models) is None
    picture = StereoImage.flat(views["left"]) if flat else StereoImage(views["left"], views["right"])
    mixture = mode.mixture(models)
    found = {}
    for word in WORDS:
        with (
            patch.dict(os.environ, {VARIABLE: word}),
            Presenter(surface, mode, models, lambda _: picture) as presenter,
        ):
            presenter.show(Scene((Picture("drawn"),)))
            found[word] = max(
                _off(
                    presenter.eye_view(eye),
                    models.eye(eye).code(_averaged(picture.eye(eye), area.squeeze))
                    if mixture is None
                    else mixture.code(picture.left, picture.right),
                    area.weave,
                )
                for eye, area in areas.items()
            )
    return found


def _averaged(XYZ: NDArray[np.float32], squeeze: tuple[int, int]) -> Floats:
    across, down = squeeze
    height, width, _ = XYZ.shape
    boxes = XYZ.astype(np.float64).reshape(height // down, down, width // across, across, 3)
    return np.asarray(boxes.mean(axis=(1, 3)))


def _off(shown: Codes, code: Floats, weave: Weave | None) -> float:
    highest = np.iinfo(np.uint8).max if shown.dtype == np.uint8 else highest_code(10)
    off = np.abs(shown - code * highest).max(axis=-1)
    return float((off if weave is None else off[weave.mask(*off.shape)]).max())


def one_surface() -> Iterator[Surface]:
    """Yield one offscreen surface for all displays."""
    try:
        opened = open_surface("egl", (96, 72), windows=2)
    except PresentationError as error:
        pytest.skip(str(error))
    with opened:
        yield opened
