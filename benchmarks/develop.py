"""Photographs to linear camera RGB, and spectra to XYZ: run time against error.

A sensor of known levels and noise-free values photographs a plate of small coloured sparkles, spread by a lens of
1 pixel standard deviation, and a zone plate. The error of a development is the root mean square over the picture, in
shares of full scale; the note says how far its mean light is off. The peer is LibRaw by itself, asked for linear camera
RGB. Then the same light as XYZ on a display with a quarter of the pixels, and its sparkles counted: the error is that
of luminance, root mean square over the mean. Spectra are summed at coarser and coarser spacing, beside colour-science.
"""

from __future__ import annotations

import sys
import tempfile
from functools import partial
from pathlib import Path

import numpy as np
from curves import program, seconds, sized
from numpy.typing import NDArray
from promises import Promise, times_as_fast, worst

from stimuli.develop.camera_image import CameraImage
from stimuli.develop.demosaic import RGB, Mosaic, by_bands, interpolate
from stimuli.develop.raw_files import DEMOSAICS, read_raw
from stimuli.sparkles.find import SparkleThreshold
from stimuli.sparkles.measure import measure_sparkles
from stimuli.spectral.bands import read_spectral
from stimuli.spectral.convert import spectral_to_xyz

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests.stimuli.develop.dng import write_dng
from tests.stimuli.spectral.pictures import bumps, save_exr

SIDE_PX = sized(512, 64)
BLACK, WHITE = 600, 15520
BALANCE = np.array([0.45, 0.9, 0.6])  # a sensor that sees least red, as most do in tungsten light
SPACINGS_NM = sized((1, 2, 5, 10, 20), (5, 10))
# A camera's matrix in cd/m² for balanced channels of full scale; its colours mix, and some XYZ come out below 0.
MATRIX = np.array([[220.0, 37.0, 3.0], [84.0, 146.0, -46.0], [12.0, -35.0, 220.0]]) / BALANCE
SHOWN = 4


def sparkles(side_px: int, sigma_px: float = 1.0, seed: int = 0) -> NDArray[np.float64]:
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
    write = partial(write_dng, rgb=truth, black=(BLACK,), white=WHITE)
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
        rows.append({"series": name, "parameter": method, "seconds": taken, "error": error, "note": note})
    return rows


def _shares(off: NDArray[np.float64], aim: NDArray[np.float64]) -> str:
    return " ".join(f"{100 * share:+.2f}" for share in off.mean(axis=(0, 1)) / aim.mean(axis=(0, 1))) + " %"


def light_rows(folder: Path, name: str, truth: NDArray[np.float64]) -> list[dict[str, object]]:
    """Return a row for each demosaicing: error of the luminance shown, mean XYZ, and sparkles beside those drawn."""
    path = write_dng(folder / "light.dng", truth, black=(BLACK,), white=WHITE, neutral=tuple(BALANCE / BALANCE.max()))
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
        rows.append({"series": name, "parameter": method, "seconds": taken, "error": error, "note": note})
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
        {"series": "4 megapixels, malvar", "parameter": name, "seconds": seconds(work, repeats=3), "error": error}
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
            rows.append({"series": series, "parameter": f"every {spacing} nm", "seconds": taken, "error": error})
    return rows


def run() -> dict[str, object]:
    """Return the rows."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rows = develop_rows(folder, "sparkles", sparkles(SIDE_PX))
        rows += develop_rows(folder, "zone plate", zone_plate(SIDE_PX))
        for sigma_px in sized((0.6, 1.0, 1.5), (1.0,)):
            rows += light_rows(folder, f"sparkles of {sigma_px:g} px, shown", sparkles(SIDE_PX, sigma_px))
        rows += light_rows(folder, "zone plate, shown", zone_plate(SIDE_PX))
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


if __name__ == "__main__":
    program("develop", run)
