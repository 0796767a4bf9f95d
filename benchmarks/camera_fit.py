"""A camera fitted to a chart: run time against left-out ΔE00, a sensor with real sensitivities; charts found."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from curves import answer_and_seconds, program, seconds, sized
from promises import Promise, worst

from devices.camera.correspondences import Correspondences
from devices.camera.fit import fit_camera
from devices.camera.solve import Loss
from devices.chart.layout import COLORCHECKER, perspective, project
from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from documents.arrays import Floats
from extensions.photo.find import find_corners

SMALLER = sized(1, 4)
CORNERS = np.array([[480.0, 360.0], [2480.0, 520.0], [2360.0, 1820.0], [380.0, 1640.0]]) / SMALLER


def seen_by_a_real_sensor() -> tuple[Floats, Floats, tuple[str, ...]]:
    """Return RGB (24, 3), XYZ (24, 3) in cd/m² and names: measured reflectances under D50, a Nikon's sensitivities."""
    import colour

    shape = colour.SpectralShape(400, 700, 10)
    chart = colour.SDS_COLOURCHECKERS["ISO 17321-1"]
    light = colour.SDS_ILLUMINANTS["D50"].copy().align(shape).values
    stimuli = np.array([sd.copy().align(shape).values for sd in chart.values()]) * light
    sensor = colour.MSDS_CAMERA_SENSITIVITIES["Nikon 5100 (NPL)"].copy().align(shape).values
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape).values
    rgb, XYZ = stimuli @ sensor, stimuli @ observer
    return 0.8 * rgb / rgb.max(), 100 * XYZ / float(light @ observer[:, 1]), tuple(chart)


def left_out_by(fit: Callable[[Floats, Floats], Floats], rgb: Floats, XYZ: Floats) -> float:
    """Return the mean ΔE00 of patches each predicted by ``fit`` to the others, a matrix (3, 3)."""
    white = XYZ[np.argmax(XYZ[:, 1])]
    every = np.arange(len(rgb))
    told = np.array([rgb[i] @ fit(rgb[every != i], XYZ[every != i]).T for i in every])
    return float(delta_e_2000(xyz_to_lab(told, white), xyz_to_lab(XYZ, white)).mean())


def colour_science(rgb: Floats, XYZ: Floats) -> Floats:
    """Return colour-science's matrix (3, 3), by Cheung, Westland, Connah and Ripamonti's method of three terms."""
    import colour

    return np.asarray(colour.matrix_colour_correction(rgb, XYZ, method="Cheung 2004", terms=3), dtype=np.float64)


def normal_equations(rgb: Floats, XYZ: Floats) -> Floats:
    """Return Expression 4.8 as it is printed, transposed."""
    return np.asarray((np.linalg.inv(rgb.T @ rgb) @ (rgb.T @ XYZ)).T)


def run() -> dict[str, object]:
    """Time fits whole, judged and with outliers sought, beside the bare matrix by others; and finding a chart."""
    rgb, XYZ, names = seen_by_a_real_sensor()
    colours = Correspondences(rgb, XYZ, names, rgb >= 1)
    shining = rgb.copy()
    shining[11] *= 1.4
    spoilt = Correspondences(shining, XYZ, names, shining >= 1)
    rows: list[dict[str, object]] = []
    losses: tuple[Loss, ...] = sized(("xyz", "delta-e"), ("xyz",))
    for label, seen in (("24 patches", colours), ("one of them specular", spoilt)):
        for loss in losses:
            found = fit_camera(seen, "linear", loss)
            held = found.held_out
            assert held is not None
            rows.append(
                {
                    "series": f"ours, {label}",
                    "parameter": loss,
                    "seconds": seconds(lambda seen=seen, loss=loss: fit_camera(seen, "linear", loss), repeats=5),
                    "error": held.mean,
                    "note": f"largest {held.max:.2f}; {len(found.left_out)} left out; each patch judged by the others",
                }
            )
        for peer, fit in (("colour-science", colour_science), ("Expression 4.8", normal_equations)):
            good = np.arange(24) != 11 if seen is spoilt else np.ones(24, dtype=bool)
            # Judged on the patches that are what they were measured to be.
            error = left_out_by(fit, seen.rgb, XYZ) if good.all() else _on(fit(seen.rgb, XYZ), rgb[good], XYZ[good])
            rows.append(
                {
                    "series": f"{peer}, {label}",
                    "parameter": "matrix alone",
                    "seconds": seconds(lambda seen=seen, fit=fit: fit(seen.rgb, XYZ), repeats=5),
                    "error": error,
                    "note": "left out one by one" if good.all() else "on the 23 others; nothing is left out",
                }
            )
    rows.append(_finding(rgb))
    ours, theirs = (worst(rows, series=f"{who}, one of them specular") for who in ("ours", "colour-science"))
    whole = [worst(rows, series=f"{who}, 24 patches") for who in ("ours", "colour-science")]
    promises = [
        Promise("ΔE00 of patches left out, above that of colour-science's matrix", whole[0] - whole[1], 0.1, "error"),
        Promise("the same with a specular patch, which ours finds", ours - theirs, 0.0, "error"),
        Promise("corners of a chart found in a photograph", worst(rows, series="chart found"), 0.5, "error", unit="px"),
    ]
    return {"title": "Camera fits: run time against ΔE00 of patches left out", "rows": rows, "promises": promises}


def _on(M: Floats, rgb: Floats, XYZ: Floats) -> float:
    white = XYZ[np.argmax(XYZ[:, 1])]
    return float(delta_e_2000(xyz_to_lab(rgb @ M.T, white), xyz_to_lab(XYZ, white)).mean())


def _finding(rgb: Floats) -> dict[str, object]:
    """Find the chart in a photograph of six million pixels; the error is its corners', in pixels."""
    x, y = np.meshgrid(np.arange(3000 // SMALLER) + 0.5, np.arange(2000 // SMALLER) + 0.5)
    at = project(np.asarray(np.linalg.inv(perspective(COLORCHECKER.outline(), CORNERS))), np.stack([x, y], axis=-1))
    cell, within = np.divmod(at, 1 + COLORCHECKER.gap)
    on_patch = np.all((within < 1) & (cell >= 0) & (cell < [6, 4]), axis=-1)
    number = np.clip(cell[..., 1] * 6 + cell[..., 0], 0, 23).astype(int)
    on_card = np.all((at > -0.5) & (at < np.array(COLORCHECKER.size) + 0.5), axis=-1)
    picture = np.where(on_patch[..., None], rgb[number], np.where(on_card[..., None], 0.01, 0.12)).astype(np.float32)
    picture += 0.003 * np.random.default_rng(1).standard_normal(picture.shape, dtype=np.float32)
    found, taken = answer_and_seconds(lambda: find_corners(picture), repeats=3)
    off = float(np.abs(found - CORNERS).max())
    return {
        "series": "chart found",
        "parameter": "6 megapixels",
        "seconds": taken,
        "error": off,
        "note": "error in pixels, of patches some 290 pixels wide",
    }


if __name__ == "__main__":
    program("camera_fit", run)
