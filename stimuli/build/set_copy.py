"""A stimulus set to take along: its pictures, its manifest, and a sheet of all of them to look at."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from documents import Finding, InputError
from stimuli.build.stimulus_set import MANIFEST, StimulusSet
from stimuli.pictures.stereo_image import XYZImage

if TYPE_CHECKING:
    from PIL.Image import Image

# Percentages by channel, and of pixels with any of them, for each eye.
Saturated = Mapping[str, Mapping[str, float]]
SHEET = "contact_sheet.png"
_SIDE_PX, _GAP_PX, _LINE_PX = 192, 8, 16
_XYZ_TO_SRGB = np.array(
    [[3.2406255, -1.5372080, -0.4986286], [-0.9689307, 1.8757561, 0.0415175], [0.0557101, -0.2040211, 1.0569959]]
)


def copy_set(
    made: StimulusSet,
    folder: Path,
    saturated: Mapping[str, Saturated] | None = None,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> None:
    """Copy pictures and manifest to ``folder``, which appears as a whole, with a contact sheet.

    The manifest says what a display saturates, if ``saturated`` is given.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
        try:
            for done, name in enumerate(made.names):
                report(done, len(made.names))
                shutil.copyfile(made.path(name), draft / made.path(name).name)
            (draft / MANIFEST).write_text(_manifest(made, saturated), encoding="utf-8")
            contact_sheet(made).save(draft / SHEET)
            report(len(made.names), len(made.names))
            draft.chmod(0o755)
            if folder.exists():
                folder.rmdir()
            draft.rename(folder)
        finally:
            shutil.rmtree(draft, ignore_errors=True)
    except OSError as error:
        raise InputError(Finding(f"the set cannot be copied: {error.strerror or error}", str(folder))) from error


def _manifest(made: StimulusSet, saturated: Mapping[str, Saturated] | None) -> str:
    manifest = dict(made.manifest)
    if saturated is not None:
        manifest["stimuli"] = [
            {
                **entry,
                "statistics": {
                    **entry["statistics"],
                    "eyes": {
                        eye: {**one, "saturated_percent": saturated[entry["name"]][eye]}
                        for eye, one in entry["statistics"]["eyes"].items()
                    },
                },
            }
            for entry in manifest["stimuli"]
        ]
    return json.dumps(manifest, indent=1, allow_nan=False) + "\n"


def contact_sheet(made: StimulusSet) -> Image:
    """Return all stimuli small, a row of left and right where they differ, in sRGB.

    One white serves all, so that bright pictures are brighter: four times the largest mean luminance.
    """
    from PIL import Image, ImageDraw

    small = {name: [_small(eye) for eye in _eyes(made, name)] for name in made.names}
    white = 4.0 * max(float(eye[..., 1].mean()) for eyes in small.values() for eye in eyes) or 1.0
    sizes = {name: (sum(eye.shape[1] + _GAP_PX for eye in eyes), eyes[0].shape[0]) for name, eyes in small.items()}
    cell = max(width for width, _ in sizes.values()), max(height for _, height in sizes.values()) + _LINE_PX + _GAP_PX
    columns = max(1, round((len(small) * cell[1] / cell[0]) ** 0.5))
    rows = -(-len(small) // columns)
    sheet = Image.new("RGB", (columns * cell[0] + _GAP_PX, rows * cell[1] + _GAP_PX), (32, 32, 32))
    draw = ImageDraw.Draw(sheet)
    for index, (name, eyes) in enumerate(small.items()):
        x, y = _GAP_PX + index % columns * cell[0], _GAP_PX + index // columns * cell[1]
        draw.text((x, y), name, fill=(220, 220, 220))
        for eye in eyes:
            sheet.paste(Image.fromarray(_srgb(eye / white)), (x, y + _LINE_PX))
            x += eye.shape[1] + _GAP_PX
    return sheet


def _eyes(made: StimulusSet, name: str) -> list[XYZImage]:
    image = made.load(name)
    return [image.left] if image.is_flat else [image.left, image.right]


def _small(xyz: XYZImage) -> NDArray[np.float64]:
    """Return the picture averaged over blocks, 192 pixels at its longer side or less."""
    block = -(-max(xyz.shape[:2]) // _SIDE_PX)
    pad = [(0, -side % block) for side in xyz.shape[:2]]
    whole = np.pad(xyz.astype(np.float64), (*pad, (0, 0)), mode="edge")
    return np.asarray(whole.reshape(whole.shape[0] // block, block, -1, block, 3).mean(axis=(1, 3)))


def _srgb(xyz: NDArray[np.float64]) -> NDArray[np.uint8]:
    linear = np.clip(xyz @ _XYZ_TO_SRGB.T, 0.0, 1.0)
    curved = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.asarray(np.rint(255 * curved), dtype=np.uint8)
