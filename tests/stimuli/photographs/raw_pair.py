"""Raw files of a made-up sparkling plate, as a camera of known matrix would take them from where either eye is.

Each pixel of the scene covers a quad of photosites of one colour each, so that the superpixel demosaicing gives it back
as it was, but for the raw file's codes.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from devices.colour import XYZ_from_xyY
from devices.readings import colorchecker_xyY
from stimuli.pictures import StereoImage
from tests.stimuli.develop.dng import exposure_tags, write_dng

ROOT = Path(__file__).parents[3]
# XYZ in cd/m² for full scale at 1/15 s, f/8, ISO 800.
MATRIX = np.array([[220.0, 37.0, 3.0], [84.0, 146.0, -46.0], [12.0, -35.0, 220.0]])
BLACK, WHITE = 600, 65000
PX_PER_MM = 8.0
SIZE_PX = (240, 168)
# Where the plate lies in the left view, and the right one: parallel cameras see it at different places.
LEFT_AT, RIGHT_AT = (31, 14), (12, 12)
VIEW_PX = (288, 200)


@dataclass(frozen=True)
class RawPair:
    """The raw files' folder, the plate's XYZ as it was photographed, and the recipe that names the files."""

    folder: Path
    plate: StereoImage
    recipe: dict[str, Any]


def plate_xyz() -> StereoImage:
    """Return left and right XYZ of a plate of 30 × 21 mm: sparkles on 5 cd/m², of which each eye has its own."""
    random_ = np.random.default_rng(5)
    both, left, right = random_.random((3, SIZE_PX[1], SIZE_PX[0])) > 0.996
    views = (gaussian_filter(60.0 * (both | own), 0.8) for own in (left, right))
    return StereoImage(*(((5 + light)[..., None] * [0.964, 1.0, 0.825]).astype(np.float32) for light in views))


def camera_rgb(xyz: NDArray[Any], times: float = 1.0) -> NDArray[np.float64]:
    """Return what the camera records of XYZ at ``times`` the exposure of its characterisation."""
    return np.asarray(times * (np.asarray(xyz, np.float64) @ np.linalg.inv(MATRIX).T))


def in_view(plate: NDArray[Any], at: tuple[int, int]) -> NDArray[np.float64]:
    """Return a camera's view: the plate on a grey table."""
    view = np.broadcast_to(0.5 * plate.mean(axis=(0, 1), dtype=np.float64), (VIEW_PX[1], VIEW_PX[0], 3)).copy()
    view[at[1] : at[1] + plate.shape[0], at[0] : at[0] + plate.shape[1]] = plate
    return view


def save_raw(path: Path, xyz: NDArray[Any], times: float = 1.0, time: tuple[int, int] = (1, 15)) -> Path:
    rgb = np.repeat(np.repeat(camera_rgb(xyz, times), 2, axis=0), 2, axis=1)
    return write_dng(path, rgb, black=(BLACK,), white=WHITE, tags=exposure_tags(time, (8, 1), 800))


def chart_csv(path: Path, times: float = 1.0) -> Path:
    """Write what the camera saw of a ColorChecker whose white has about 90 cd/m², and an instrument beside it."""
    names, xyY = colorchecker_xyY()
    XYZ = XYZ_from_xyY(xyY) * 100
    rgb = np.rint(np.clip(times * camera_rgb(XYZ), 0, 1) * (WHITE - BLACK)) / (WHITE - BLACK)
    rows = [
        ",".join([*(f"{value:.9g}" for value in (*seen, *measured)), name])
        for seen, measured, name in zip(rgb, XYZ, names, strict=True)
    ]
    path.write_text("R,G,B,X,Y,Z,name\n" + "\n".join(rows) + "\n")
    return path


def raw_pair(folder: Path, times: float = 1.0, time: tuple[int, int] = (1, 15)) -> RawPair:
    """Write left.dng and right.dng to ``folder``, taken for ``time``, ``times`` the camera file's exposure."""
    folder.mkdir(parents=True, exist_ok=True)
    plate = plate_xyz()
    save_raw(folder / "left.dng", in_view(plate.left, LEFT_AT), times, time)
    save_raw(folder / "right.dng", in_view(plate.right, RIGHT_AT), times, time)
    recipe = {
        "schema_version": 1,
        "kind": "photographs",
        "camera": "camera.yaml",
        "develop": {"demosaic": "superpixel"},
        "stimuli": [{"name": "plate", "left": "left.dng", "right": "right.dng", "flat_eye": "left"}],
    }
    return RawPair(folder, plate, recipe)


def write_recipe(folder: Path, recipe: dict[str, Any]) -> Path:
    path = folder / "recipe.yaml"
    path.write_text(yaml.safe_dump(recipe, sort_keys=False))
    return path
