"""What tagged readings in a table of measurements give beside the model: crosstalk, evenness, and what glasses take.

They come of the checks that `cyclopean display report` makes, so that both report the same of the same readings.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from devices.diagnostics.diagnosis import Diagnosis
from devices.diagnostics.eyewear import crosstalk, glasses_transmittance, luminance_loss
from devices.diagnostics.panel import uniformity
from devices.diagnostics.readings import plain, tagged, untagged
from devices.readings import Measurements, PatchEye
from documents.yaml import parse_yaml, yaml_text


@dataclass(frozen=True, slots=True)
class MeasuredParts:
    """``lines`` of the display file's ``crosstalk`` and ``gain_map``, and the ``diagnoses`` that they come of.

    ``glasses``: transmittance and luminance loss for each eye. ``notes``: what tagged readings do not give, and why.
    """

    lines: Mapping[str, list[str]]
    diagnoses: tuple[Diagnosis, ...]
    glasses: Mapping[PatchEye, tuple[Diagnosis, ...]]
    notes: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON: the diagnoses by name, those of the glasses for each eye."""
        parts: dict[str, Any] = {diagnosis.name: diagnosis.to_json() for diagnosis in self.diagnoses}
        for eye, diagnoses in self.glasses.items():
            for diagnosis in diagnoses:
                parts.setdefault(diagnosis.name, {})[eye] = diagnosis.to_json()
        return parts


def measured_parts(
    measurements: Measurements,
    origin: str,
    without_glasses: Measurements | None = None,
    eyes: Sequence[PatchEye] = ("both",),
) -> MeasuredParts:
    """Return what the tagged readings of ``measurements`` give; ``origin`` is their source.

    ``without_glasses`` are plain readings of a file of their own; where it is None, those named ``...@no-glasses`` are
    taken.
    """
    lines: dict[str, list[str]] = {}
    notes: list[str] = []
    diagnoses: list[Diagnosis] = []
    if tagged(measurements, "other"):
        diagnosis = crosstalk(measurements)
        diagnoses.append(diagnosis)
        _keep("crosstalk", diagnosis, origin, lines, notes)
    if rows := [row for row, _ in tagged(measurements, "place")]:
        grid = measurements.select(rows)
        if uneven := _uneven_eyes(grid):
            notes.append(uneven)
        else:
            diagnosis = uniformity(grid)
            diagnoses.append(diagnosis)
            _keep("gain_map", diagnosis, origin, lines, notes)
    glasses: dict[PatchEye, tuple[Diagnosis, ...]] = {}
    for eye in eyes:
        table = measurements if eye == "both" else measurements.for_eye(eye)
        bare = untagged(table, "no-glasses") if without_glasses is None else plain(without_glasses)
        if len(bare):
            both = (glasses_transmittance(plain(table), bare), luminance_loss(plain(table), bare))
            glasses[eye] = tuple(each for each in both if each.value is not None)
            notes += [f"{each.title.lower()}: {each.words}" for each in both if each.value is None]
    return MeasuredParts(lines, tuple(diagnoses), glasses, tuple(notes))


def _keep(part: str, diagnosis: Diagnosis, origin: str, lines: dict[str, list[str]], notes: list[str]) -> None:
    """Keep the lines that ``diagnosis`` gives for ``part``, with ``origin`` in their source; or note why not."""
    if not diagnosis.output:
        notes.append(f"no {part} is written: {diagnosis.words}")
        return
    kept = diagnosis.output.splitlines()[:-1]
    source = parse_yaml(diagnosis.output, part).data[part]["source"]
    lines[part] = [*kept, f"  source: {yaml_text(f'{source}, of {origin}')}"]


def _uneven_eyes(grid: Measurements) -> str:
    """Say why readings through several lenses are no grid, empty if they are: all the same places for each."""
    places = {
        eye: {name for name, lens in zip(grid.name, grid.eye, strict=True) if lens == eye} for eye in set(grid.eye)
    }
    if len({frozenset(names) for names in places.values()}) < 2:
        return ""
    return "no gain_map is written: the places were not read through each lens alike; read a grid through one"
