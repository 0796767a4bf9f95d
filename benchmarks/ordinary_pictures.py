"""Pairs of JPEG of 2 megapixels to stimuli, beside decoding them, and sRGB to XYZ beside colour-science.

`stimuli build` reads, decodes, makes statistics of XYZ, and keeps the files as they are, hashed. Decoding is what
OpenImageIO and Pillow take for the same files, in one thread, in the same run. The error is the largest relative
difference from colour-science's decoding of sRGB in double precision. The command builds in two threads on two cores,
which is promised; processor time stands beside that of the clock, which other work changes more. A pair is then loaded,
from its own files and from codes as they are kept of other formats: the price of the smaller cache, paid in a thread
while another picture is shown.
"""

from __future__ import annotations

import io
import os
import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from statistics import median
from time import perf_counter, process_time
from typing import Any

import colour
import numpy as np
import OpenImageIO as oiio
from curves import Row, program, sized
from numpy.typing import NDArray
from PIL import Image
from promises import Promise, worst

from stimuli.build import build_set
from stimuli.pictures.coded import CodedPicture, decoded, read_coded
from stimuli.pictures.colour_spaces import named_encoding

SIZE = sized((1700, 1200), (170, 120))
WHITE = 100.0


def scene(seed: int) -> NDArray[np.uint8]:
    """Return a picture of shadings, edges and noise, about as large as a photograph once it is JPEG."""
    rng = np.random.default_rng(seed)
    width, height = SIZE
    y, x = np.mgrid[:height, :width].astype(np.float32)
    shade = np.stack([np.sin(x / 170 + k) + np.cos(y / (130 + 20 * k)) for k in range(3)], axis=-1) * 50 + 120
    boxes = 30 * ((x // 90 + y // 70) % 2)[..., None]
    return np.clip(shade + boxes + rng.normal(0, 5, (height, width, 1)), 0, 255).astype(np.uint8)


def save_pairs(folder: Path, pairs: int) -> list[Path]:
    """Write so many pairs, of four pictures with bytes of their own at the end, so all differ; and their recipe."""
    kinds = []
    for seed in range(4):
        with io.BytesIO() as held:
            Image.fromarray(scene(seed)).save(held, format="JPEG", quality=92)
            kinds.append(held.getvalue())
    files = []
    for pair in range(pairs):
        for eye in "LR":
            files.append(folder / f"p{pair}_{eye}.jpg")
            files[-1].write_bytes(kinds[len(files) % 4] + f"{pair}{eye}".encode())
    lines = [f"  - {{name: p{pair}, left: p{pair}_L.jpg, right: p{pair}_R.jpg}}" for pair in range(pairs)]
    head = f"schema_version: 1\nkind: pictures\ncolour_space: srgb\nwhite_luminance_cd_m2: {WHITE}\nstimuli:\n"
    (folder / "recipe.yaml").write_text(head + "\n".join(lines) + "\n", encoding="utf-8")
    return files


def by_openimageio(file: Path) -> None:
    """Decode a file by OpenImageIO."""
    picture = oiio.ImageInput.open(str(file))
    assert picture is not None
    picture.read_image(0, 0, 0, 3, "uint8")
    picture.close()


def by_pillow(file: Path) -> None:
    """Decode a file by Pillow."""
    with Image.open(file) as picture:
        np.asarray(picture)


def timed(work: Callable[[], object]) -> float:
    """Return how many seconds ``work`` takes."""
    return both_clocks(work)[0]


def both_clocks(work: Callable[[], object]) -> tuple[float, float]:
    """Return how many seconds ``work`` takes, by the clock and of the processor."""
    began, used = perf_counter(), process_time()
    work()
    return perf_counter() - began, process_time() - used


def run(pairs: int = sized(100, 1)) -> dict[str, Any]:
    """Decode, build, and decode once more: what else the machine does changes meanwhile."""
    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = save_pairs(folder, pairs)
        before = os.environ.get("CYCLOPEAN_CACHE")
        seconds: dict[str, list[tuple[float, float]]] = {"OpenImageIO decodes": [], "Pillow decodes": []}
        try:
            (folder / "first").mkdir()
            save_pairs(folder / "first", 1)
            os.environ["CYCLOPEAN_CACHE"] = f"{name}/first/cache"
            build_set(folder / "first" / "recipe.yaml", 0.25)  # no import is timed: `startup.py` does that
            for turn, jobs in enumerate((1, 2, 1)):
                seconds["OpenImageIO decodes"].append(both_clocks(lambda: [by_openimageio(file) for file in files]))
                seconds["Pillow decodes"].append(both_clocks(lambda: [by_pillow(file) for file in files]))
                os.environ["CYCLOPEAN_CACHE"] = f"{name}/cache{turn}"
                label = f"stimuli build, {jobs} thread{'s' if jobs > 1 else ''}"
                build = partial(build_set, folder / "recipe.yaml", 0.25, jobs=jobs)
                seconds.setdefault(label, []).append(both_clocks(build))
            built_set = build_set(folder / "recipe.yaml", 0.25)
            error = relative_error(built_set.load("p0").left, files[0])
            loads = loading(read_coded(built_set.path("p0")), folder)
        finally:
            os.environ.pop("CYCLOPEAN_CACHE", None)
            if before is not None:
                os.environ["CYCLOPEAN_CACHE"] = before
    clock, processor = (min(times) for times in zip(*seconds["Pillow decodes"], strict=True))
    for series, times in seconds.items():
        built = series.startswith("stimuli build")
        least, used = (min(each) for each in zip(*times, strict=True))
        beside = f"{least / clock:.2f} times Pillow's decoding, {used / processor:.2f} times its processor time"
        rows.append(
            {
                "series": series,
                "parameter": f"{pairs} pairs of {SIZE[0]} × {SIZE[1]} px",
                "seconds": least,
                "error": error if built else 0.0,
                "note": beside if built else "",
                "ratio": least / clock,
                "processor ratio": used / processor,
            }
        )
    rows += loads
    rows += conversions()
    builds = [row for row in rows if str(row["series"]).startswith("stimuli build")]
    whole, processor = (min(float(row[key]) for row in builds) for key in ("ratio", "processor ratio"))
    promises = [
        Promise("a build with two threads beside Pillow's decoding", whole, 2.0, "ratio", unit="×"),
        Promise("processor time of a build beside that of Pillow's decoding", processor, None, "ratio", unit="×"),
        Promise("an sRGB picture in XYZ, relative error", worst(rows, series="stimuli build"), 1e-6, "error"),
    ]
    return {"title": "Ordinary pictures to stimuli", "rows": rows, "promises": promises}


def load(file: Path) -> None:
    """Load what is kept in a file, to XYZ."""
    read_coded(file).image()


def loading(picture: CodedPicture, folder: Path) -> list[Row]:
    """Return what loading a pair takes, kept as its own files and as codes, each in turn, and their bytes."""
    kept = {"a pair loaded from its own JPEG": picture, "a pair loaded from codes": replace(picture, own=None)}
    files = {series: folder / f"pair{each.suffix}" for series, each in kept.items()}
    for series, each in kept.items():
        each.save(files[series])
    shown = [read_coded(file).image() for file in files.values()]
    times: dict[str, list[float]] = {series: [] for series in kept}
    for _ in range(9):
        for series, file in files.items():
            times[series].append(timed(partial(load, file)))
    return [
        {
            "series": series,
            "parameter": f"{file.stat().st_size / 1e6:.1f} MB",
            "seconds": median(times[series]),
            "error": float(np.abs(image.left - shown[0].left).max()),
        }
        for (series, file), image in zip(files.items(), shown, strict=True)
    ]


def by_colour_science(codes: NDArray[Any]) -> NDArray[np.float64]:
    """Return XYZ of sRGB codes by colour-science, by the matrix of the rounded chromaticities."""
    light = colour.models.eotf_sRGB(codes / np.iinfo(codes.dtype).max)
    return np.asarray(light @ named_encoding("srgb").matrix.T * WHITE)


def plain(codes: NDArray[Any]) -> NDArray[np.float64]:
    """Return XYZ of sRGB codes as `Encoding.xyz` makes it."""
    shares = codes.reshape(-1, 3) / np.iinfo(codes.dtype).max
    return named_encoding("srgb").xyz(shares).reshape(codes.shape) * WHITE


def relative_error(xyz: NDArray[Any], file: Path) -> float:
    """Return the largest relative difference from colour-science's XYZ of the codes that Pillow decodes."""
    with Image.open(file) as picture:
        reference = by_colour_science(np.asarray(picture))
    return float((np.abs(xyz - reference) / np.maximum(reference, 1e-9)).max())


def conversions() -> list[Row]:
    """Return time and error of XYZ from codes: the table, its plain twin, and colour-science."""
    encoding = named_encoding("srgb")
    rows: list[Row] = []
    for bits, kind in ((8, np.uint8), (16, np.uint16)):
        codes = np.random.default_rng(1).integers(0, 2**bits, (SIZE[1], SIZE[0], 3), dtype=kind)
        full = 2**bits - 1
        reference = by_colour_science(codes)
        works: dict[str, Callable[[], NDArray[Any]]] = {
            "table and matrix": partial(decoded, codes, encoding.tables(full + 1), encoding.matrix * WHITE),
            "plain twin": partial(plain, codes),
            "colour-science": partial(by_colour_science, codes),
        }
        for series, work in works.items():
            seconds = min(timed(work) for _ in range(3))
            error = float((np.abs(work() - reference) / np.maximum(reference, 1e-9)).max())
            rows.append(
                {"series": series, "parameter": f"2 megapixels of {bits} bits", "seconds": seconds, "error": error}
            )
    return rows


if __name__ == "__main__":
    program("ordinary_pictures", run)
