"""Small pictures of the stimuli for the report, each view as the display shows it by itself."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from analysis.records import Header
from devices.colour import srgb
from devices.display import DisplayModel, PanelSpec
from documents import InputError
from documents.arrays import Floats
from runner.session.header import hashes
from stimuli.build import StimulusSet, find_cached

if TYPE_CHECKING:
    from runner.protocol.experiment import Experiment

LARGE_PX, SMALL_PX, FEW = 200, 96, 16


def find_shown(header: Header, file: Path) -> tuple[Experiment, StimulusSet] | None:
    """Return the experiment in ``file`` and its pictures if they, and the display, are those of ``header``.

    Only pictures that are built already are looked for. None if the file is wrong or anything differs.
    """
    stimuli = find_cached(str(header.hashes.get("stimuli")), file)
    if stimuli is None:
        return None
    from runner.protocol.experiment import read_experiment

    try:
        panel = PanelSpec.model_validate(header.display.panel.given())
        experiment = read_experiment(file, header.display.mode, allow_uncharacterised=True, ask_monitor=lambda _: panel)
    except (InputError, ValueError):
        return None
    now = hashes(experiment, stimuli)
    same = all(now[key] == header.hashes.get(key) for key in ("stimuli", "display"))
    return (experiment, stimuli) if same else None


def thumbnails(
    experiment: Experiment, stimuli: StimulusSet, progress: Callable[[int, int], None] = lambda done, of: None
) -> dict[str, dict[str, bytes]]:
    """Return for each stimulus a PNG by eye: ``left`` and ``right``, or ``both`` where the eyes got the same.

    Each is what the layout shows of the picture: clipped to the display's gamut, averaged in light, and brought into
    sRGB with the display's white as white.
    """
    part = experiment.visible_part
    models = experiment.rig.models
    width_px = LARGE_PX if len(stimuli.names) <= FEW else SMALL_PX
    pictures: dict[str, dict[str, bytes]] = {}
    for number, name in enumerate(stimuli.names):
        image = stimuli.load(name, part)
        left = png(small(models.left, image.left, width_px), models.left)
        if image.is_flat and models.left is models.right:
            pictures[name] = {"both": left}
        else:
            pictures[name] = {"left": left, "right": png(small(models.right, image.right, width_px), models.right)}
        progress(number + 1, len(stimuli.names))
    return pictures


def small(model: DisplayModel, xyz_cd_m2: NDArray[np.floating], width_px: int) -> Floats:
    """Return what the display makes of a picture (height, width, 3) in cd/m², averaged to at most ``width_px``."""
    height, width, _ = xyz_cd_m2.shape
    light = model.light_of(np.clip(model.linear(xyz_cd_m2), *model.limits))
    step = max(1, min(-(-width // width_px), height))
    rows, columns = height // step, width // step
    blocks = light[: rows * step, : columns * step].reshape(rows, step, columns, step, 3)
    pooled = blocks.mean(axis=(1, 3))
    return np.asarray(model.dark_XYZ_cd_m2 + pooled @ model.primaries_XYZ_cd_m2.T)


def png(xyz_cd_m2: Floats, model: DisplayModel) -> bytes:
    """Return a picture as PNG in sRGB, in which the display's white is white."""
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(np.rint(255 * srgb(xyz_cd_m2, model.white_XYZ_cd_m2)).astype(np.uint8)).save(
        out, format="PNG", optimize=True
    )
    return out.getvalue()
