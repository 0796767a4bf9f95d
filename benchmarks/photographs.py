"""Photographs: development, brackets, a camera's fit, means of a chart's patches, and pixels made fewer.

Photographs to linear camera RGB, and spectra to XYZ: run time against error.

A sensor of known levels and noise-free values photographs a plate of small coloured sparkles, spread by a lens of
1 pixel standard deviation, and a zone plate. The error of a development is the root mean square over the picture, in
shares of full scale; the note says how far its mean light is off. The peer is LibRaw by itself, asked for linear camera
RGB. Then the same light as XYZ on a display with a quarter of the pixels, and its sparkles counted: the error is that
of luminance, root mean square over the mean. Spectra are summed at coarser and coarser spacing, beside colour-science.

Bracketed photographs merged to one picture: run time against error, beside OpenCV's merging.

A simulated sensor (30000 electrons at full scale, 6 of read noise) photographs patches of 11 stops at six exposures,
1/8 to 1/250 s. The error is the root mean square of the relative error over values that some exposure saw below full.
OpenCV merges 8 bits only: its rows get the same linear values in 8 bits, and so does one of ours. The rows "14 bits"
are of the sensor's own codes.

A camera fitted to a chart: run time against left-out ΔE00, a sensor with real sensitivities; charts found.

Mean colours of a chart's 24 patches in a photograph: run time against error.

Beside ours: masks as large as the picture with sums in float32 and in float64, and OpenCV's `fillPoly` and `mean`,
whose corners are whole pixels and whose areas hold the pixels of their outline too. And the table of all regions at
once against one region after the other.

A plate photographed with 2190 × 1460 pixels, brought to 542 × 361 of a display: run time against aliasing.

The error is what a chirp above the display's Nyquist frequency leaves behind: root of the mean square over 0.55 to 1.9
cycles per display pixel, the chirp's own amplitude being 1. Beside it stand how much of it passes below Nyquist, and
for a plate of sparkles the least luminance, how much light is lost, and what a sparkle's brightest pixel keeps.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from curves import Row, answer_and_seconds, program, row, seconds, sized, times_faster
from numpy.typing import NDArray
from promises import Promise, times_as_fast, worst

from devices.camera.correspondences import Correspondences
from devices.camera.fit import fit_camera
from devices.camera.solve import Loss
from devices.chart.layout import COLORCHECKER, patch_quadrangles, perspective, project
from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from documents.arrays import Floats
from extensions.photo import NoiseModel, merge_exposures
from extensions.photo.find import find_corners
from stimuli.comparison.areas import AreaMean, area_means, inside, window
from stimuli.comparison.regions import PairedArea
from stimuli.comparison.table import region_table
from stimuli.develop.camera_image import CameraImage
from stimuli.develop.demosaic import RGB, Mosaic, by_bands, interpolate
from stimuli.develop.raw_files import DEMOSAICS, read_raw
from stimuli.pictures.resampling import Filter, axis_weights, resample
from stimuli.sparkles.find import SparkleThreshold
from stimuli.sparkles.measure import measure_sparkles
from stimuli.spectral.bands import read_spectral
from stimuli.spectral.convert import spectral_to_xyz
from tests.extensions.photo.sensor import FULL_E, READ_E, SPAN, TIMES, codes, record, scene
from tests.stimuli.develop.dng import write_dng
from tests.stimuli.spectral.pictures import bumps, save_exr

DEVELOPED_PX = sized(512, 64)
BLACK, FULL = 600, 15520
BALANCE = np.array([0.45, 0.9, 0.6])  # a sensor that sees least red, as most do in tungsten light
SPACINGS_NM = sized((1, 2, 5, 10, 20), (5, 10))
# A camera's matrix in cd/m² for balanced channels of full scale; its colours mix, and some XYZ come out below 0.
MATRIX = np.array([[220.0, 37.0, 3.0], [84.0, 146.0, -46.0], [12.0, -35.0, 220.0]]) / BALANCE
SHOWN = 4


def sparkling(side_px: int, sigma_px: float = 1.0, seed: int = 0) -> NDArray[np.float64]:
    """Return linear camera RGB (side, side, 3), at most 1."""
    from scipy.ndimage import gaussian_filter

    rng = np.random.default_rng(seed)
    count = side_px**2 // 90
    points = np.zeros((side_px, side_px, 3))
    hue = 1 + 0.3 * rng.normal(size=(count, 3)).clip(-2, 2)
    place = tuple(rng.integers(0, side_px, (2, count)))
    np.add.at(points, place, 2 * rng.lognormal(-1, 1, count)[:, None] * hue * BALANCE)
    return np.clip(0.04 * BALANCE + np.stack([gaussian_filter(points[..., c], sigma_px) for c in range(3)], -1), 0, 1)


def by_libraw(path: Path) -> NDArray[np.float64]:
    """Return linear camera RGB by LibRaw alone: AHD in 16 bits, black, white and clipping its own."""
    import rawpy

    with rawpy.imread(str(path)) as raw:
        picture = raw.postprocess(
            output_color=rawpy.ColorSpace.raw,
            output_bps=16,
            gamma=(1, 1),
            user_wb=[1, 1, 1, 1],
            no_auto_bright=True,
            adjust_maximum_thr=0.0,
            user_flip=0,
        )
    return picture / 65535.0


def zone_plate(side_px: int) -> NDArray[np.float64]:
    """Return rings that grow finer outwards, to 2.8 photosites a ring in the corners, in linear camera RGB."""
    rows, columns = np.mgrid[:side_px, :side_px] - 0.5 * side_px
    rings = 0.5 + 0.4 * np.cos(0.5 * np.pi * (rows**2 + columns**2) / side_px)
    return np.asarray(rings[..., None] * BALANCE)


def develop_rows(folder: Path, name: str, truth: NDArray[np.float64]) -> list[dict[str, object]]:
    """Return a row for each demosaicing, for AHD on channels that are left unbalanced, and for the peer."""
    write = partial(write_dng, rgb=truth, black=(BLACK,), white=FULL)
    path = write(folder / "balanced.dng", neutral=tuple(BALANCE / BALANCE.max()))
    unbalanced = write(folder / "unbalanced.dng", neutral=(1.0, 1.0, 1.0))
    work: dict[str, partial[CameraImage] | partial[NDArray[np.float64]]] = {
        method: partial(read_raw, path, demosaic=method) for method in DEMOSAICS
    }
    work["ahd, unbalanced"] = partial(read_raw, unbalanced, demosaic="ahd")
    work["LibRaw alone (AHD)"] = partial(by_libraw, path)
    side = len(truth) // 2
    halves = truth.reshape(side, 2, side, 2, 3).mean(axis=(1, 3))
    rows: list[dict[str, object]] = []
    for method, make in work.items():
        image = make()
        rgb = image.rgb if isinstance(image, CameraImage) else image
        aim = halves if method == "superpixel" else truth
        off = (rgb - aim)[8:-8, 8:-8]
        error = float(np.sqrt((off**2).mean()))
        note = f"mean R, G, B off by {_shares(off, aim)}"
        if (rgb < 0).any():
            note += f", with all below 0 set to 0 by {_shares((np.maximum(rgb, 0) - aim)[8:-8, 8:-8], aim)}"
        if isinstance(image, CameraImage) and image.saturated.any():
            note += f"; {100 * image.saturated.any(axis=-1).mean():.1f} % marked saturated"
        taken = seconds(make, repeats=3)
        rows.append(row(name, method, taken, error, note=note))
    return rows


def _shares(off: NDArray[np.float64], aim: NDArray[np.float64]) -> str:
    return " ".join(f"{100 * share:+.2f}" for share in off.mean(axis=(0, 1)) / aim.mean(axis=(0, 1))) + " %"


def light_rows(folder: Path, name: str, truth: NDArray[np.float64]) -> list[dict[str, object]]:
    """Return a row for each demosaicing: error of the luminance shown, mean XYZ, and sparkles beside those drawn."""
    path = write_dng(folder / "light.dng", truth, black=(BLACK,), white=FULL, neutral=tuple(BALANCE / BALANCE.max()))
    rows: list[dict[str, object]] = []
    for method in DEMOSAICS:
        make = partial(read_raw, path, demosaic=method)
        found = np.maximum(make().rgb.astype(np.float64) @ MATRIX.T, 0)
        drawn = np.maximum(truth @ MATRIX.T, 0)
        small = len(drawn) // len(found)
        off = (_averaged(found, SHOWN // small) - _averaged(drawn, SHOWN))[2:-2, 2:-2]
        aim = _averaged(drawn, small)
        seen, there = (
            measure_sparkles(one[..., 1].astype(np.float32), SparkleThreshold(times=2)) for one in (found, aim)
        )
        note = f"mean X, Y, Z off by {_shares((found - aim)[8:-8, 8:-8], aim)}; {seen.count.value:.0f} sparkles of "
        note += f"{there.count.value:.0f}"
        if there.count.value:
            note += f", contrast {seen.contrast.value:.2f} of {there.contrast.value:.2f}"
        error = float(np.sqrt((off[..., 1] ** 2).mean()) / aim[..., 1].mean())
        taken = seconds(make, repeats=3)
        rows.append(row(name, method, taken, error, note=note))
    return rows


def _averaged(light: NDArray[np.float64], times: int) -> NDArray[np.float64]:
    height, width = (length // times for length in light.shape[:2])
    return np.asarray(light.reshape(height, times, width, times, -1).mean(axis=(1, 3)))


def band_rows(side_px: int = sized(2048, 128)) -> list[dict[str, object]]:
    """Return rows of the same photosites interpolated at once and by bands; the error is that between the two: none."""
    values = np.random.default_rng(0).random((side_px, side_px)).astype(np.float32)
    mosaic = Mosaic(values, values > 0.99, np.array([[0, 1], [1, 2]]))

    def bands() -> NDArray[np.float32]:
        rgb = np.empty((side_px, side_px, 3), np.float32)

        def keep(rows: slice, part: RGB) -> None:
            rgb[rows] = part[0]

        by_bands(mosaic, "malvar", keep)
        return rgb

    whole = partial(interpolate, mosaic, "malvar")
    error = float(np.abs(bands() - whole()[0]).max())
    return [
        row("4 megapixels, malvar", name, seconds(work, repeats=3), error)
        for name, work in (("at once", whole), ("by bands", bands))
    ]


def spectral_rows(folder: Path) -> list[dict[str, object]]:
    """Return a row for each spacing, ours and colour-science's, both against the sum over every nm."""
    import colour

    rows: list[dict[str, object]] = []
    fine = np.arange(360.0, 831.0)
    shape = sized((100, 100), (8, 8))
    spectra = bumps(fine, shape)
    spectra *= 1 + 0.3 * np.sin(fine / 7.0)  # a lamp's lines and a filter's edges, some 44 nm from one to the next
    picture = read_spectral(save_exr(folder / "fine.exr", spectra, fine))
    aim = spectral_to_xyz(picture).xyz.astype(np.float64)
    cmfs = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    for spacing in SPACINGS_NM:
        waves = fine[::spacing]
        path = save_exr(folder / f"{spacing}.exr", spectra[..., ::spacing], waves)
        ours = partial(lambda file: spectral_to_xyz(read_spectral(file)).xyz, path)
        values = spectra[..., ::spacing].astype(np.float32)
        flat = colour.MultiSpectralDistributions(values.reshape(-1, len(waves)).T, waves)
        theirs = partial(
            colour.msds_to_XYZ, flat, cmfs=cmfs, illuminant=colour.sd_ones(cmfs.shape), method="Integration", k=683.0
        )
        # colour-science gives hundredths of what k asks for
        for series, work, scale in (("spectra to XYZ", ours, 1.0), ("colour-science", theirs, 100.0)):
            found = scale * np.asarray(work(), dtype=np.float64).reshape(*shape, 3)
            error = float((np.abs(found - aim).max(axis=-1) / aim[..., 1]).max())
            taken = seconds(work, repeats=3)
            rows.append(row(series, f"every {spacing} nm", taken, error))
    return rows


def development() -> dict[str, object]:
    """Return the rows."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rows = develop_rows(folder, "sparkles", sparkling(DEVELOPED_PX))
        rows += develop_rows(folder, "zone plate", zone_plate(DEVELOPED_PX))
        for sigma_px in sized((0.6, 1.0, 1.5), (1.0,)):
            rows += light_rows(folder, f"sparkles of {sigma_px:g} px, shown", sparkling(DEVELOPED_PX, sigma_px))
        rows += light_rows(folder, "zone plate, shown", zone_plate(DEVELOPED_PX))
        rows += [*band_rows(), *spectral_rows(folder)]
    whole = [row for row in rows if row["series"] == "sparkles"]
    promises = [
        Promise("by bands against at once", worst(rows, series="malvar", parameter="bands"), 0.0, "error"),
        Promise(
            "XYZ of spectra every 5 nm, a share of Y",
            worst(rows, series="spectra to XYZ", parameter="every 5 nm"),
            1e-3,
            "error",
        ),
        Promise(
            "spectra to XYZ beside colour-science, every 5 nm",
            times_as_fast(
                [row for row in rows if row["parameter"] == "every 5 nm"], "spectra to XYZ", "colour-science"
            ),
            1.0,
            "ratio",
            "at least",
            "×",
        ),
        Promise(
            "malvar's error beside LibRaw's",
            worst(whole, parameter="malvar") / worst(whole, parameter="LibRaw"),
            1.0,
            "share",
        ),
    ]
    return {"title": "Development and spectra", "rows": rows, "promises": promises}


BRACKET_PX = sized((384, 512), (48, 64))
SECONDS = [time[0] / time[1] for time in TIMES]
RELATIVE_TIMES = [time / SECONDS[0] for time in SECONDS]
NOISE = NoiseModel.of_electrons(FULL_E, READ_E)


def photographs() -> tuple[Floats, list[Floats]]:
    """Return the light (height, width, 3) at the shortest exposure, and values of each exposure in 14 bits."""
    light = np.stack([scene(*BRACKET_PX, seed=seed) for seed in range(3)], axis=-1)
    taken = [codes(record(light, time, seed)) for seed, time in enumerate(SECONDS)]
    return light * SECONDS[0], [(photograph.astype(np.float64) - 600) / SPAN for photograph in taken]


def hat(values: list[Floats]) -> Floats:
    """Return the mean weighed by a hat over the middle of the range [Debevec1997]."""
    weights = [np.maximum(0.5 - np.abs(value - 0.5), 1e-6) for value in values]
    above = sum(weight * value / time for weight, value, time in zip(weights, values, RELATIVE_TIMES, strict=False))
    return np.asarray(above / sum(weights))


def merged(values: list[Floats], noise: NoiseModel | None) -> Floats:
    """Return the merged light."""
    return merge_exposures(values, [value >= 1 for value in values], RELATIVE_TIMES[: len(values)], noise).value


def by_opencv(merge: Callable[..., NDArray[np.float32]], bytes_: list[NDArray[np.uint8]]) -> Floats:
    """Return OpenCV's light, in a unit of its own."""
    times = np.array(SECONDS[: len(bytes_)], np.float32)
    return np.asarray(merge(bytes_, times), dtype=np.float64)  # its response is linear


def cramer_rao_bound(light: Floats, seen: NDArray[np.bool_], count: int) -> float:
    """Return the Cramér-Rao bound on the root mean square relative error, of exposures that are not full."""
    information = np.zeros_like(light)
    for time in RELATIVE_TIMES[:count]:
        information += np.where(light * time < 1, time**2 / (NOISE.gain * light * time + NOISE.read**2), 0)
    return float(np.sqrt(np.mean(1 / (information * light**2)[seen & (light < 1)])))


def brackets() -> dict[str, object]:
    """Return the rows."""
    light, all_values = photographs()
    seen = all_values[0] < 1
    coarse = NoiseModel(NOISE.gain, float(np.hypot(NOISE.read, 1 / 255 / np.sqrt(12))))
    rows: list[dict[str, object]] = []
    of_bound: list[float] = []
    for count in (1, 2, 4, 6):
        values = all_values[:count]
        bytes_ = [np.clip(np.rint(value * 255), 0, 255).astype(np.uint8) for value in values]
        work: dict[str, Callable[[], Floats]] = {
            "ours, 14 bits": partial(merged, values, NOISE),
            "ours, photon noise alone, 14 bits": partial(merged, values, None),
            "hat weights, 14 bits": partial(hat, values),
            "ours, 8 bits": partial(merged, [part / 255.0 for part in bytes_], coarse),
            "OpenCV Debevec, 8 bits": partial(by_opencv, cv2.createMergeDebevec().process, bytes_),
            "OpenCV Robertson, 8 bits": partial(by_opencv, cv2.createMergeRobertson().process, bytes_),
        }
        for name, make in work.items():
            relative = (make() / light)[seen]
            if "OpenCV" in name:
                relative = relative / np.median(relative)
            error = float(np.sqrt(np.mean((relative - 1) ** 2)))
            note = f"median error {100 * np.median(np.abs(relative - 1)):.2g} %"
            note += f", mean off by {100 * (relative.mean() - 1):+.2g} %"
            if name == "ours, 14 bits":
                least = cramer_rao_bound(light, seen, count)
                of_bound.append(error / least)
                note += f"; the Cramér-Rao bound is {least:.4g}"
            exposures = f"{count} exposure{'s' if count > 1 else ''}"
            row = {"series": name, "parameter": exposures, "error": error, "note": note}
            rows.append({**row, "seconds": seconds(make, repeats=3)})
    promise = Promise("error beside the Cramér-Rao bound, 1 to 6 exposures", max(of_bound), 1.05, "error", unit="×")
    return {"title": "Bracketed photographs", "rows": rows, "promises": [promise]}


CHART_SMALLER = sized(1, 4)
CHART_CORNERS = np.array([[480.0, 360.0], [2480.0, 520.0], [2360.0, 1820.0], [380.0, 1640.0]]) / CHART_SMALLER


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


def camera_fits() -> dict[str, object]:
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
                row(
                    f"ours, {label}",
                    loss,
                    seconds(lambda seen=seen, loss=loss: fit_camera(seen, "linear", loss), repeats=5),
                    held.mean,
                    note=f"largest {held.max:.2f}; {len(found.left_out)} left out; each patch judged by the others",
                )
            )
        for peer, fit in (("colour-science", colour_science), ("Expression 4.8", normal_equations)):
            good = np.arange(24) != 11 if seen is spoilt else np.ones(24, dtype=bool)
            # Judged on the patches that are what they were measured to be.
            error = left_out_by(fit, seen.rgb, XYZ) if good.all() else _on(fit(seen.rgb, XYZ), rgb[good], XYZ[good])
            rows.append(
                row(
                    f"{peer}, {label}",
                    "matrix alone",
                    seconds(lambda seen=seen, fit=fit: fit(seen.rgb, XYZ), repeats=5),
                    error,
                    note="left out one by one" if good.all() else "on the 23 others; nothing is left out",
                )
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
    x, y = np.meshgrid(np.arange(3000 // CHART_SMALLER) + 0.5, np.arange(2000 // CHART_SMALLER) + 0.5)
    at = project(
        np.asarray(np.linalg.inv(perspective(COLORCHECKER.outline(), CHART_CORNERS))), np.stack([x, y], axis=-1)
    )
    cell, within = np.divmod(at, 1 + COLORCHECKER.gap)
    on_patch = np.all((within < 1) & (cell >= 0) & (cell < [6, 4]), axis=-1)
    number = np.clip(cell[..., 1] * 6 + cell[..., 0], 0, 23).astype(int)
    on_card = np.all((at > -0.5) & (at < np.array(COLORCHECKER.size) + 0.5), axis=-1)
    picture = np.where(on_patch[..., None], rgb[number], np.where(on_card[..., None], 0.01, 0.12)).astype(np.float32)
    picture += 0.003 * np.random.default_rng(1).standard_normal(picture.shape, dtype=np.float32)
    found, taken = answer_and_seconds(lambda: find_corners(picture), repeats=3)
    off = float(np.abs(found - CHART_CORNERS).max())
    return row("chart found", "6 megapixels", taken, off, note="error in pixels, of patches some 290 pixels wide")


REGION_SMALLER = sized(1, 8)
SHAPE = (1600 // REGION_SMALLER, 2400 // REGION_SMALLER, 3)
REGION_CORNERS = np.array([[410.3, 310.7], [1700.2, 350.4], [1660.8, 1180.1], [380.6, 1120.9]]) / REGION_SMALLER
WHITE = np.array([96.42, 100.0, 82.49])
REGIONS = sized(1000, 20)


def falling_light() -> NDArray[np.float32]:
    """Light that falls off by a third, with noise, in float32."""
    rng = np.random.default_rng(0)
    falling = np.linspace(60, 40, SHAPE[1])[:, None]
    return (falling * (WHITE / 100) * (1 + 0.02 * rng.standard_normal(SHAPE))).astype(np.float32)


def whole_masks(light: NDArray[np.float32], quadrangles: Floats, kind: type[np.floating]) -> Floats:
    """Return the means by masks as large as the picture, summed in ``kind``."""
    whole = slice(0, SHAPE[0]), slice(0, SHAPE[1])
    found = []
    for one in quadrangles:
        values = light[inside(one, *whole)].astype(kind)
        found.append(values.sum(axis=0, dtype=kind) / kind(len(values)))
    return np.array(found)


def means_by_opencv(light: NDArray[np.float32], quadrangles: Floats) -> Floats:
    """Return the means by OpenCV."""
    import cv2

    means = []
    for one in quadrangles:
        mask = np.zeros(SHAPE[:2], dtype=np.uint8)
        cv2.fillPoly(mask, [np.round(one - 0.5).astype(np.int32)], 255)
        means.append(cv2.mean(light, mask)[:3])
    return np.array(means)


def one_pass(light: NDArray[np.float32], quadrangles: Floats) -> tuple[AreaMean, ...]:
    """Return the means in one pass over the rows that hold the chart."""
    return area_means(light, [(str(number), one) for number, one in enumerate(quadrangles)])


def regions() -> dict[str, object]:
    """Time each; the error is the largest relative one of a mean, against long double over the same pixels."""
    light = falling_light()
    quadrangles = patch_quadrangles(REGION_CORNERS)
    exact = []
    for one in quadrangles:
        at = window(one, SHAPE)
        exact.append(light[at][inside(one, *at)].astype(np.longdouble).mean(axis=0).astype(np.float64))
    ways: list[tuple[str, str, Callable[[], Floats]]] = [
        (
            "one pass, with standard errors",
            "as shipped",
            lambda: np.array([one.XYZ for one in one_pass(light, quadrangles)]),
        ),
        ("whole masks", "float64", lambda: whole_masks(light, quadrangles, np.float64)),
        ("whole masks", "float32", lambda: whole_masks(light, quadrangles, np.float32)),
        ("OpenCV fillPoly and mean", "corners rounded", lambda: means_by_opencv(light, quadrangles)),
    ]
    rows: list[dict[str, object]] = []
    for series, parameter, way in ways:
        error = float(np.max(np.abs(way() / exact - 1)))
        rows.append(row(series, parameter, seconds(way, repeats=3, at_least_s=0), error))
    for line, (_, _, way) in zip(rows[1:], ways[1:], strict=True):
        line["note"] = f"{times_faster(ways[0][2], way, rounds=5):.2g} × as long as one pass, timed in turn"
    ratio = times_faster(ways[0][2], ways[3][2], rounds=5)
    promises = [
        Promise("relative error of a mean", worst(rows, series="one pass"), 1e-14, "error"),
        Promise("beside OpenCV's fillPoly and mean", ratio, None, "ratio", "at least", "×"),
    ]
    title = f"Means of 24 patches in {SHAPE[1]} × {SHAPE[0]} pixels"
    return {"title": title, "rows": rows + _tables(), "promises": promises}


def _tables() -> list[dict[str, object]]:
    rng = np.random.default_rng(1)
    regions = [PairedArea(str(n), "cell", np.zeros((4, 2)), np.zeros((4, 2)), "g") for n in range(REGIONS)]
    photo = [AreaMean(400, colour, np.ones(3), 1e-4 * np.eye(3), 0.0) for colour in rng.uniform(5, 80, (REGIONS, 3))]
    rendering = [AreaMean(400, one.XYZ * 1.03, np.ones(3), 1e-4 * np.eye(3), 0.0) for one in photo]

    def each() -> list[float]:
        return [
            region_table([one], [first], [second], WHITE).rows[0].delta_e
            for one, first, second in zip(regions, photo, rendering, strict=True)
        ]

    at_once = partial(region_table, regions, photo, rendering, WHITE)
    apart = np.max(np.abs(np.array([row.delta_e for row in at_once().rows]) - each()))
    return [
        row(f"table of {REGIONS} regions", name, seconds(way, repeats=1, at_least_s=0), error)
        for name, way, error in (("all at once", at_once, float(apart)), ("one by one", each, 0.0))
    ]


Picture = NDArray[np.float32]
Way = Callable[[Picture], NDArray[np.floating]]

PITCH_MM = 0.2768
# Of a plate of 150 × 100 mm what fills whole display pixels.
PLATE_SMALLER = sized(1, 4)
WIDE, HIGH = (
    (2190 // PLATE_SMALLER, 542 // PLATE_SMALLER * PITCH_MM),
    (1460 // PLATE_SMALLER, 361 // PLATE_SMALLER * PITCH_MM),
)
HIGHEST = 1.9  # cycles per display pixel


def ways_to_resample() -> dict[tuple[str, str], Way]:
    """Return ways to resample a picture, by series and parameter."""
    import cv2
    from PIL import Image

    found: dict[tuple[str, str], Way] = {}
    shape = (0, 0)
    filters: tuple[Filter, ...] = ("area", "linear", "cubic")
    for name in filters:
        columns, rows = (axis_weights(*axis, PITCH_MM, name) for axis in (WIDE, HIGH))
        shape = (columns.shape[0], rows.shape[0])
        found["ours", name] = partial(resample, rows=rows, columns=columns)
    for name, flag in (("INTER_AREA", cv2.INTER_AREA), ("INTER_LINEAR", cv2.INTER_LINEAR)):
        found["OpenCV", name] = lambda picture, flag=flag: cv2.resize(picture, shape, interpolation=flag)
    for name, kind in (("bicubic", Image.Resampling.BICUBIC), ("Lanczos", Image.Resampling.LANCZOS)):
        found["Pillow", name] = lambda picture, kind=kind: np.asarray(Image.fromarray(picture).resize(shape, kind))
    return found


def chirp() -> tuple[Picture, Floats]:
    """Return a picture whose frequency rises along its rows, and that of each display pixel, in cycles per pixel."""
    display = round(WIDE[1] / PITCH_MM)
    place = (np.arange(WIDE[0]) + 0.5) / WIDE[0]
    line = 1 + np.cos(np.pi * HIGHEST * display * place**2)
    shown = (np.arange(display) + 0.5) / display
    return np.repeat(line[None], HIGH[0], axis=0).astype(np.float32), HIGHEST * shown


def sparkling_plate() -> Picture:
    """Return a plate of 10 cd/m² with sparkles thirty times as bright, spread over a camera pixel."""
    from scipy.ndimage import gaussian_filter

    random = np.random.default_rng(4)
    points = np.zeros((HIGH[0], WIDE[0]))
    points[random.integers(0, HIGH[0], 1500), random.integers(0, WIDE[0], 1500)] = 290 * 2 * np.pi
    return (10 + gaussian_filter(points, 1.0)).astype(np.float32)


def aliasing(way: Way, plate: Picture, wave: Picture, frequency: Floats) -> tuple[float, str]:
    """Return the aliasing, and the rest in words."""
    seen = way(wave)[HIGH[0] // 8].astype(np.float64) - 1
    above = np.flatnonzero((frequency > 0.55) & (np.arange(len(frequency)) < len(frequency) - 8))
    below = np.flatnonzero((frequency > 0.02) & (frequency < 0.45))
    alias = float(np.sqrt(2 * np.mean(seen[above] ** 2)))
    passed = float(np.sqrt(2 * np.mean(seen[below] ** 2)))
    small = way(plate).astype(np.float64)
    light = float(small.mean() / plate.mean(dtype=np.float64)) - 1
    peak = float(np.percentile(small, 99.9) - 10) / float(np.percentile(plate, 99.9) - 10)
    return alias, (
        f"{100 * passed:.0f} % passes below Nyquist; least luminance {small.min():.2f} of 10 cd/m²; "
        f"light {100 * light:+.4f} %; bright pixels keep {100 * peak:.0f} %"
    )


def resampling() -> dict[str, object]:
    """Resample chirp and sparkles each way."""
    wave, frequency = chirp()
    plate = sparkling_plate()
    rows: list[Row] = []
    for (series, parameter), way in ways_to_resample().items():
        alias, note = aliasing(way, plate, wave, frequency)
        time_s = seconds(partial(way, plate), repeats=5)
        rows.append(row(series, parameter, time_s, alias, note=note))
    promises = [
        Promise("aliasing by linear B-splines", worst(rows, series="ours", parameter="linear"), 0.12, "error"),
        Promise("aliasing by cubic B-splines", worst(rows, series="ours", parameter="cubic"), 0.04, "error"),
        Promise(
            "areas, aliasing beside OpenCV's INTER_AREA",
            worst(rows, series="ours", parameter="area") - worst(rows, series="OpenCV", parameter="INTER_AREA"),
            1e-3,
            "error",
        ),
    ]
    return {
        "title": "Photograph to display pixels, one channel: time against aliasing",
        "rows": rows,
        "promises": promises,
    }


if __name__ == "__main__":
    program("photographs", development, brackets, camera_fits, regions, resampling)
