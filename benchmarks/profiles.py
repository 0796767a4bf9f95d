"""ICC profiles and `.cube` tables of a display: time to make one against the error of its light, by LittleCMS."""

from __future__ import annotations

from functools import partial

import numpy as np
from curves import program, seconds, sized
from promises import Promise, worst

from devices.characterise import thesis_display
from devices.colour import delta_e_2000, lab_to_xyz, xyz_to_lab
from devices.display import DisplayModel
from devices.profiles import model_of_profile
from devices.profiles.colour_table import between
from devices.profiles.profile import profile_of
from devices.profiles.tag_table import parse_profile_file
from documents.arrays import Floats
from extensions.profiles import CubeInput, WrittenProfile, cube_of_model, profile_of_model
from tests.devices.profiles.little_cms import through
from tests.devices.profiles.profile_bytes import plvc_display

COLOURS = sized(4000, 100)
FORMS: tuple[tuple[str, int | None], ...] = (
    ("matrix", None),
    ("table", 5),
    ("table", 9),
    ("table", 17),
    ("table", 33),
    ("table", 45),
    ("table", 65),
)


def _error(model: DisplayModel, found: Floats, wanted: Floats) -> tuple[float, float]:
    """Return the mean and the largest ΔE00."""
    white = model.shown_white_XYZ_cd_m2
    off = delta_e_2000(xyz_to_lab(found, white), xyz_to_lab(wanted, white))
    return float(off.mean()), float(off.max())


def _rows(name: str, model: DisplayModel) -> list[dict[str, object]]:
    codes = np.random.default_rng(2).random((COLOURS, 3)) ** 1.5
    wanted = model.xyz(codes)
    rows: list[dict[str, object]] = []
    for kind, points in sized(FORMS, (FORMS[0], FORMS[4])):
        if kind == "matrix" and not model.additive:
            continue
        # `kind` is one of the names above, which a loop makes plain text.
        make = partial(profile_of_model, model, "benchmark", kind=kind, points=points)  # type: ignore[arg-type]
        made: WrittenProfile = make()
        profile = profile_of(parse_profile_file(made.data, "made"))
        luminance = profile.white_cd_m2(None)
        seen = profile.absolute(through(made.data, codes), luminance)
        relative = wanted @ profile.adaptation.T / luminance
        back = model.xyz(np.clip(through(made.data, relative, back=True), 0.0, 1.0))
        error, back_error = _error(model, seen, wanted), _error(model, back, wanted)
        rows.append(
            {
                "series": f"{name}: {kind}",
                "parameter": f"{points} points a side" if points else "",
                "seconds": seconds(make, repeats=3),
                "error": error[0],
                "largest": error[1],
                "note": f"at most {error[1]:.2g}; back {back_error[0]:.2g}, at most {back_error[1]:.2g}; "
                f"{len(made.data) / 1000:.0f} kB",
            }
        )
    for points in sized((9, 17, 33), (9,)):
        plain = partial(_plain, model, points)
        error = _error(model, lab_to_xyz(between(plain(), codes), model.shown_white_XYZ_cd_m2), wanted)
        rows.append(
            {
                "series": f"{name}: a plain table of Lab over codes",
                "parameter": f"{points} points a side",
                "seconds": seconds(plain, repeats=3),
                "error": error[0],
                "note": f"at most {error[1]:.2g}; not written, in 64 bits",
            }
        )
    forms: tuple[tuple[CubeInput, int], ...] = (
        ("srgb", 17),
        ("srgb", 33),
        ("srgb", 65),
        ("light", 1024),
        ("light", 4096),
    )
    for given, points in forms[:: sized(1, 3)]:
        if given == "light" and not model.additive:
            continue
        cube = cube_of_model(model, "benchmark", given, points=points)
        rows.append(
            {
                "series": f"{name}: .cube from {given}",
                "parameter": f"{points} points",
                "seconds": seconds(partial(cube_of_model, model, "benchmark", given, points=points), repeats=1),
                "error": cube.mean,
                "note": f"at most {cube.largest:.2g}; {len(cube.text) / 1000:.0f} kB",
            }
        )
    return rows


def _plain(model: DisplayModel, points: int) -> Floats:
    """Return Lab on a grid of codes, as a table without curves has it."""
    axis = np.linspace(0.0, 1.0, points)
    codes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    return xyz_to_lab(model.xyz(codes), model.shown_white_XYZ_cd_m2)


def run() -> dict[str, object]:
    """Time each form on an additive display and on one whose channels act on each other."""
    additive, acting = thesis_display(), plvc_display(0.15)
    rows = [*_rows("additive", additive), *_rows("PLVC", acting)]
    data = profile_of_model(additive, "benchmark").data
    codes = np.random.default_rng(3).random((sized(100_000, 1000), 3))
    for series, work in (
        ("a matrix profile read as a display model", lambda: _model(data)),
        ("100,000 codes to XYZ by the model", lambda: additive.xyz(codes)),
        ("100,000 codes to XYZ by LittleCMS", lambda: through(data, codes)),
    ):
        rows.append({"series": series, "parameter": "", "seconds": seconds(work, repeats=3), "error": None})
    table = {"series": "PLVC: table", "parameter": "33 points"}
    promises = [
        Promise("PLVC by a table of 33 points, mean ΔE00", worst(rows, **table), 0.1, "error"),
        Promise("largest ΔE00 of it", worst(rows, "largest", **table), 0.5, "error"),
        Promise("a matrix profile, largest ΔE00", worst(rows, "largest", series="additive: matrix"), 0.01, "error"),
    ]
    title = f"ICC profiles and .cube tables; ΔE00 of {COLOURS:,} colours by LittleCMS"
    return {"title": title, "rows": rows, "promises": promises}


def _model(data: bytes) -> object:
    return model_of_profile(profile_of(parse_profile_file(data, "made")))


if __name__ == "__main__":
    program("profiles", run)
