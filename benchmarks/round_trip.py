"""The whole path in colours, in every stereo mode: asked XYZ, shader, framebuffer read back, forward model, ΔE00.

The thesis's display, colours all over its gamut (codes 0.02 to 0.93 of full drive), another for each pixel, for each
eye its own where the mode has two; the worse eye is told. With dithering the colours are patches of one mask period
each, and it is the mean light of a patch that is compared. The error is the mean ΔE00; the time is that of showing a
new picture: upload, colour passes, frame, on the EGL driver that this machine gives.

An anaglyph cannot show both eyes what they were asked. There, what each eye sees through its filter is compared with
what it would see of the mixed light that the channels can give; what the mixing and the clip cost is told per picture
by `cyclopean check`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np
from curves import Row, program, row, sized
from numpy.typing import NDArray
from promises import Promise, worst

from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from devices.display.display_file import EyeModels, read_display
from devices.display.nominal import Nominal
from documents.arrays import Floats
from runner.presenter.depth import Bits, highest_code
from runner.presenter.dithering import Dithering
from runner.presenter.modes.mode import EyeArea, Mode
from runner.presenter.modes.registry import MODES
from runner.presenter.presenter import Presenter
from runner.presenter.surfaces.opening import open_surface
from runner.scene import Picture, Scene
from stimuli.pictures.stereo_image import StereoImage

ASUS = Path(__file__).parents[1] / "configs/displays/asus_vg248qe.yaml"
MASK_PX = 64
SIZE_PX = sized((960, 540), (256, 128))
REPEATS = sized(5, 1)


@dataclass(frozen=True, slots=True)
class Way:
    """Codes of ``bits``, dithered or not, and the most ΔE00 that they may cost; None where nothing is promised."""

    name: str
    bits: Bits
    dithered: bool
    most_mean: float | None = None
    most_p95: float | None = None
    most_max: float | None = None


WAYS = (
    Way("8 bits, rounded", 8, dithered=False, most_mean=0.15, most_p95=0.35),
    Way("8 bits, dithered, means over the mask", 8, dithered=True, most_max=0.05),
    Way("10 bits, rounded", 10, dithered=False),
)


def colours(models: EyeModels, area: EyeArea, seed: int, *, patches: bool) -> NDArray[np.float32]:
    """Return XYZ that fills a view: another colour for each pixel, or for each mask period of the signal."""
    width, height = area.view_px
    codes = np.random.default_rng(seed).uniform(0.02, 0.93, (height, width, 3))
    if patches:
        across, down = (MASK_PX * pixels for pixels in area.squeeze)
        codes = codes[: -(-height // down), : -(-width // across)].repeat(down, 0).repeat(across, 1)[:height, :width]
    return models.left.xyz(codes).astype(np.float32)


def of_signal(xyz: NDArray[np.float32], area: EyeArea) -> Floats:
    """Return the mean XYZ of the view's pixels that share each of the signal's."""
    across, down = area.squeeze
    height, width, _ = xyz.shape
    return xyz.astype(np.float64).reshape(height // down, down, width // across, across, 3).mean(axis=(1, 3))


def period_means(xyz: Floats, mine: NDArray[np.bool_]) -> Floats:
    """Return the mean XYZ (periods, 3) of an eye's pixels in each whole mask period."""
    rows, columns = (length // MASK_PX for length in mine.shape)
    kept = mine[: rows * MASK_PX, : columns * MASK_PX, np.newaxis]
    tiled = (rows, MASK_PX, columns, MASK_PX, -1)
    light = (xyz[: rows * MASK_PX, : columns * MASK_PX] * kept).reshape(tiled).sum(axis=(1, 3))
    return np.asarray((light / kept.reshape(tiled).sum(axis=(1, 3))).reshape(-1, 3))


def differences(presenter: Presenter, image: StereoImage, models: EyeModels, way: Way) -> Iterator[Floats]:
    """Yield, for each eye, the ΔE00 between what is asked and what the framebuffer holds of the scene shown."""
    mixture = presenter.mode.mixture(models)
    model = models.left
    for eye in ("left", "right"):
        area = next(area for area in presenter.areas if eye in area.eyes)
        codes = presenter.eye_view(eye) / highest_code(way.bits)
        shown = model.xyz(codes)
        asked = of_signal(image.eye(eye), area)
        white = model.white_XYZ_cd_m2
        if mixture is not None:
            # As codes that are not rounded: Table 3.6's red has 0.98 of its light at full drive.
            light = model.linear(model.xyz(mixture.code(image.left, image.right)))
            through = mixture.through(eye).T
            asked = (model.black_XYZ_cd_m2 + light @ model.primaries_XYZ_cd_m2.T) @ through
            shown, white = shown @ through, white @ through
        mine = np.ones(shown.shape[:2], dtype=bool)
        if area.weave is not None:
            mine = area.weave.mask(*mine.shape)
        if way.dithered:
            asked, shown = period_means(asked, mine), period_means(shown, mine)
        else:
            asked, shown = asked[mine], shown[mine]
        yield delta_e_2000(xyz_to_lab(asked, white), xyz_to_lab(shown, white))


def measure(mode: Mode, models: EyeModels, way: Way) -> dict[str, Any]:
    """Show new pictures in ``mode`` and compare the last with what was asked."""
    dithering = Dithering() if way.dithered else None
    with open_surface("egl", SIZE_PX, windows=mode.windows, bits=way.bits) as surface:
        why = mode.unavailable(SIZE_PX, stereo=surface.stereo, windows=surface.windows)
        if why is None and surface.bits != way.bits:
            why = f"the driver gives {surface.bits} bits"
        if why is not None:
            return row(way.name, mode.name, None, note=f"left out: {why}")
        areas = mode.areas(SIZE_PX)
        left = colours(models, areas[0], 7, patches=way.dithered)
        alike = mode.mixture(models) is None and len(areas) == 1
        image = (
            StereoImage.flat(left) if alike else StereoImage(left, colours(models, areas[-1], 8, patches=way.dithered))
        )
        with Presenter(surface, mode, models, lambda _: image, dithering=dithering) as presenter:
            times = []
            for number in count():
                start = perf_counter()
                presenter.show(Scene((Picture(str(number)),)))
                times.append(perf_counter() - start)
                if number == REPEATS:  # the first, which may compile, is not counted
                    break
            eyes = list(differences(presenter, image, models, way))
    found = {
        "mean": max(float(eye.mean()) for eye in eyes),
        "p95": max(float(np.percentile(eye, 95)) for eye in eyes),
        "max": max(float(eye.max()) for eye in eyes),
    }
    targets = {"mean": way.most_mean, "p95": way.most_p95, "max": way.most_max}
    promised = {name: most for name, most in targets.items() if most is not None}
    note = f"95 % within {found['p95']:.2g}, largest {found['max']:.2g}"
    return row(way.name, mode.name, median(times[1:]), found["mean"], note=note, delta_e_00=found, promised=promised)


def own_codes(mode: Mode) -> Row:
    """Show an sRGB picture on the nominal sRGB display of its white; the error is the share of codes that change."""
    model = Nominal.of("srgb", 100.0).model()
    row = {"series": "nominal sRGB, 8 bits, codes of an sRGB picture", "parameter": mode.name}
    with open_surface("egl", SIZE_PX, windows=mode.windows) as surface:
        why = mode.unavailable(SIZE_PX, stereo=surface.stereo, windows=surface.windows)
        if why is not None:
            return {**row, "seconds": None, "error": None, "note": f"left out: {why}"}
        area = mode.areas(SIZE_PX)[0]
        (width, height), (across, down) = area.view_px, area.squeeze
        codes = np.random.default_rng(9).integers(0, 256, (height // down, width // across, 3))
        image = StereoImage.flat(model.xyz(codes.repeat(down, 0).repeat(across, 1) / 255.0).astype(np.float32))
        with Presenter(surface, mode, EyeModels(model, model), lambda _: image) as presenter:
            times = []
            for number in range(REPEATS + 1):
                start = perf_counter()
                presenter.show(Scene((Picture(str(number)),)))
                times.append(perf_counter() - start)
            shown = presenter.eye_view("left")
    mine = np.ones(shown.shape[:2], dtype=bool) if area.weave is None else area.weave.mask(*shown.shape[:2])
    changed = (shown != codes)[mine].any(axis=1)
    note = f"{int(changed.sum())} of {changed.size} pixels changed"
    return {**row, "seconds": median(times[1:]), "error": float(changed.mean()), "note": note}


def _promises(rows: list[dict[str, Any]]) -> list[Promise]:
    """Return for each way what is promised of the worst mode that this machine can show."""
    promises = []
    words = {"mean": "mean ΔE00", "p95": "95th percentile of ΔE00", "max": "largest ΔE00"}
    for way in WAYS:
        shown = [row for row in rows if row["series"] == way.name and row["seconds"] is not None]
        for first in shown[:1]:
            for key, most in first["promised"].items():
                figure = max(float(one["delta_e_00"][key]) for one in shown)
                promises.append(Promise(f"{way.name}: {words[key]}, worst mode", figure, most, "error"))
    return promises


def _worst_error(rows: list[Row]) -> float:
    return worst(row for row in rows if row["seconds"] is not None)


def run() -> dict[str, Any]:
    """Measure every mode in every way."""
    models = read_display(ASUS).models("side-by-side")
    rows = [measure(mode, models, way) for way in WAYS for mode in MODES.values()]
    # An anaglyph mixes both views into other codes by design.
    own = [own_codes(mode) for name, mode in MODES.items() if not name.startswith("anaglyph")]
    promises = [Promise("share of an sRGB picture's codes that change", _worst_error(own), 0.0, "error", "exactly")]
    return {
        "title": f"From asked XYZ to a framebuffer of {SIZE_PX[0]} × {SIZE_PX[1]} and back, in ΔE00",
        "rows": rows + own,
        "promises": _promises(rows) + promises,
    }


if __name__ == "__main__":
    program("round_trip", run)
