"""Measures of two pictures: run time and error of each, its reference implementation beside it in the same run.

The reference is given the whole picture, prepared as it asks; ours starts from XYZ and reads bands of rows. The error
is the largest of a pixel of the map against the reference, or the difference of the values where it has no map.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib.util import find_spec

import numpy as np
from curves import program, seconds, sized
from numpy.typing import NDArray
from promises import Promise, worst

from devices.colour import linear_srgb_matrix, xyz_to_lab
from extensions.measures import kernels_1996, pu21_encoded
from extensions.measures.scielab_1996 import OPPONENT_FROM_XYZ
from stimuli.measures import ViewingConditions, measure_named

SIZE_PX = sized((768, 1024), (96, 128))
PIXELS_PER_DEGREE = 45.0
WHITE = np.array([95.0, 100.0, 108.9])
Map = NDArray[np.floating]

# How far each measure may be from its reference implementation.
PROMISED = (
    ("flip", "flip-evaluator", 1e-6),
    ("hdr-flip", "flip-evaluator", 1e-6),
    ("pu-ssim", "scikit-image", 1e-6),
    ("pu-psnr", "scikit-image", 1e-6),
    ("s-cielab-1996", "rows and columns in turn (SciPy)", 1e-5),
)


def pictures() -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Blocks of colour with grain, and the same with other grain."""
    rng = np.random.default_rng(0)
    blocks = np.kron(rng.uniform(1.0, 110.0, (SIZE_PX[0] // 16, SIZE_PX[1] // 16, 3)), np.ones((16, 16, 1)))
    reference = (blocks * rng.uniform(0.9, 1.1, (*SIZE_PX, 1))).astype(np.float32)
    return reference, (reference * rng.normal(1.0, 0.04, reference.shape)).clip(0).astype(np.float32)


def peers(
    reference: NDArray[np.float32], test: NDArray[np.float32]
) -> list[tuple[str, str, Callable[[], Map | float]]]:
    """Return the measure, the peer's name and its work."""
    import colour
    from skimage.metrics import peak_signal_noise_ratio, structural_similarity

    def delta_e() -> Map:
        xy = WHITE[:2] / WHITE.sum()
        labs = (colour.XYZ_to_Lab(picture.astype(np.float64) / WHITE[1], xy) for picture in (reference, test))
        return np.asarray(colour.delta_E(*labs, method="CIE 2000"))

    linear = [np.maximum(one @ linear_srgb_matrix(WHITE).T, 0).astype(np.float32) for one in (reference, test)]
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
                plane, total = opponent[..., channel], np.zeros(SIZE_PX)
                for kernel in kernels:
                    total += convolve1d(convolve1d(plane, kernel, axis=1), np.abs(kernel), axis=0)
                opponent[..., channel] = total
            seen.append(xyz_to_lab(opponent @ np.linalg.inv(OPPONENT_FROM_XYZ).T, WHITE))
        return np.asarray(np.linalg.norm(seen[0] - seen[1], axis=-1))

    found.append(("s-cielab-1996", "rows and columns in turn (SciPy)", scielab_1996))
    return [*found, ("pu-ssim", "scikit-image", ssim), ("pu-psnr", "scikit-image", psnr)]


def run() -> dict[str, object]:
    """Time every measure and its peer; peers' errors are those of ours against them."""
    reference, test = pictures()
    viewing = ViewingConditions(PIXELS_PER_DEGREE, WHITE)
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
        rows.append({"series": "ours", "parameter": f"{name}, against {peer}", "seconds": timed[name], "error": error})
        rows.append({"series": peer, "parameter": name, "seconds": seconds(work, repeats=3), "error": error})
    promises = [
        Promise(
            f"{name}, against {peer}", worst(rows, series="ours", parameter=f"{name}, against {peer}"), limit, "error"
        )
        for name, peer, limit in PROMISED
    ]
    return {
        "title": f"Measures of two pictures of {SIZE_PX[1]} × {SIZE_PX[0]} pixels",
        "rows": rows,
        "promises": promises,
    }


if __name__ == "__main__":
    program("measures", run)
