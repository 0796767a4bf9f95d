"""What clipping costs a picture: in blocks, those within the gamut skipped; at once; or found as kept.

A picture of 1344 × 1000 pixels on the thesis's display, of which none, a hundredth (in one place, as highlights lie, or
scattered) or all of the pixels are beyond the gamut. The error is of the mean ΔE00 against all pixels at once. What is
found is read from a file, checked, and compared by all that it depends on.

Then how many pixels lie outside the gamut, counted by the light of codes 0 and 1 and, as is often done, by linear light
0 and 1: the error is the share of pixels counted wrongly, against bisection over every channel's codes. Last, a picture
asked for in a lit room, the room's light taken off and not: the error is the mean ΔE00 of what is seen.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from curves import Row, program, row, seconds, sized, times_faster
from numpy.typing import NDArray
from promises import Promise, worst

from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from devices.compensation.clipping import clip_cost
from devices.display.curves import ToneCurve
from devices.display.display_file import read_display
from devices.display.model import DisplayModel, outside_limits
from documents.arrays import Floats
from runner.session.clipping_costs import CostCache

TITLE = "What clipping costs a picture, 1344 × 1000 pixels"
DISPLAY = Path(__file__).parents[1] / "configs/displays/asus_vg248qe.yaml"
HEIGHT, WIDTH = sized((1000, 1344), (100, 134))
COUNTED = sized(100_000, 1000)
BY_CODES, BY_UNITS = "outside the gamut, by the light of codes 0 and 1", "outside the gamut, by linear light 0 and 1"
ROOMS_CD_M2 = (0.1, 1.0, 5.0)


def pictures(model: DisplayModel) -> dict[str, NDArray[np.float32]]:
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


def run() -> dict[str, object]:
    """Time the three ways with each picture, then both ways to count and to ask in a lit room."""
    model = read_display(DISPLAY).models("side-by-side").left
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as folder:
        for name, picture in pictures(model).items():
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


if __name__ == "__main__":
    program("clip_cost", run)
