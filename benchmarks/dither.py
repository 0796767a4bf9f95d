"""Dithering to 8 bits, in the colour pass to 10 too: run time on one picture against the error of the mean light.

The error is the largest bias of luminance, relative, over greys from code 1.5 of 8 bits to full light: mean over one
period of the mask against what was asked. Times are for a 512 × 512 picture: of NumPy, and of the colour pass on the
EGL driver that this machine gives, from XYZ on the graphics card to codes there.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from curves import Row, program, row, seconds, sized, times_faster
from moderngl import Context, Texture
from numpy.typing import NDArray
from promises import Promise, worst

from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from devices.compensation.dither import ENTRIES, dither_codes, dither_tables, dither_thresholds, tabled_dither_codes
from devices.display.display_file import read_display
from devices.display.model import DisplayModel
from documents.arrays import Floats
from runner.presenter.colour_pass import ColourPass, release_codes
from runner.presenter.depth import Bits, highest_code
from runner.presenter.dithering import Dithering
from runner.presenter.surfaces.opening import open_surface
from runner.presenter.surfaces.surface import Surface

Dither = Callable[[Floats, Floats], NDArray[np.int64]]

ASUS = Path(__file__).parents[1] / "configs/displays/asus_vg248qe.yaml"
FULL = 243.0  # beyond it green has all its light
SIZE_PX = sized(512, 64)


def ways(model: DisplayModel) -> dict[tuple[str, str], Dither]:
    """Return ways to dither XYZ (..., 3) by thresholds (..., 3), by series and parameter."""
    found: dict[tuple[str, str], Dither] = {
        ("no dithering", "rounded"): lambda xyz, u: np.rint(model.code(xyz) * 255).astype(np.int64),
        ("dithered code", "float64"): lambda xyz, u: np.floor(model.code(xyz) * 255 + 1 - u).astype(np.int64),
        ("dithered light", "closed form, float64"): lambda xyz, u: dither_codes(model, xyz, u),
    }
    for entries in (8, 32, 256, 1024):
        tables = dither_tables(model, entries=entries)
        found["dithered light, tables", f"{entries} entries, float32"] = lambda xyz, u, tables=tables: (
            tabled_dither_codes(model, xyz, u, tables)
        )
    return found


def errors(model: DisplayModel, dither: Dither, levels: int = 255) -> tuple[float, float]:
    """Return the largest relative bias of luminance and the largest ΔE00 of mean XYZ, of codes 0..levels.

    The greys asked for are the same, whatever the levels.
    """
    codes = np.concatenate([np.arange(1.5, 16, sized(0.125, 3.5)), np.geomspace(16, FULL, sized(150, 4))])
    asked = model.xyz(np.repeat(codes[:, None], 3, axis=1) / 255)
    period = dither_thresholds(64, 64)
    shown = np.array([model.xyz(dither(np.broadcast_to(xyz, period.shape), period) / levels) for xyz in asked])
    mean = shown.reshape(len(asked), -1, 3).mean(axis=1)
    white = model.white_XYZ_cd_m2
    difference = delta_e_2000(xyz_to_lab(asked, white), xyz_to_lab(mean, white))
    return float(np.abs(mean[:, 1] / asked[:, 1] - 1).max()), float(difference.max())


def upload(context: Context, xyz: Floats) -> Texture:
    """Return a texture of XYZ (height, width, 3)."""
    return context.texture(xyz.shape[1::-1], 3, xyz.astype(np.float32).tobytes(), alignment=1, dtype="f4")


def drawn(context: Context, colour_pass: ColourPass, levels: int, xyz: Floats, _: Floats) -> NDArray[np.int64]:
    """Return what the colour pass, which has thresholds of its own, makes of XYZ (height, width, 3): 0..levels."""
    picture = upload(context, xyz)
    codes = colour_pass.run(picture)
    shown = np.frombuffer(codes.read(components=3, dtype="f4"), np.float32).reshape(xyz.shape)[::-1]
    release_codes(codes)
    picture.release()
    return np.rint(shown * levels).astype(np.int64)


def pass_rows(surface: Surface, model: DisplayModel, picture: Floats) -> list[Row]:
    """Time the colour pass with and without dithering, in turn, so that other work slows both alike."""
    context = surface.context
    uploaded = upload(context, picture)
    bits: tuple[Bits, ...] = (8, 10)
    passes = {
        (name, depth): ColourPass(context, model, dithering=dithering, bits=depth)
        for depth in bits
        for name, dithering in (("rounded", None), ("dithered", Dithering()))
    }

    def once(colour_pass: ColourPass) -> None:
        release_codes(colour_pass.run(uploaded))
        context.finish()

    rows: list[Row] = []
    for (name, depth), colour_pass in passes.items():
        levels = highest_code(depth)
        bias, difference = errors(model, partial(drawn, context, colour_pass, levels), levels)
        note = f"ΔE00 of the mean at most {difference:.2g}; {surface.facts.renderer}"
        if (name, depth) != ("rounded", 8):
            slower = times_faster(lambda: once(passes["rounded", 8]), lambda made=colour_pass: once(made), rounds=25)
            note += f"; {slower:.2f} × the pass rounded to 8 bits"
        taken = seconds(lambda colour_pass=colour_pass: once(colour_pass))
        rows.append(row("colour pass", f"{name}, {depth} bits", taken, bias, note=note))
    return rows


def run() -> dict[str, object]:
    """Time every way on the same picture, and measure its errors on the thesis's display."""
    model = read_display(ASUS).models("side-by-side").left
    light = np.random.default_rng(0).uniform(0, 0.95, (SIZE_PX, SIZE_PX, 3)) ** 2
    picture = light @ model.primaries_XYZ_cd_m2.T
    thresholds = dither_thresholds(SIZE_PX, SIZE_PX)
    rows: list[Row] = []
    for (series, parameter), dither in ways(model).items():
        bias, difference = errors(model, dither)
        taken = seconds(lambda dither=dither: dither(picture, thresholds), repeats=3)
        note = f"ΔE00 of the mean at most {difference:.2g}"
        rows.append(row(series, parameter, taken, bias, note=note))
    with open_surface("egl", (SIZE_PX, SIZE_PX)) as surface:
        rows += pass_rows(surface, model, picture)
    means = [
        worst(rows, series=series, parameter=way)
        for series, way in (
            ("dithered light", "closed form"),
            ("dithered light, tables", f"{ENTRIES} entries"),
            ("colour pass", "dithered"),
        )
    ]
    promise = Promise("luminance of the mean over the mask, relative", max(means), 1e-3, "error")
    return {"title": f"Dithering {SIZE_PX} × {SIZE_PX} pixels to 8 bits", "rows": rows, "promises": [promise]}


if __name__ == "__main__":
    program("dither", run)
