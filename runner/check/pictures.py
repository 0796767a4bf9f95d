"""What the display cannot show of the stimuli, and whether they fill their places."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from documents.text.counting import counted
from documents.yaml.source import YamlSource
from runner.check.checked import Checked, Wishes
from runner.check.places import finding_at
from runner.protocol.experiment import Experiment
from runner.session.ledger import Ledger
from stimuli.build.recipe_to_set import build_set
from stimuli.build.stimulus_set import StimulusSet
from stimuli.recipes.build_context import DisplaySetup

# A share of a picture's area: an odd pixel at its edge is nothing to warn of.
LEAST_SEEN = 0.9


def pictures(checked: Checked, design: Experiment, source: YamlSource, wishes: Wishes) -> None:
    """Build the stimuli, or find them built, and say what the gamut clip costs each eye."""
    pitch_mm = design.rig.display.panel.pixel_pitch_mm
    stimuli = build_set(
        design.recipe_file,
        pitch_mm,
        lambda _, done, of: wishes.progress("Building stimuli", done, of),
        setup=DisplaySetup.of(design.rig),
    )
    ledger = Ledger.of(design, stimuli, design.shown(stimuli.load))
    clipping = {}
    for done, name in enumerate(stimuli.names, start=1):
        clipping[name] = ledger.description(name)["clipping"]
        wishes.progress("Looking at stimuli", done, len(stimuli.names))
    checked.facts |= asdict(ledger.work)
    checked.facts["clipped_percent"] = _per_eye(clipping, "percent_any")
    checked.facts["clip_limit_percent"] = wishes.clip_limit_percent
    checked.facts["clipping_cost_mean_delta_e_00"] = _per_eye(clipping, "delta_e_00_mean")
    if design.mode.mixture(design.rig.models) is not None:
        checked.facts["filters_cost_mean_delta_e_00"] = _per_eye(clipping, "projection_delta_e_00_mean")
    worst = {name: max(eyes) for name, eyes in checked.facts["clipped_percent"].items()}
    over = {name: percent for name, percent in worst.items() if percent > wishes.clip_limit_percent}
    if over:
        most = max(over, key=lambda name: over[name])
        what = (
            f"more than {wishes.clip_limit_percent:g} % of an eye's pixels are outside the gamut in {len(over)} of "
            f"{counted(len(worst), 'stimulus', 'stimuli')}: {_some(over)}; most in '{most}', {over[most]:.2f} %"
        )
        remedy = "`cyclopean preview --clipping` marks them; scale the luminance down, or accept it"
        checked.warnings.append(finding_at(source, ("stimuli",), what, remedy))
    _sizes(checked, design, source, stimuli)
    if design.rig.gain_map:
        what = f"the gain map costs {100 * design.rig.gain_map.luminance_lost:.1f} % of the luminance"
        checked.warnings.append(finding_at(source, ("rig",), what))


def _sizes(checked: Checked, design: Experiment, source: YamlSource, stimuli: StimulusSet) -> None:
    aperture = design.aperture_px
    small = [name for name in stimuli.names if any(a < b for a, b in zip(stimuli.size_px(name), aperture, strict=True))]
    if small:
        what = (
            f"{counted(len(small), 'stimulus is', 'stimuli are')} smaller than the aperture of {aperture[0]} x "
            f"{aperture[1]} px: {_some(small)}"
        )
        remedy = "black will surround them; make size_mm smaller, or the pictures larger"
        checked.warnings.append(finding_at(source, ("layout", "size_mm"), what, remedy))
    seen = {name: _seen_share(stimuli.size_px(name), aperture) for name in stimuli.names}
    cut = {name: share for name, share in seen.items() if share < LEAST_SEEN}
    if cut:
        least = min(cut, key=lambda name: cut[name])
        what = (
            f"the aperture of {aperture[0]} x {aperture[1]} px shows the middle alone of "
            f"{counted(len(cut), 'stimulus', 'stimuli')}: "
            f"{_some(cut)}; least of '{least}', {100 * cut[least]:.0f} % of its area"
        )
        remedy = "make size_mm larger, resample the pictures, or accept it"
        checked.warnings.append(finding_at(source, ("layout", "size_mm"), what, remedy))


def _seen_share(size_px: tuple[int, int], aperture_px: tuple[int, int]) -> float:
    """Return how much of a picture's area its aperture leaves to see."""
    shares = [min(a / b, 1.0) for a, b in zip(aperture_px, size_px, strict=True)]
    return shares[0] * shares[1]


def _some(names: Any) -> str:
    listed = list(names)
    return ", ".join(listed[:5]) + (f" and {len(listed) - 5} more" if len(listed) > 5 else "")


def _per_eye(clipping: Mapping[str, Mapping[str, Any]], key: str) -> dict[str, list[float]]:
    return {name: [eyes["left"][key], eyes["right"][key]] for name, eyes in clipping.items()}
