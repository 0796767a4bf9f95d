"""A new study from 200 pictures of 12 megapixels, beside what decoding them takes.

`runner.studies.new_study` reads headers and copies files. Times are those of JPEG files of about 4 MB, pairs and flat
pictures; decoding is Pillow's, timed on ten of them and multiplied. The error is the share of copies that are not byte
for byte the picture: 0.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from curves import Row, program, sized
from PIL import Image
from promises import Promise, worst

from devices.display import PanelSpec
from documents import sha256_of_file
from runner.studies import StudyOptions, new_study

FILES = sized(200, 4)
SIZE_PX = sized((4000, 3000), (400, 304))
LIMIT_S = 10.0
DECODED = sized(10, 2)
PANEL = PanelSpec(resolution_px=(1920, 1080), pixel_pitch_mm=0.2768)


def run() -> dict[str, Any]:
    """Make both studies, and decode some of the pictures."""
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        original = folder / "original.jpg"
        _photograph().save(original, quality=90)
        digest = sha256_of_file(original)
        for series, stems in _NAMES.items():
            pictures = folder / series
            pictures.mkdir()
            for stem in stems:
                shutil.copyfile(original, pictures / f"{stem}.jpg")
            start = perf_counter()
            study = new_study(folder / f"{series} study", [pictures], StudyOptions(panel=PANEL))
            seconds = perf_counter() - start
            copies = [sha256_of_file(file) for file in (study.folder / "pictures").iterdir()]
            wrong = sum(copy != digest for copy in copies) + abs(len(copies) - FILES)
            what = (
                f"{FILES} files of {SIZE_PX[0] * SIZE_PX[1] / 1e6:.0f} megapixels, {original.stat().st_size >> 20} MB"
            )
            rows.append({"series": series, "parameter": what, "seconds": seconds, "error": wrong / FILES})
            shutil.rmtree(study.folder)
            shutil.rmtree(pictures)
        start = perf_counter()
        for _ in range(DECODED):
            with Image.open(original) as picture:
                picture.load()
        decoding = (perf_counter() - start) * FILES / DECODED
        rows.append(
            {"series": "decoding alone (Pillow)", "parameter": f"{FILES} files", "seconds": decoding, "error": None}
        )
    made = rows[: len(_NAMES)]
    promises = [
        Promise("share of copies that differ", worst(made), 0.0, "error", "exactly"),
        Promise("a study of 200 photographs", worst(made, "seconds"), LIMIT_S, "seconds", unit="s"),
    ]
    return {"title": "A new study of photographs", "rows": rows, "promises": promises}


_NAMES = {
    "pairs": [f"photo{number}_{eye}" for number in range(FILES // 2) for eye in "LR"],
    "flat": [f"photo{number}" for number in range(FILES)],
}


def _photograph() -> Image.Image:
    """Return a picture with as much detail as a photograph has, for a file of a photograph's size."""
    width, height = SIZE_PX
    rng = np.random.default_rng(2016)
    coarse = rng.normal(128, 40, (height // 8, width // 8, 3))
    smooth = np.kron(coarse, np.ones((8, 8, 1)))
    return Image.fromarray(np.clip(smooth + rng.normal(0, 6, (height, width, 3)), 0, 255).astype(np.uint8))


if __name__ == "__main__":
    program("new_study", run)
