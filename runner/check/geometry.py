"""How large the pictures are to the eye, and how fine the pixels."""

from __future__ import annotations

from devices.display.viewing import CYCLES_PER_DEGREE, pixels_per_degree, visual_angle_deg
from documents.yaml.source import YamlSource
from runner.check.checked import Checked
from runner.check.places import finding_at
from runner.protocol.experiment import Experiment

# One field of view: what the colorimetry of 2 and 10 degree observers is about.
WIDEST_DEG = 10.0
NARROWEST_DEG = 0.2


def geometry(checked: Checked, design: Experiment, source: YamlSource) -> None:
    """Say what angle a picture covers and how many pixels lie in a degree, and warn of either."""
    distance_mm = design.rig.distance_mm
    angle = [round(float(visual_angle_deg(size, distance_mm)), 2) for size in design.spec.layout.size_mm]
    density = pixels_per_degree(design.rig.display.panel.pixel_pitch_mm, distance_mm)
    checked.facts["picture_deg"] = angle
    checked.facts["picture_px"] = list(design.aperture_px)
    checked.facts["pixels_per_degree"] = round(density, 2)
    if max(angle) > WIDEST_DEG:
        what = f"a picture covers {max(angle):.1f}°, more than the {WIDEST_DEG:.0f}° of one field"
        remedy = "make size_mm smaller, or sit further away"
        checked.warnings.append(finding_at(source, ("layout", "size_mm"), what, remedy))
    if max(angle) < NARROWEST_DEG:
        what = f"a picture covers {max(angle):g}° only"
        remedy = "sizes and distances are in millimetres"
        checked.warnings.append(finding_at(source, ("layout", "size_mm"), what, remedy))
    if density < 2 * CYCLES_PER_DEGREE:
        what = (
            f"{density:.1f} pixels per degree carry {density / 2:.1f} cycles per degree; the eye resolves "
            f"{CYCLES_PER_DEGREE:.0f}, and pixels may be seen"
        )
        further_mm = distance_mm * 2 * CYCLES_PER_DEGREE / density
        remedy = f"they could not be from {further_mm / 10:.0f} cm, or with finer pixels"
        checked.warnings.append(finding_at(source, ("rig",), what, remedy))
