"""Crosstalk cancelled and a panel evened out: in the pass, on the graphics card, beside float64 on the processor.

Times are of both eyes' codes of one pair of 1344 × 1000 pixels (1.3 million), from XYZ at hand (in memory, or uploaded
for the pass) to codes of 8 bits. On the processor that is the solution in NumPy, then a float32 picture, its upload and
the plain colour pass: what a presenter would do that cannot compensate. The error is the largest of any channel of any
pixel before rounding, in codes of 8 bits, against float64 throughout; at gamma 2.9 in the note.

A leak that takes light away is cancelled as it is, or clipped at 0 and taken for none: on the processor, 100,000
colours that both ways can show. The error is the largest difference between what is seen and what was asked, as the
codes of 8 bits that would give them.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from unittest.mock import patch

import numpy as np
from colour_pass import in_turn
from curves import Row, program, row, seconds, sized
from moderngl import Framebuffer, Texture
from numpy.typing import NDArray
from promises import Promise, worst

from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from devices.compensation.compensate import Correction
from devices.compensation.crosstalk_cancel import cancel_crosstalk, channel_crosstalk, seen_XYZ
from devices.display.crosstalk import Crosstalk
from devices.display.curves import ToneCurve
from devices.display.display_file import EYES, Eye, EyeModels
from devices.display.gain_map import GainMap
from devices.display.model import DisplayModel
from documents.arrays import Floats
from runner.presenter.arithmetic_choice import VARIABLE
from runner.presenter.code_pass import release_codes
from runner.presenter.colour_pass import ColourPass
from runner.presenter.compensated_pass import CORNER, CompensatedPass
from runner.presenter.surfaces.opening import open_surface
from runner.presenter.surfaces.surface import Surface

View = NDArray[np.float32]
Pair = dict[Eye, Floats]
Way = tuple[str, str]  # series and parameter

TITLE = "Crosstalk and an uneven panel, a pair of 1344 × 1000 pixels"
PLAIN: Way = "plain colour pass", "nothing compensated"
IN_PASS, ON_PROCESSOR = "in the pass", "float64 on the processor"
IN_TWO_FLOATS = "in the pass, two floats"
SIZE_PX = sized((1344, 1000), (96, 64))
GAMMA, HARD_GAMMA = 2.4, 2.9
PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
LEAKS = Crosstalk(np.diag([0.05, 0.04, 0.06]), np.diag([0.03, 0.05, 0.02]))
NEGATIVE = Crosstalk(np.diag([-0.03, -0.02, -0.04]), np.diag([-0.02, 0.01, -0.03]))
CLIPPED = Crosstalk(np.maximum(NEGATIVE.left, 0.0), np.maximum(NEGATIVE.right, 0.0))
# Figure 3.7 of the thesis.
READINGS = np.array([[0.0697, 0.1047, 0.0955], [0.1088, 0.1587, 0.1434], [0.1340, 0.1774, 0.1608]])
PANEL = GainMap(READINGS, SIZE_PX, "cells", "minimum")
CORRECTIONS = {
    "gain map": Correction(None, PANEL),
    "crosstalk": Correction(LEAKS),
    "crosstalk and gain map": Correction(LEAKS, PANEL),
}
CORRECTIONS = sized(CORRECTIONS, {name: CORRECTIONS[name] for name in ("gain map", "crosstalk and gain map")})


def display(gamma: float) -> EyeModels:
    """Return a display of ``gamma``, its right eye a tenth dimmer."""
    curve = ToneCurve(gamma=gamma)
    black = np.array([0.02, 0.02, 0.03])
    left = DisplayModel(black, PRIMARIES, (curve, curve, curve))
    return EyeModels(left, DisplayModel(black, 0.9 * PRIMARIES, (curve, curve, curve)))


def pair(models: EyeModels) -> dict[Eye, View]:
    """Return two views: colours of every light from 1e-7 of full to above white, and saturated ones, in any order."""
    rng = np.random.default_rng(2)
    width, height = SIZE_PX
    views: dict[Eye, View] = {}
    for eye in EYES:
        light = 10.0 ** rng.uniform(-7.0, 0.1, (height, width, 3))
        light[rng.random((height, width, 3)) < 0.2] = 0.0
        model = models.eye(eye)
        views[eye] = (model.black_XYZ_cd_m2 + light @ model.primaries_XYZ_cd_m2.T).astype(np.float32)
    return views


def solved(models: EyeModels, correction: Correction, views: dict[Eye, View]) -> Pair:
    """Return the XYZ to ask of each eye's display model, as `cancel_crosstalk` has it but without its report."""
    models = models.normalised
    sent: Pair = {eye: view.astype(np.float64) for eye, view in views.items()}
    if correction.crosstalk is not None:
        mix = channel_crosstalk(models, correction.crosstalk)
        left, right = (np.clip(models.eye(eye).linear(sent[eye]), 0.0, 1.0) for eye in EYES)
        first = [np.clip(light, 0.0, 1.0) for light in mix.solve(left, right)]
        lights: Pair = {"left": left - first[1] @ mix.left.T, "right": right - first[0] @ mix.right.T}
        for eye, light in lights.items():
            model = models.eye(eye)
            sent[eye] = model.black_XYZ_cd_m2 + np.clip(light, 0.0, 1.0) @ model.primaries_XYZ_cd_m2.T
    if correction.gain_map is not None:
        width, height = SIZE_PX
        gain = correction.gain_map.over(np.arange(width) + 0.5, np.arange(height) + 0.5)
        sent = {eye: correction.gain_map.corrected(xyz, gain) for eye, xyz in sent.items()}
    return sent


def uploaded(surface: Surface, view: View) -> Texture:
    """Return a texture of ``view``."""
    return surface.context.texture(SIZE_PX, 3, np.ascontiguousarray(view), alignment=1, dtype="f4")


def error_codes(drawn: Framebuffer, wanted: Floats) -> float:
    """Return how far codes as computed are from ``wanted`` (0..1) at most, in codes of 8 bits; frees them."""
    width, height = SIZE_PX
    shown = np.frombuffer(drawn.read(components=3, dtype="f4"), np.float32).reshape(height, width, 3)[::-1]
    release_codes(drawn)
    return 255.0 * float(np.abs(shown - wanted).max())


def compensated(surface: Surface, word: str, models: EyeModels, correction: Correction, eye: Eye) -> CompensatedPass:
    """Return the pass of ``eye`` in the arithmetic ``word``."""
    with patch.dict(os.environ, {VARIABLE: word}):
        return CompensatedPass(surface.context, models, correction, eye)


def errors(surface: Surface, gamma: float) -> dict[Way, float]:
    """Return the largest error of each way and each correction."""
    models = display(gamma)
    views = pair(models)
    context = surface.context
    found: dict[Way, float] = {}
    textures = {eye: uploaded(surface, views[eye]) for eye in EYES}
    for name, correction in CORRECTIONS.items():
        sent = solved(models, correction, views)
        for eye, other in (EYES, EYES[::-1]):
            wanted = models.eye(eye).code(sent[eye])
            plain = ColourPass(context, models.eye(eye))
            picture = uploaded(surface, sent[eye].astype(np.float32))
            own, floats = (compensated(surface, word, models, correction, eye) for word in ("doubles", "two-floats"))
            drawn = {
                ON_PROCESSOR: plain.run(picture, dtype="f4"),
                IN_PASS: own.run(textures[eye], textures[other], CORNER, dtype="f4"),
                IN_TWO_FLOATS: floats.run(textures[eye], textures[other], CORNER, dtype="f4"),
            }
            for way, codes in drawn.items():
                found[way, name] = max(found.get((way, name), 0.0), error_codes(codes, wanted))
            for held in (plain, picture, own, floats):
                held.release()
    for texture in textures.values():
        texture.release()
    return found


def work(surface: Surface, models: EyeModels) -> dict[Way, Callable[[], object]]:
    """Return what to time."""
    context = surface.context
    views = pair(models)
    textures = {eye: uploaded(surface, views[eye]) for eye in EYES}
    plain = {eye: ColourPass(context, models.eye(eye)) for eye in EYES}

    def on_processor(correction: Correction) -> None:
        for eye, xyz in solved(models, correction, views).items():
            picture = uploaded(surface, xyz.astype(np.float32))
            release_codes(plain[eye].run(picture))
            picture.release()
        context.finish()

    def in_pass(passes: dict[Eye, CompensatedPass]) -> None:
        for eye, other in (EYES, EYES[::-1]):
            release_codes(passes[eye].run(textures[eye], textures[other], CORNER))
        context.finish()

    def uncompensated() -> None:
        for eye in EYES:
            release_codes(plain[eye].run(textures[eye]))
        context.finish()

    found: dict[Way, Callable[[], object]] = {PLAIN: uncompensated}
    for name, correction in CORRECTIONS.items():
        for way, word in ((IN_PASS, "doubles"), (IN_TWO_FLOATS, "two-floats")):
            passes = {eye: compensated(surface, word, models, correction, eye) for eye in EYES}
            found[way, name] = partial(in_pass, passes)
        found[ON_PROCESSOR, name] = partial(on_processor, correction)
    found["report of what is left", "crosstalk"] = partial(
        cancel_crosstalk, models, LEAKS, views["left"], views["right"]
    )
    return found


def negative_leaks() -> list[Row]:
    """Return what is seen of a display with leaks below 0 where they are cancelled, and where they count as none."""
    models = display(GAMMA)
    rng = np.random.default_rng(3)
    asked = {eye: models.eye(eye).xyz(rng.uniform(0.3, 0.9, (sized(100_000, 1000), 3))) for eye in EYES}
    white = models.left.white_XYZ_cd_m2
    rows: list[Row] = []
    for series, leaks in (("leak below 0, cancelled", NEGATIVE), ("leak below 0, taken for none", CLIPPED)):
        work = partial(cancel_crosstalk, models, leaks, asked["left"], asked["right"])
        sent = work()
        codes = [
            models.eye(eye).code(models.eye(eye).xyz_of_linear(light))
            for eye, light in (("left", sent.left_linear), ("right", sent.right_linear))
        ]
        seen = seen_XYZ(models, NEGATIVE, *codes)[0]
        off = 255.0 * np.abs(models.left.code(seen) - models.left.code(asked["left"])).max()
        delta_e = delta_e_2000(xyz_to_lab(seen, white), xyz_to_lab(asked["left"], white))
        rows.append(
            row(
                series,
                "leaks of -4 to 1 % of each channel",
                seconds(work, repeats=3),
                float(off),
                note=f"ΔE00 {delta_e.mean():.2g} on average, {delta_e.max():.2g} at most",
            )
        )
    return rows


def run() -> dict[str, object]:
    """Return the rows, measured on the EGL driver that this machine gives."""
    with open_surface("egl", (640, 480)) as surface:
        soft, hard = errors(surface, GAMMA), errors(surface, HARD_GAMMA)
        ways = work(surface, display(GAMMA))
        timed = in_turn({", ".join(way): once for way, once in ways.items()}, rounds=3)
        renderer = surface.facts.renderer
    times = {way: timed[", ".join(way)] for way in ways}
    rows: list[Row] = []
    for (series, parameter), time_s in times.items():
        error, hard_error = soft.get((series, parameter)), hard.get((series, parameter))
        note = f"{time_s / times[PLAIN]:.2f} × the plain colour pass"
        if series == ON_PROCESSOR:
            note = f"{time_s / times[IN_PASS, parameter]:.2f} × the pass that does the same"
        if hard_error is not None:
            note += f"; at gamma {HARD_GAMMA}: {hard_error:.2g}"
        if error is None and (series, parameter) != PLAIN:
            note = "percentages and ΔE00 for the session's record, on the processor, once per picture"
        rows.append(row(series, parameter, time_s, error, error_gamma_2_9=hard_error, note=note))
    passes = [row for row in rows if row["series"] in (IN_PASS, IN_TWO_FLOATS)]
    promises = [
        Promise("largest error in the pass at gamma 2.4, before rounding", worst(passes), 0.001, "error", unit="codes"),
        Promise("at gamma 2.9", worst(passes, "error_gamma_2_9"), 0.003, "error", unit="codes"),
    ]
    return {"title": f"{TITLE} ({renderer})", "rows": rows + negative_leaks(), "promises": promises}


if __name__ == "__main__":
    program("crosstalk", run)
