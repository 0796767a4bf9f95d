"""What a display shows, beside what was asked: clipping's cost, the error budget, the whole path, verification.

What clipping costs a picture: in blocks, those within the gamut skipped; at once; or found as kept.

A picture of 1344 × 1000 pixels on the thesis's display, of which none, a hundredth (in one place, as highlights lie, or
scattered) or all of the pixels are beyond the gamut. The error is of the mean ΔE00 against all pixels at once. What is
found is read from a file, checked, and compared by all that it depends on.

Then how many pixels lie outside the gamut, counted by the light of codes 0 and 1 and, as is often done, by linear light
0 and 1: the error is the share of pixels counted wrongly, against bisection over every channel's codes. Last, a picture
asked for in a lit room, the room's light taken off and not: the error is the mean ΔE00 of what is seen.

The error budget of the shipped rig against the framebuffer itself: what both say all steps cost, and in what time.

The plain way to know what a rig costs is to show the scene and read the framebuffer back. It gives all steps together
and no single one. The error of the budget is how far its mean ΔE00 is from that of the framebuffer; half floats and
resampling, which happen before, are left out of both. Each single step is in the rows below, its mean ΔE00 in the error
column.

The whole path in colours, in every stereo mode: asked XYZ, shader, framebuffer read back, forward model, ΔE00.

The thesis's display, colours all over its gamut (codes 0.02 to 0.93 of full drive), another for each pixel, for each
eye its own where the mode has two; the worse eye is told. With dithering the colours are patches of one mask period
each, and it is the mean light of a patch that is compared. The error is the mean ΔE00; the time is that of showing a
new picture: upload, colour passes, frame, on the EGL driver that this machine gives.

An anaglyph cannot show both eyes what they were asked. There, what each eye sees through its filter is compared with
what it would see of the mixed light that the channels can give; what the mixing and the clip cost is told per picture
by `cyclopean check`.

Verifying through a session's pass beside the model's own codes, where crosstalk and unevenness were measured.

Errors are the mean ΔE00 between 24 colours asked and a simulated reading of what the screen shows, without noise.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np
from curves import Row, program, row, seconds, sized, times_faster
from numpy.typing import NDArray
from promises import Promise, worst

from devices.budget import BudgetRow, Encoding, OwnPixels, PathStep, SmoothScene
from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from devices.compensation.clipping import clip_cost
from devices.compensation.compensate import Correction
from devices.compensation.crosstalk_cancel import seen_XYZ
from devices.display import EYES, Rig, entries_for, read_rig
from devices.display.crosstalk import Crosstalk
from devices.display.curves import ToneCurve
from devices.display.display_file import EyeModels, read_display
from devices.display.gain_map import GainMap
from devices.display.model import DisplayModel, outside_limits
from devices.display.nominal import Nominal
from devices.readings import Patch, PatchOnScreen
from devices.readings.colorchecker import asked_of
from devices.readings.simulated import Faults, Simulated, SimulatedDisplay
from documents.arrays import Floats
from runner.check.error_budget import rig_budget
from runner.measuring.code_screen import CodeScreen
from runner.measuring.patch_screen import AskedScreen, PatchScreen
from runner.measuring.verification import patches_of
from runner.presenter.depth import Bits, highest_code
from runner.presenter.dithering import Dithering
from runner.presenter.modes.mode import EyeArea, Mode
from runner.presenter.modes.registry import MODES, find_mode
from runner.presenter.presenter import Presenter
from runner.presenter.surfaces.opening import open_surface
from runner.scene import Picture, Scene
from runner.session.clipping_costs import CostCache
from stimuli.pictures.stereo_image import StereoImage

TITLE = "What clipping costs a picture, 1344 × 1000 pixels"
DISPLAY = Path(__file__).parents[1] / "configs/displays/asus_vg248qe.yaml"
HEIGHT, WIDTH = sized((1000, 1344), (100, 134))
COUNTED = sized(100_000, 1000)
BY_CODES, BY_UNITS = "outside the gamut, by the light of codes 0 and 1", "outside the gamut, by linear light 0 and 1"
ROOMS_CD_M2 = (0.1, 1.0, 5.0)


def clipped_pictures(model: DisplayModel) -> dict[str, NDArray[np.float32]]:
    """Return XYZ in cd/m², by how much of it is clipped."""
    rng = np.random.default_rng(7)
    inside = rng.uniform(0.02, 0.9, (HEIGHT, WIDTH, 3))
    place, scattered = inside.copy(), inside.copy()
    place[HEIGHT * 9 // 20 : HEIGHT * 11 // 20, WIDTH * 600 // 1344 : WIDTH * 735 // 1344] *= 3.0
    scattered[rng.random((HEIGHT, WIDTH)) < 0.01] *= 3.0
    asked = {"none": inside, "1 % in one place": place, "1 % scattered": scattered, "all": inside + 1.0}
    return {
        name: (model.black_XYZ_cd_m2 + light @ model.primaries_XYZ_cd_m2.T).astype(np.float32)
        for name, light in asked.items()
    }


def at_once(model: DisplayModel, xyz_cd_m2: NDArray[np.float32]) -> float:
    """Return the mean ΔE00, all pixels in one go, those that were clipped compared."""
    asked = xyz_cd_m2.reshape(-1, 3).astype(np.float64)
    linear = model.linear(asked)
    lowest, highest = model.limits
    changed = ((linear < lowest) | (linear > highest)).any(axis=1)
    model.clipping(asked)
    shown, white = model.xyz(model.code(asked[changed])), model.white_XYZ_cd_m2
    difference = delta_e_2000(xyz_to_lab(np.maximum(asked[changed], 0.0), white), xyz_to_lab(shown, white))
    return float(difference.sum() / len(asked))


def not_given(model: DisplayModel, linear: Floats) -> NDArray[np.bool_]:
    """Return for which of linear light (n, 3) some channel has no code: halved 50 times, without the model's limits."""
    low, high = np.zeros_like(linear), np.ones_like(linear)
    for _ in range(50):
        middle = 0.5 * (low + high)
        short = np.stack([curve.linear(middle[:, i]) for i, curve in enumerate(model.curves)], axis=1) < linear
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    given = np.stack([curve.linear(high[:, i]) for i, curve in enumerate(model.curves)], axis=1)
    return np.asarray((np.abs(given - linear) > model.gamut_tolerance).any(axis=1))


def counts() -> list[Row]:
    """Count a picture's pixels outside the gamut in both ways, on the thesis's display and on one lifted at code 0."""
    thesis = read_display(DISPLAY).models("side-by-side").left
    lifted = ToneCurve(0.75, 0.25, 2.4)
    models = {
        "the thesis's display": thesis,
        "a CRT with an offset of 0.25": DisplayModel(
            thesis.black_XYZ_cd_m2, thesis.primaries_XYZ_cd_m2, (lifted, lifted, lifted)
        ),
    }
    light = np.random.default_rng(3).uniform(-0.005, 1.1, (COUNTED, 1)) * np.random.default_rng(4).uniform(
        0.9, 1.0, (COUNTED, 3)
    )
    rows: list[Row] = []
    for name, model in models.items():
        asked = model.xyz_of_linear(light)
        truth = not_given(model, model.linear(asked))
        ways = {BY_CODES: (model.limits, model.gamut_tolerance), BY_UNITS: ((np.zeros(3), np.ones(3)), 1e-6)}
        for way, (limits, tolerance) in ways.items():

            def count(
                asked: Floats = asked, model: DisplayModel = model, limits: tuple[Floats, Floats] = limits, by=tolerance
            ) -> int:
                return outside_limits(model.linear(asked), limits, by).any_channel

            linear = model.linear(asked)
            out = ((linear < limits[0] - tolerance) | (linear > limits[1] + tolerance)).any(axis=1)
            assert count() == out.sum()
            white = model.shown_white_XYZ_cd_m2
            held = np.maximum(asked[~out], 0.0)
            off = delta_e_2000(xyz_to_lab(held, white), xyz_to_lab(model.xyz(model.code(held)), white))
            note = f"{100 * out.mean():.2f} % of {COUNTED} counted, {100 * truth.mean():.2f} % are; "
            note += f"counted as shown, and off by ΔE00 {off.max():.2g} at most"
            wrong = float((out != truth).mean())
            rows.append(row(way, name, seconds(count, repeats=3), wrong, note=note))
    return rows


def rooms() -> list[Row]:
    """Ask for a picture in rooms of some light, with the light taken off what is asked and not."""
    dark = read_display(DISPLAY).models("side-by-side").left
    rows: list[Row] = []
    for room in ROOMS_CD_M2:
        lit = dark.in_room(room * dark.white_XYZ_cd_m2 / dark.white_XYZ_cd_m2[1])
        asked = lit.xyz(np.random.default_rng(5).uniform(0.0, 1.0, (COUNTED, 3)))
        wanted = xyz_to_lab(asked, lit.shown_white_XYZ_cd_m2)
        for way, model in (("room's light taken off what is asked", lit), ("room's light left out of account", dark)):
            off = delta_e_2000(wanted, xyz_to_lab(lit.xyz(model.code(asked)), lit.shown_white_XYZ_cd_m2))
            time_s = seconds(lambda model=model, asked=asked: model.code(asked), repeats=3)
            note = (
                f"ΔE00 {off.max():.2g} at most; contrast {dark.contrast():.0f} in the dark, {lit.contrast():.0f} in it"
            )
            parameter = f"{room:g} cd/m²"
            rows.append(row(way, parameter, time_s, float(off.mean()), note=note))
    return rows


def clipping() -> dict[str, object]:
    """Time the three ways with each picture, then both ways to count and to ask in a lit room."""
    model = read_display(DISPLAY).models("side-by-side").left
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as folder:
        for name, picture in clipped_pictures(model).items():
            cache, depends_on = CostCache(Path(folder)), {"picture": name, "display": "0" * 64, "mode": "side-by-side"}
            cost = clip_cost(model, picture)
            cache.keep(depends_on, cost.to_json())
            error = abs(cost.delta_e_00_mean - at_once(model, picture))
            ways = {
                "in blocks": lambda picture=picture: clip_cost(model, picture),
                "all pixels at once": lambda picture=picture: at_once(model, picture),
                "found": lambda cache=cache, depends_on=depends_on: cache.find(depends_on),
            }
            faster = times_faster(ways["in blocks"], ways["all pixels at once"], rounds=5)
            notes = {"in blocks": f"{faster:.1f} × as fast as at once"}
            for way, work in ways.items():
                row = {"series": way, "parameter": f"{name} clipped", "seconds": seconds(work, repeats=3)}
                rows.append({**row, "error": error if way == "in blocks" else 0.0, "note": notes.get(way, "")})
    counted = counts()
    promises = [
        Promise("mean ΔE00 in blocks, off that of all pixels", worst(rows, series="in blocks"), 1e-12, "error"),
        Promise("share of pixels counted wrongly", worst(counted, series=BY_CODES), 0.0, "error"),
    ]
    return {"title": TITLE, "rows": rows + counted + rooms(), "promises": promises}


RIG = Path(__file__).parents[1] / "configs/rigs/asus_vg248qe_3dvision.yaml"
SCENE_PX = (192, 128)
LEAKS = Crosstalk(0.02 * np.eye(3), 0.02 * np.eye(3))
MOST_APART = 1e-3
OURS = "budget's path, all steps"


def of_framebuffer(rig: Rig, crosstalk: Crosstalk | None) -> float:
    """Return the mean ΔE00 of both eyes between the scene and what the framebuffer holds of it."""
    views = [SmoothScene(rig.models, SCENE_PX).view(eye, SCENE_PX) for eye in EYES]
    image = StereoImage(views[0].astype(np.float32), views[1].astype(np.float32))
    size_px, mode = (2 * SCENE_PX[0], SCENE_PX[1]), find_mode(rig.mode)
    correction = Correction(crosstalk)
    with (
        open_surface("egl", size_px) as surface,
        Presenter(surface, mode, rig.models, lambda _: image, correction=correction) as presenter,
    ):
        presenter.show(Scene((Picture("scene"),)))
        codes = [presenter.eye_view(eye) / 255.0 for eye in EYES]
    shown = seen_XYZ(rig.models, crosstalk, codes[0], codes[1])
    white = rig.models.left.white_XYZ_cd_m2
    pairs = zip(views, shown, strict=True)
    return float(np.mean([delta_e_2000(xyz_to_lab(a, white), xyz_to_lab(b, white)).mean() for a, b in pairs]))


def of_budget(rig: Rig, crosstalk: Crosstalk | None) -> float:
    """Return the same from the budget's path."""
    path = OwnPixels(rig.models, Encoding(255, entries_for(255, dithered=False), dithered=False), Correction(crosstalk))
    asked = {eye: SmoothScene(rig.models, SCENE_PX).view(eye, SCENE_PX).reshape(-1, 3) for eye in EYES}
    seen = path.seen(asked, set(PathStep) - {PathStep.HALF_FLOATS})
    white = rig.models.left.white_XYZ_cd_m2
    return float(
        np.mean([delta_e_2000(xyz_to_lab(asked[eye], white), xyz_to_lab(seen[eye], white)).mean() for eye in EYES])
    )


def compared(rig: Rig, name: str, crosstalk: Crosstalk | None) -> list[Row]:
    """Return a row of the budget and one of the framebuffer."""
    ours, theirs = of_budget(rig, crosstalk), of_framebuffer(rig, crosstalk)
    apart = abs(ours - theirs)
    note = f"mean ΔE00 {ours:.4f}, framebuffer {theirs:.4f}"
    return [
        {
            "series": OURS,
            "parameter": name,
            "seconds": seconds(lambda: of_budget(rig, crosstalk), repeats=3),
            "error": apart,
            "note": note,
        },
        {
            "series": "shown and read back",
            "parameter": name,
            "seconds": seconds(lambda: of_framebuffer(rig, crosstalk), repeats=3),
            "error": None,
            "note": "no step by itself",
        },
    ]


def step_row(row: BudgetRow, name: str) -> Row:
    """Return a row of the budget, its mean ΔE00 in the error column."""
    cost = None if row.eyes is None else row.eyes["left"]
    note = row.words if cost is None else f"{row.words}; 95 % within {cost.p95:.2g}, largest {cost.max:.2g}"
    mean = None if cost is None else cost.mean
    return {"series": f"step, {name}", "parameter": str(row.step), "seconds": None, "error": mean, "note": note}


def error_budget() -> dict[str, Any]:
    """Compare with the framebuffer, without and with crosstalk; then every step."""
    rig = read_rig(RIG)
    rows = [*compared(rig, "no crosstalk", None), *compared(rig, "2 % crosstalk", LEAKS)]
    rows += [step_row(row, "rounded") for row in rig_budget(rig).rows]
    rows += [
        step_row(row, "dithered")
        for row in rig_budget(replace(rig, spec=rig.spec.model_copy(update={"dither": "shared"}))).rows
    ]
    apart = Promise("mean ΔE00 of all steps against the framebuffer", worst(rows, series=OURS), MOST_APART, "error")
    return {"title": "Error budget of the shipped rig, in ΔE00", "rows": rows, "promises": [apart]}


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


def round_trip() -> dict[str, Any]:
    """Measure every mode in every way."""
    models = read_display(DISPLAY).models("side-by-side")
    rows = [measure(mode, models, way) for way in WAYS for mode in MODES.values()]
    # An anaglyph mixes both views into other codes by design.
    own = [own_codes(mode) for name, mode in MODES.items() if not name.startswith("anaglyph")]
    promises = [Promise("share of an sRGB picture's codes that change", _worst_error(own), 0.0, "error", "exactly")]
    return {
        "title": f"From asked XYZ to a framebuffer of {SIZE_PX[0]} × {SIZE_PX[1]} and back, in ΔE00",
        "rows": rows + own,
        "promises": _promises(rows) + promises,
    }


SIZE = sized((960, 540), (96, 54))
CURVE = ToneCurve(gamma=2.2)
MODEL = DisplayModel(
    np.array([0.02, 0.02, 0.03]),
    np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]]),
    (CURVE, CURVE, CURVE),
)


def verification() -> dict[str, object]:
    """Show and read the colours both ways, with a leak of 5 % and a panel that is dim at its right edge."""
    models = EyeModels(MODEL, MODEL)
    leaks = Crosstalk(0.05 * np.eye(3), 0.05 * np.eye(3))
    gain_map = GainMap(np.array([[25.0, 27.0, 20.0]]), SIZE, "cells", "centre")
    display = SimulatedDisplay(models, leaks, gain_map)
    instrument = Simulated(display, 0, Faults(noise=0.0))
    asked = asked_of(MODEL)
    wanted = np.array([colour.XYZ_cd_m2 for colour in asked])
    white = MODEL.xyz([1.0, 1.0, 1.0])
    patches = patches_of(asked, MODEL).rounded(255).patches
    mode = find_mode("row-interleaved")

    def read(screen: PatchScreen, patch: Patch) -> tuple[float, float, float]:
        shown = screen.show_patch(patch, "both")
        return instrument.read(PatchOnScreen(patch.name, shown.own, 0, 0.0, shown.other, patch, shown.place)).XYZ_cd_m2

    rows = []
    with open_surface("egl", SIZE) as surface:
        correction = Correction(leaks, gain_map)
        for series in ("through the pass, read back", "codes of the model alone"):
            screen: AskedScreen | CodeScreen
            if series.startswith("through"):
                screen = AskedScreen(
                    surface, mode, models, correction, {colour.name: colour.XYZ_cd_m2 for colour in asked}
                )
            else:
                screen = CodeScreen(surface, mode)
            with screen:
                light = np.array([read(screen, patch) for patch in patches])
                taken = seconds(lambda shown=screen: [read(shown, patch) for patch in patches], repeats=3) / len(
                    patches
                )
            error = float(delta_e_2000(xyz_to_lab(wanted, white), xyz_to_lab(light, white)).mean())
            note = "a patch shown and read; mean ΔE00 of 24 colours"
            rows.append(row(series, "row-interleaved", taken, error, note=note))
    through = worst(rows, series="through the pass")
    promise = Promise("mean ΔE00 of 24 colours through the session's pass", through, 0.3, "error", unit="ΔE00")
    return {
        "title": f"Verifying a display with crosstalk and a gain map, {SIZE[0]} × {SIZE[1]} pixels",
        "rows": rows,
        "promises": [promise],
    }


if __name__ == "__main__":
    program("shown", clipping, error_budget, round_trip, verification)
