"""The error budget of the shipped rig against the framebuffer itself: what both say all steps cost, and in what time.

The plain way to know what a rig costs is to show the scene and read the framebuffer back. It gives all steps together
and no single one. The error of the budget is how far its mean ΔE00 is from that of the framebuffer; half floats and
resampling, which happen before, are left out of both. Each single step is in the rows below, its mean ΔE00 in the error
column.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from curves import Row, program, seconds
from promises import Promise, worst

from devices.budget import BudgetRow, Encoding, OwnPixels, PathStep, SmoothScene
from devices.colour import delta_e_2000, xyz_to_lab
from devices.compensation import Correction
from devices.compensation.crosstalk_cancel import seen_XYZ
from devices.display import EYES, Crosstalk, Rig, entries_for, read_rig
from runner.check.error_budget import rig_budget
from runner.presenter.modes.registry import find_mode
from runner.presenter.presenter import Presenter
from runner.presenter.surfaces.opening import open_surface
from runner.scene import Picture, Scene
from stimuli.pictures import StereoImage

RIG = Path(__file__).parents[1] / "configs/rigs/asus_vg248qe_3dvision.yaml"
SCENE_PX = (192, 128)
LEAKS = Crosstalk(0.02 * np.eye(3), 0.02 * np.eye(3))
MOST_APART = 1e-3
OURS = "budget's path, all steps"


def of_framebuffer(rig: Rig, crosstalk: Crosstalk | None) -> float:
    """Return the mean ΔE00 of both eyes between the scene and what the framebuffer holds of it."""
    views = [SmoothScene(rig.models, SCENE_PX).view(eye, SCENE_PX) for eye in EYES]
    image = StereoImage(views[0].astype(np.float32), views[1].astype(np.float32))
    size_px, mode = (2 * SCENE_PX[0], SCENE_PX[1]), find_mode(rig.mode)
    correction = Correction(crosstalk)
    with (
        open_surface("egl", size_px) as surface,
        Presenter(surface, mode, rig.models, lambda _: image, correction=correction) as presenter,
    ):
        presenter.show(Scene((Picture("scene"),)))
        codes = [presenter.eye_view(eye) / 255.0 for eye in EYES]
    shown = seen_XYZ(rig.models, crosstalk, codes[0], codes[1])
    white = rig.models.left.white_XYZ_cd_m2
    pairs = zip(views, shown, strict=True)
    return float(np.mean([delta_e_2000(xyz_to_lab(a, white), xyz_to_lab(b, white)).mean() for a, b in pairs]))


def of_budget(rig: Rig, crosstalk: Crosstalk | None) -> float:
    """Return the same from the budget's path."""
    path = OwnPixels(rig.models, Encoding(255, entries_for(255, dithered=False), dithered=False), Correction(crosstalk))
    asked = {eye: SmoothScene(rig.models, SCENE_PX).view(eye, SCENE_PX).reshape(-1, 3) for eye in EYES}
    seen = path.seen(asked, set(PathStep) - {PathStep.HALF_FLOATS})
    white = rig.models.left.white_XYZ_cd_m2
    return float(
        np.mean([delta_e_2000(xyz_to_lab(asked[eye], white), xyz_to_lab(seen[eye], white)).mean() for eye in EYES])
    )


def compared(rig: Rig, name: str, crosstalk: Crosstalk | None) -> list[Row]:
    """Return a row of the budget and one of the framebuffer."""
    ours, theirs = of_budget(rig, crosstalk), of_framebuffer(rig, crosstalk)
    apart = abs(ours - theirs)
    note = f"mean ΔE00 {ours:.4f}, framebuffer {theirs:.4f}"
    return [
        {
            "series": OURS,
            "parameter": name,
            "seconds": seconds(lambda: of_budget(rig, crosstalk), repeats=3),
            "error": apart,
            "note": note,
        },
        {
            "series": "shown and read back",
            "parameter": name,
            "seconds": seconds(lambda: of_framebuffer(rig, crosstalk), repeats=3),
            "error": None,
            "note": "no step by itself",
        },
    ]


def step_row(row: BudgetRow, name: str) -> Row:
    """Return a row of the budget, its mean ΔE00 in the error column."""
    cost = None if row.eyes is None else row.eyes["left"]
    note = row.words if cost is None else f"{row.words}; 95 % within {cost.p95:.2g}, largest {cost.max:.2g}"
    mean = None if cost is None else cost.mean
    return {"series": f"step, {name}", "parameter": str(row.step), "seconds": None, "error": mean, "note": note}


def run() -> dict[str, Any]:
    """Compare with the framebuffer, without and with crosstalk; then every step."""
    rig = read_rig(RIG)
    rows = [*compared(rig, "no crosstalk", None), *compared(rig, "2 % crosstalk", LEAKS)]
    rows += [step_row(row, "rounded") for row in rig_budget(rig).rows]
    rows += [
        step_row(row, "dithered")
        for row in rig_budget(replace(rig, spec=rig.spec.model_copy(update={"dither": "shared"}))).rows
    ]
    apart = Promise("mean ΔE00 of all steps against the framebuffer", worst(rows, series=OURS), MOST_APART, "error")
    return {"title": "Error budget of the shipped rig, in ΔE00", "rows": rows, "promises": [apart]}


if __name__ == "__main__":
    program("error_budget", run)
