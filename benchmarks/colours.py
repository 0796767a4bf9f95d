"""Colours as people see them: differences, what the eye resolves, measures of two pictures, cones, and observers.

CIEDE2000 on a million colours: run time against error, colour-science beside it in the same run.

What the eye resolves of a picture: run time against error over how coarse the cells of wide blurs are.

The plain method beside it blurs every channel by every Gaussian at full size.

Measures of two pictures: run time and error of each, its reference implementation beside it in the same run.

The reference is given the whole picture, prepared as it asks; ours starts from XYZ and reads bands of rows. The error
is the largest of a pixel of the map against the reference, or the difference of the values where it has no map.

Light as the eye takes it: cone contrasts, adaptation to another white, and contrast sensitivity.

Time of a picture's pixels, or of a curve, and the largest error against colour-science or a plain way in the same run.

Observer metamerism: run time against error over the spacing of spectra and the number of persons.

Beside it colour-science computes the same differences person by person from the same functions.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np
from curves import program, row, seconds, sized, times_faster
from numpy.typing import NDArray
from promises import Promise, worst

from devices.colour import ciede2000, linear_srgb_matrix, white_point, xyz_to_lab
from devices.colour.ciede2000 import plain_terms
from devices.colour_matching import ColorimetricObserver, colorimetric_observer, dkl_from_xyz, lms_from_xyz, xyz_of_dkl
from devices.display import contrast_sensitivity
from devices.readings import xyz_from_spectra
from documents import at_most_threads
from documents.arrays import Floats
from extensions.colour_observers import ScreenSpectra, individual_observers, observer_metamerism
from extensions.measures import kernels_1996, pu21_encoded
from extensions.measures.scielab_1996 import OPPONENT_FROM_XYZ
from stimuli.measures import ViewingConditions, difference_map, measure_named, scielab
from stimuli.pictures import StereoImage
from stimuli.recipes.picture_steps import adapted
from stimuli.recipes.steps_spec import AdaptSpec
from tests.devices.colour.plain import plain_delta_e

COLOURS = sized(1_000_000, 20_000)
BLOCKS = sized((2048, 8192, 32768, 131072), (2048, 32768))


def delta_e() -> dict[str, object]:
    """Time all on the same colours; the error is the largest difference from colour-science in float64."""
    import colour

    rng = np.random.default_rng(0)
    first, second = (rng.uniform([0, -100, -100], [100, 100, 100], (COLOURS, 3)) for _ in range(2))
    first32, second32 = first.astype(np.float32), second.astype(np.float32)
    oracle = np.asarray(colour.delta_E(first, second, method="CIE 2000"))
    theirs = partial(colour.delta_E, first, second, method="CIE 2000")
    rows: list[dict[str, Any]] = [row("colour-science", "float64", seconds(theirs, repeats=3), 0.0)]
    usual = ciede2000._BLOCK
    try:
        for block in BLOCKS:
            ciede2000._BLOCK = block
            for one, other, stored in ((first, second, "float64"), (first32, second32, "float32")):
                ours = partial(ciede2000.delta_e_2000, one, other)
                error = float(np.abs(ours() - oracle).max())
                for threads in (1, 2) if block == usual else (2,):
                    shipped = ", as shipped" if block == usual else ""
                    with at_most_threads(threads):
                        rows.append(
                            row(
                                f"cyclopean, colours stored as {stored}, threads: {threads}",
                                f"{block:,} at a time{shipped}",
                                seconds(ours, repeats=3),
                                error,
                                ratio=(ratio := times_faster(ours, theirs, rounds=sized(5, 1))),
                                note=f"{ratio:.1f} × as fast as colour-science",
                            )
                        )
    finally:
        ciede2000._BLOCK = usual
    plain = partial(_plain_delta_e, first, second)
    error = float(np.abs(plain() - oracle).max())
    ratio = times_faster(plain, theirs, rounds=3)
    rows.append(
        row(
            "the paper's equations in whole arrays",
            "float64",
            seconds(plain, repeats=3),
            error,
            ratio=ratio,
            note=f"{ratio:.1f} × as fast as colour-science",
        )
    )
    with_terms = partial(ciede2000.delta_e_2000_parts, first, second)
    error = float(np.abs(with_terms().delta_e - oracle).max())
    taken = seconds(with_terms, repeats=3)
    rows.append(row("cyclopean, with all terms", "float64", taken, error))
    shipped = next(row for row in rows if "shipped" in row["parameter"] and "float64, threads: 2" in row["series"])
    promises = [
        Promise("largest difference from colour-science", shipped["error"], 1e-9, "error", unit="ΔE00"),
        Promise("beside colour-science, a million pairs", shipped["ratio"], 6.0, "ratio", "at least", "×"),
    ]
    return {"title": f"CIEDE2000 of {COLOURS:,} pairs of colours", "rows": rows, "promises": promises}


def _plain_delta_e(first: Floats, second: Floats) -> Floats:
    """The slow twin, a few colours at a time."""
    out = np.empty(len(first))
    for start in range(0, len(out), 8192):
        part = slice(start, start + 8192)
        planes = (np.ascontiguousarray(colours[part].T) for colours in (first, second))
        out[part] = plain_delta_e(*plain_terms(*planes))
    return out


SEEN_PX = sized((342, 512), (96, 128))
SEEN_PER_DEGREE = 178.0  # a camera's 146 pixels per centimetre, seen from 70 cm
SEEN_WHITE = np.array([96.42, 100.0, 82.49])


def every_gaussian(xyz: NDArray[np.float32]) -> NDArray[np.float64]:
    """Every Gaussian over every pixel, in float64, to eight standard deviations."""
    from scipy.ndimage import convolve1d
    from scipy.special import ndtr

    matrix = scielab.opponent_from_xyz(SEEN_WHITE)
    opponent = xyz.astype(np.float64) @ matrix.T
    seen = np.zeros_like(opponent)
    for channel, gaussians in enumerate(scielab.GAUSSIANS):
        total = sum(weight for weight, _ in gaussians)
        for weight, spread_deg in gaussians:
            sd = spread_deg * SEEN_PER_DEGREE / np.sqrt(2.0)
            reach = int(np.ceil(8.0 * sd))
            kernel = np.diff(ndtr((np.arange(-reach, reach + 2) - 0.5) / sd))
            blurred = convolve1d(opponent[..., channel], kernel, axis=0, mode="reflect")
            seen[..., channel] += weight / total * convolve1d(blurred, kernel, axis=1, mode="reflect")
    return np.asarray(seen @ np.linalg.inv(matrix).T)


def seen_difference() -> dict[str, object]:
    """Time both on one sparkling picture; the error is the largest, as ΔE00 against the plain outcome."""
    rng = np.random.default_rng(0)
    xyz = (rng.gamma(0.2, 20.0, (*SEEN_PX, 1)) * (SEEN_WHITE / 100.0)).astype(np.float32)
    exact = every_gaussian(xyz)
    rows: list[dict[str, object]] = [
        row("every Gaussian at full size", "float64", seconds(partial(every_gaussian, xyz), repeats=1), 0.0)
    ]
    usual = scielab.NARROWEST_CELLS
    try:
        for cells in (1.0, 1.5, 2.0, 2.5, 4.0, 8.0):
            scielab.NARROWEST_CELLS = cells

            def ours() -> NDArray[np.float32]:
                return scielab.SeenPicture(xyz, SEEN_PER_DEGREE, SEEN_WHITE)[:]

            rows.append(
                row(
                    "wide Gaussians in cells",
                    f"{cells:g} cells a standard deviation" + (" (as shipped)" if cells == usual else ""),
                    seconds(ours, repeats=3),
                    float(difference_map(ours(), exact, SEEN_WHITE, filtered=True).max()),
                )
            )
    finally:
        scielab.NARROWEST_CELLS = usual
    shipped = worst(rows, parameter="as shipped")
    promises = [Promise("largest ΔE00 from every Gaussian at full size", shipped, 0.001, "error")]
    return {"promises": promises, "title": f"What the eye resolves of {SEEN_PX[1]} × {SEEN_PX[0]} pixels", "rows": rows}


MEASURED_PX = sized((768, 1024), (96, 128))
PIXELS_PER_DEGREE = 45.0
MEASURED_WHITE = np.array([95.0, 100.0, 108.9])
Map = NDArray[np.floating]

# How far each measure may be from its reference implementation.
PROMISED = (
    ("flip", "flip-evaluator", 1e-6),
    ("hdr-flip", "flip-evaluator", 1e-6),
    ("pu-ssim", "scikit-image", 1e-6),
    ("pu-psnr", "scikit-image", 1e-6),
    ("s-cielab-1996", "rows and columns in turn (SciPy)", 1e-5),
)


def two_pictures() -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Blocks of colour with grain, and the same with other grain."""
    rng = np.random.default_rng(0)
    blocks = np.kron(rng.uniform(1.0, 110.0, (MEASURED_PX[0] // 16, MEASURED_PX[1] // 16, 3)), np.ones((16, 16, 1)))
    reference = (blocks * rng.uniform(0.9, 1.1, (*MEASURED_PX, 1))).astype(np.float32)
    return reference, (reference * rng.normal(1.0, 0.04, reference.shape)).clip(0).astype(np.float32)


def peers(
    reference: NDArray[np.float32], test: NDArray[np.float32]
) -> list[tuple[str, str, Callable[[], Map | float]]]:
    """Return the measure, the peer's name and its work."""
    import colour
    from skimage.metrics import peak_signal_noise_ratio, structural_similarity

    def delta_e() -> Map:
        xy = MEASURED_WHITE[:2] / MEASURED_WHITE.sum()
        labs = (colour.XYZ_to_Lab(picture.astype(np.float64) / MEASURED_WHITE[1], xy) for picture in (reference, test))
        return np.asarray(colour.delta_E(*labs, method="CIE 2000"))

    linear = [np.maximum(one @ linear_srgb_matrix(MEASURED_WHITE).T, 0).astype(np.float32) for one in (reference, test)]
    found: list[tuple[str, str, Callable[[], Map | float]]] = [("delta-e-2000", "colour-science", delta_e)]
    if find_spec("flip_evaluator"):
        from flip_evaluator import evaluate

        def flip(kind: str) -> Map:
            parameters = {"ppd": PIXELS_PER_DEGREE}
            errors = evaluate(*linear, kind, inputsRGB=False, applyMagma=False, parameters=parameters)[0]
            return np.asarray(errors[..., 0])

        found += [
            ("flip", "flip-evaluator", partial(flip, "LDR")),
            ("hdr-flip", "flip-evaluator", partial(flip, "HDR")),
        ]
        import OpenImageIO as oiio

        if hasattr(oiio.ImageBufAlgo, "FLIP_diff"):
            buffers = [oiio.ImageBuf(np.clip(one, 0, 1)) for one in linear]
            for buffer in buffers:
                buffer.specmod().attribute("oiio:ColorSpace", "lin_rec709")

            def openimageio() -> Map:
                errors = oiio.ImageBufAlgo.FLIP_diff(*buffers, hdr=0, ppd=PIXELS_PER_DEGREE)
                return np.asarray(errors.get_pixels(oiio.FLOAT)[..., 0])

            found.append(("flip", "OpenImageIO (experimental)", openimageio))

    def encoded() -> list[NDArray[np.float64]]:
        return [pu21_encoded(picture[..., 1]) for picture in (reference, test)]

    def ssim() -> float:
        weights = {"gaussian_weights": True, "sigma": 1.5, "use_sample_covariance": False}
        return float(structural_similarity(*encoded(), data_range=256, **weights))

    def psnr() -> float:
        return float(peak_signal_noise_ratio(*encoded(), data_range=256))

    def scielab_1996() -> Map:
        """Return the map of the whole picture, rows and columns in turn, as the authors' code does it."""
        from scipy.ndimage import convolve1d

        seen = []
        for picture in (reference, test):
            opponent = picture.astype(np.float64) @ OPPONENT_FROM_XYZ.T
            for channel, kernels in enumerate(kernels_1996(PIXELS_PER_DEGREE)):
                plane, total = opponent[..., channel], np.zeros(MEASURED_PX)
                for kernel in kernels:
                    total += convolve1d(convolve1d(plane, kernel, axis=1), np.abs(kernel), axis=0)
                opponent[..., channel] = total
            seen.append(xyz_to_lab(opponent @ np.linalg.inv(OPPONENT_FROM_XYZ).T, MEASURED_WHITE))
        return np.asarray(np.linalg.norm(seen[0] - seen[1], axis=-1))

    found.append(("s-cielab-1996", "rows and columns in turn (SciPy)", scielab_1996))
    return [*found, ("pu-ssim", "scikit-image", ssim), ("pu-psnr", "scikit-image", psnr)]


def measures() -> dict[str, object]:
    """Time every measure and its peer; peers' errors are those of ours against them."""
    reference, test = two_pictures()
    viewing = ViewingConditions(PIXELS_PER_DEGREE, MEASURED_WHITE)
    rows: list[dict[str, object]] = []
    timed: dict[str, float] = {}
    for name, peer, work in peers(reference, test):
        ours = partial(measure_named(name).measure, reference, test, viewing)
        found, theirs = ours(), work()
        if isinstance(theirs, float):
            error = abs(found.value - theirs)
        else:
            assert found.error_map is not None
            error = float(np.abs(found.error_map - theirs).max())
        if name not in timed:
            timed[name] = seconds(ours, repeats=3)
        rows.append(row("ours", f"{name}, against {peer}", timed[name], error))
        rows.append(row(peer, name, seconds(work, repeats=3), error))
    promises = [
        Promise(
            f"{name}, against {peer}", worst(rows, series="ours", parameter=f"{name}, against {peer}"), limit, "error"
        )
        for name, peer, limit in PROMISED
    ]
    return {
        "title": f"Measures of two pictures of {MEASURED_PX[1]} × {MEASURED_PX[0]} pixels",
        "rows": rows,
        "promises": promises,
    }


def vision() -> dict[str, object]:
    """Time each part and its peer."""
    from colour.adaptation import chromatic_adaptation_VonKries
    from colour.contrast import contrast_sensitivity_function_Barten1999, pupil_diameter_Barten1999
    from colour.contrast.barten1999 import retinal_illuminance_Barten1999, sigma_Barten1999

    grey = white_point("d65", 50.0)
    light = np.random.default_rng(1).uniform(0.5, 1.5, (*sized((768, 1024), (96, 128)), 3)).astype(
        np.float32
    ) * grey.astype(np.float32)
    image, spec = StereoImage.flat(light), AdaptSpec(from_white="a", to_white="d65")
    whites = white_point("a", 1.0), white_point("d65", 1.0)
    frequencies = np.geomspace(0.1, 60.0, 1000)

    def barten() -> Floats:
        pupil = pupil_diameter_Barten1999(100.0, 10.0, 10.0)
        blur = sigma_Barten1999(0.5 / 60, 0.08 / 60, pupil)
        trolands = retinal_illuminance_Barten1999(100.0, pupil, True)
        return np.asarray(contrast_sensitivity_function_Barten1999(frequencies, sigma=blur, X_0=10.0, E=trolands))

    def cones_one_by_one() -> Floats:
        long, middle, short = (light.astype(np.float64) @ row for row in lms_from_xyz())
        one, two, three = lms_from_xyz() @ grey
        share = one / (one + two)
        brighter = share * (long / one - 1) + (1 - share) * (middle / two - 1)
        red = np.hypot(share, 1 - share) * (long / one - middle / two)
        return np.stack([np.sqrt(3) * brighter, red, short / three - 1 - brighter], axis=-1)

    works: list[tuple[str, Callable[[], Floats], str, Callable[[], Floats]]] = [
        (
            "adapt by CAT16, 0.8 megapixels",
            lambda: adapted(image, spec)[0].left,
            "colour-science",
            lambda: chromatic_adaptation_VonKries(light.astype(np.float64), *whites, transform="CAT16"),
        ),
        ("DKL, 0.8 megapixels", lambda: dkl_from_xyz(light, grey), "cone by cone (NumPy)", cones_one_by_one),
        ("DKL and back", lambda: xyz_of_dkl(dkl_from_xyz(light, grey), grey), "nothing done", lambda: light),
        (
            "contrast sensitivity, 1000 frequencies",
            lambda: contrast_sensitivity(frequencies, 100.0),
            "colour-science",
            barten,
        ),
    ]
    rows: list[dict[str, object]] = []
    for what, ours, peer, theirs in works:
        found, expected = ours(), theirs()
        error = float(np.max(np.abs(found - expected)) / np.max(np.abs(expected)))
        rows.append(row("ours", what, seconds(ours, repeats=5), error))
        rows.append(row(peer, what, seconds(theirs, repeats=5), error))
    promises = [Promise("largest relative difference from the peers", worst(rows), 1e-6, "error")]
    return {"promises": promises, "title": "Cone contrasts, adaptation and contrast sensitivity", "rows": rows}


FINE = np.arange(390.0, 781.0)
PERSONS, THEIRS, REFERENCE = sized(((10, 100, 1000), 10, 4000), ((10,), 2, 50))
SPACINGS = (1, 5, 10, 20)


def _bump(waves: np.ndarray, middle_nm: float, width_nm: float) -> np.ndarray:
    return np.asarray(np.exp(-(((waves - middle_nm) / width_nm) ** 2)))


def _paint(waves: np.ndarray) -> np.ndarray:
    return np.asarray(0.04 + 0.35 * _bump(waves, 465, 45) + 0.25 / (1 + np.exp((690 - waves) / 10)))


def _screen(waves: np.ndarray) -> ScreenSpectra:
    primaries = np.stack([_bump(waves, middle, 18) for middle in (628, 532, 458)])
    return ScreenSpectra(waves, np.zeros(len(waves)), 0.01 * primaries)


def _theirs(persons: tuple[ColorimetricObserver, ...], lamp: np.ndarray, shown: np.ndarray) -> list[float]:
    from colour.colorimetry import MultiSpectralDistributions, SpectralDistribution, sd_to_XYZ_integration
    from colour.difference import delta_E_CIE2000
    from colour.models import XYZ_to_Lab, XYZ_to_xy

    ends = np.ones(len(FINE))
    ends[[0, -1]] = 0.5
    found = []
    for person in persons:
        cmfs = MultiSpectralDistributions(dict(zip(FINE, person.functions_at(FINE), strict=True)))
        white, asked, got = (
            sd_to_XYZ_integration(SpectralDistribution(dict(zip(FINE, light * ends, strict=True))), cmfs, k=683.0)
            for light in (lamp, lamp * _paint(FINE), shown)
        )
        labs = [XYZ_to_Lab(xyz / white[1], XYZ_to_xy(white)) for xyz in (asked, got)]
        found.append(float(delta_E_CIE2000(labs[0], labs[1])))
    return found


def metamerism() -> dict[str, object]:
    """Time drawing persons, their differences and colour-science's; errors are in ΔE00 or shares of white."""
    match, lamp = colorimetric_observer("CIE 1931 2"), np.ones(len(FINE))
    everyone = individual_observers(REFERENCE, 10.0, seed=2)
    rows: list[dict[str, object]] = []

    def differences(persons: tuple[ColorimetricObserver, ...]) -> np.ndarray:
        paint = {"paint": _paint(FINE)}
        found = observer_metamerism(paint, lamp, FINE, _screen(FINE), persons, matched_for=match)
        return np.asarray(found.delta_e_00[0])

    reference = float(np.percentile(differences(everyone), 95))
    for count in PERSONS:
        persons = individual_observers(count, 10.0, seed=1)
        error = abs(float(np.percentile(differences(persons), 95)) - reference)
        rows += [
            row("persons drawn", str(count), seconds(partial(individual_observers, count, 10.0), repeats=1), 0.0),
            row(
                f"their differences; error of the 95th percentile against {REFERENCE} others",
                str(count),
                seconds(partial(differences, persons), repeats=3),
                error,
            ),
        ]
    few = individual_observers(THEIRS, 10.0, seed=1)
    whole = observer_metamerism({"paint": _paint(FINE)}, lamp, FINE, _screen(FINE), few, matched_for=match)
    light = lamp * whole.white_luminance_cd_m2 / (match.efficacy_lm_W * np.trapezoid(match.functions_at(FINE)[:, 1]))
    shown = whole.drive[0] @ _screen(FINE).primaries
    theirs = np.array(_theirs(few, light, shown))
    taken = seconds(partial(_theirs, few, light, shown), repeats=1)
    error = float(np.abs(theirs - whole.delta_e_00[0]).max())
    rows.append(row("colour-science", str(THEIRS), taken, error))
    rng = np.random.default_rng(1)
    middles, widths = rng.uniform(430, 650, (200, 3, 1)), rng.uniform(12, 60, (200, 3, 1))
    for spacing in SPACINGS:
        waves = np.arange(390.0, 781.0, spacing)
        whole_light = np.exp(-(((FINE - middles) / widths) ** 2)).sum(axis=1)
        part = np.exp(-(((waves - middles) / widths) ** 2)).sum(axis=1)
        true, ours = (
            xyz_from_spectra(whole_light, FINE, "CIE 2015 10"),
            partial(xyz_from_spectra, part, waves, "CIE 2015 10"),
        )
        off = np.abs(ours() - true).max(axis=1) / true[:, 1]
        rows.append(
            row(
                "XYZ of 200 spectra of three peaks; error: 95th percentile, share of Y",
                f"{spacing} nm",
                seconds(ours, repeats=3),
                float(np.percentile(off, 95)),
            )
        )
    promises = [
        Promise("a person's ΔE00 against colour-science", worst(rows, series="colour-science"), 1e-5, "error"),
        Promise(
            "XYZ of spectra every 5 nm, a share of Y", worst(rows, series="XYZ of", parameter="5 nm"), 0.02, "error"
        ),
    ]
    return {"title": "Observer metamerism of a paint beside a screen", "rows": rows, "promises": promises}


if __name__ == "__main__":
    program("colours", delta_e, seen_difference, measures, vision, metamerism)
