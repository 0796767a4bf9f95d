"""What a file means before anyone sits down: read it with all it names, and say what a session would be."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from devices.display_file import read_display
from devices.rig_file import Rig, read_rig
from devices.verification_file import read_verification
from devices.viewing import pixels_per_degree, visual_angle_deg
from documents import Finding
from documents.yaml_source import read_yaml
from runner.compensation import Compensation
from runner.errors import SessionError
from runner.header import describe_stimulus
from runner.observers.observer_file import KINDS, ScoredObserverSpec, read_observer
from runner.protocol.experiment import read_experiment
from runner.timing_record import NOT_VERIFIED
from stimuli.build import build
from stimuli.names import stimulus_names
from stimuli.recipe import read_recipe

# Resolving 60 cycles per degree takes two samples a cycle (thesis Section 2.4.1, corrected).
EYE_LIMIT_PX_PER_DEG = 120.0
STANDARD_FIELD_DEG = 10.0

Facts = dict[str, Any]


def check_file(file: Path) -> Facts:
    """Read ``file``, whichever kind it is, and return what it amounts to.

    An experiment's stimuli are built, or found built, so that what the display cannot show of them is known.

    Raises
    ------
    InputError
        With every fault found in it and in the files it names.
    """
    data = read_yaml(file).data
    keys = set(data) if isinstance(data, dict) else set()
    for telling, reader in _READERS.items():
        if telling in keys:
            return reader(file)
    raise SessionError(
        Finding(
            "this is no file that cyclopean knows",
            str(file),
            remedy="an experiment has 'blocks:', a display 'modes:', a rig 'mode:', a photodiode's record "
            "'onset_error_ms:', a recipe or observers 'kind:'",
        )
    )


def _experiment(file: Path) -> Facts:
    design = read_experiment(file)
    rig = design.rig
    pitch_mm = rig.display.panel.pixel_pitch_mm
    width_mm, height_mm = design.spec.layout.size_mm
    blocks = design.blocks("01")
    trials = sum(block.trials for block in blocks)
    angle = [round(float(visual_angle_deg(size, rig.distance_mm)), 2) for size in (width_mm, height_mm)]
    density = pixels_per_degree(pitch_mm, rig.distance_mm)
    remarks = []
    if max(angle) > STANDARD_FIELD_DEG:
        remarks.append(f"a picture covers {max(angle):.1f}°, more than the {STANDARD_FIELD_DEG:.0f}° of one field")
    if density < EYE_LIMIT_PX_PER_DEG:
        remarks.append(
            f"{density:.1f} pixels per degree are below the {EYE_LIMIT_PX_PER_DEG:.0f} at which the eye's finest "
            "detail could be shown: pixels may be seen"
        )
    keys = {key: meaning for block in blocks for key, meaning in block.keys.items()}
    onsets, doubts = _onsets(rig)
    remarks += doubts
    stimuli = build(design.recipe_file, pitch_mm)
    load = design.shown(stimuli.load)
    compensation = Compensation.of(rig, design.mode, (load(name) for name in stimuli.names))
    clipping = {
        name: describe_stimulus(name, load(name), {}, compensation, design.places_px)["clipping"]
        for name in stimuli.names
    }
    mixed = design.mode.mixture(rig.models) is not None
    if rig.gain_map:
        remarks.append(f"the gain map costs {100 * rig.gain_map.luminance_lost:.1f} % of the luminance")
    aperture = design.aperture_px
    small = [name for name in stimuli.names if _smaller(stimuli.entry(name)["size_px"], aperture)]
    if small:
        remarks.append(f"smaller than the aperture of {aperture[0]} x {aperture[1]} px: {', '.join(small)}")
    return {
        "kind": "experiment",
        "name": design.spec.name,
        "stimuli": len(design.stimulus_names),
        "trials": trials,
        "minutes": round(sum(block.expected_s for block in blocks) / 60, 1),
        "mode": rig.mode,
        "crosstalk": "cancelled" if rig.crosstalk else "not measured",
        "onsets": onsets,
        "picture_deg": angle,
        "pixels_per_degree": round(density, 2),
        "keys": {**keys, "space": "continue", "escape": "pause"},
        "clipped_percent": _per_eye(clipping, "percent_any"),
        "clipping_cost_mean_delta_e_00": _per_eye(clipping, "delta_e_00_mean"),
        **({"filters_cost_mean_delta_e_00": _per_eye(clipping, "projection_delta_e_00_mean")} if mixed else {}),
        "remarks": remarks,
    }


def _per_eye(clipping: Mapping[str, Mapping[str, Any]], key: str) -> dict[str, list[float]]:
    return {name: [eyes["left"][key], eyes["right"][key]] for name, eyes in clipping.items()}


def _smaller(size_px: Sequence[int], aperture_px: tuple[int, int]) -> bool:
    return size_px[0] < aperture_px[0] or size_px[1] < aperture_px[1]


def _display(file: Path) -> Facts:
    display = read_display(file)
    white = {
        mode: {"left": round(float(m.left.white_XYZ_cd_m2[1]), 2), "right": round(float(m.right.white_XYZ_cd_m2[1]), 2)}
        for mode, m in display.modes.items()
    }
    return {"kind": "display", "modes": sorted(display.modes), "white_luminance_cd_m2": white}


def _rig(file: Path) -> Facts:
    rig = read_rig(file)
    density = pixels_per_degree(rig.display.panel.pixel_pitch_mm, rig.distance_mm)
    onsets, remarks = _onsets(rig)
    return {
        "kind": "rig",
        "mode": rig.mode,
        "pixels_per_degree": round(density, 2),
        "onsets": onsets,
        "remarks": remarks,
    }


def _onsets(rig: Rig) -> tuple[str, list[str]]:
    """Return what is known of onsets before a screen is there, and in what the rig's record of them differs from it."""
    verification = rig.photodiode_verification
    if verification is None:
        return NOT_VERIFIED, []
    differs = verification.mismatches(mode=rig.mode, refresh_hz=rig.display.panel.refresh_hz)
    if not differs:
        return verification.sentence(), []
    return NOT_VERIFIED, [f"{Path(verification.file).name} does not hold for this rig: {'; '.join(differs)}"]


def _verification(file: Path) -> Facts:
    verification = read_verification(file)
    spec = verification.spec
    return {
        "kind": "verification",
        "mode": spec.mode,
        "refresh_hz": spec.refresh_hz,
        "onsets": verification.sentence(),
    }


def _by_kind(file: Path) -> Facts:
    data = read_yaml(file).data
    if data.get("kind") in KINDS:
        spec = read_observer(file)
        stimuli = {"stimuli": len(spec.stimuli)} if isinstance(spec, ScoredObserverSpec) else {}
        return {"kind": "observers", "judge_by": spec.kind, **stimuli}
    recipe, _ = read_recipe(file)
    return {"kind": "stimuli", "names": list(stimulus_names(recipe))}


# Which top-level key tells a file's kind; the first that is there decides.
_READERS: Mapping[str, Callable[[Path], Facts]] = MappingProxyType(
    {
        "blocks": _experiment,
        "modes": _display,
        "onset_error_ms": _verification,
        "onsets": _verification,
        "mode": _rig,
        "kind": _by_kind,
    }
)
