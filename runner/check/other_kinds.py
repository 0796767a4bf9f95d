"""Displays, rigs, photodiodes' records, cameras, regions, recipes and simulated observers."""

from __future__ import annotations

from devices.camera.camera_file import read_camera
from devices.display.display_file import read_display
from devices.display.rig_file import read_rig
from devices.display.verification_file import read_verification
from devices.display.viewing import pixels_per_degree
from documents import Finding
from documents.yaml.source import read_yaml
from runner.check.checked import Checked, Wishes
from runner.check.named_files import missing_pictures
from runner.check.onsets import onsets
from runner.check.screen import look
from runner.observers.observer_file import KINDS, ScoredObserverSpec, read_observer
from stimuli.comparison.regions_file import read_regions
from stimuli.recipes.recipe import read_recipe


def check_display(checked: Checked, wishes: Wishes) -> None:
    """Check a display file."""
    display = read_display(checked.file)
    white = {
        mode: {"left": round(float(m.left.white_XYZ_cd_m2[1]), 2), "right": round(float(m.right.white_XYZ_cd_m2[1]), 2)}
        for mode, m in display.modes.items()
    }
    checked.facts = {"kind": "display", "modes": sorted(display.modes), "white_luminance_cd_m2": white}
    checked.warnings += [display.unfinished(mode) for mode in display.lacking]


def check_rig(checked: Checked, wishes: Wishes) -> None:
    """Check a rig file, and whether this machine's screen is that of the rig."""
    rig = read_rig(checked.file)
    density = pixels_per_degree(rig.display.panel.pixel_pitch_mm, rig.distance_mm)
    checked.facts = {"kind": "rig", "mode": rig.mode, "pixels_per_degree": round(density, 2)}
    onsets(checked, rig)
    look(checked, rig, wishes)


def check_verification(checked: Checked, wishes: Wishes) -> None:
    """Check a record of onsets verified with a photodiode."""
    verification = read_verification(checked.file)
    spec = verification.spec
    checked.facts = {
        "kind": "verification",
        "mode": spec.mode,
        "refresh_hz": spec.refresh_hz,
        "onsets": verification.sentence(),
    }


def check_camera(checked: Checked, wishes: Wishes) -> None:
    """Check a camera file."""
    camera = read_camera(checked.file)
    exposure, zone = camera.exposure, camera.safe_luminance_cd_m2
    checked.facts = {
        "kind": "camera",
        "form": camera.form,
        **({"exposure": str(exposure)} if exposure else {}),
        **({"safe_luminance_cd_m2": list(zone)} if zone else {}),
    }
    if zone is None:
        what = (
            "the camera's safe luminance zone is not known: light beyond what it was characterised for goes unnoticed"
        )
        checked.warnings.append(
            Finding(what, str(checked.file), remedy="fit the camera to a chart: cyclopean camera fit")
        )


def check_regions(checked: Checked, wishes: Wishes) -> None:
    """Check a file of regions to compare; whether they lie inside the pictures only the comparison can say."""
    regions = read_regions(checked.file)
    checked.facts = {
        "kind": "regions",
        "regions": [f"{one.name} ({one.kind})" for one in regions.spec.regions],
        "limit_delta_e_00": regions.limits.delta_e,
    }


def check_kind(checked: Checked, wishes: Wishes) -> None:
    """Check a recipe or simulated observers."""
    if read_yaml(checked.file).data.get("kind") in KINDS:
        spec = read_observer(checked.file)
        scored = {"stimuli": len(spec.stimuli)} if isinstance(spec, ScoredObserverSpec) else {}
        checked.facts = {"kind": "observers", **scored}
        return
    recipe, _ = read_recipe(checked.file)
    checked.errors += missing_pictures(checked.file)
    checked.facts = {"kind": "stimuli", "names": list(recipe.names())}
