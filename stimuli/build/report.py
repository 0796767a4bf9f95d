"""What was built, for the person who asked for it: each stimulus with its notes, and what a display cannot show."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from devices.display.rig_file import Rig
from documents import Finding, InputError
from documents.files.hashes import sha256_of_json
from documents.files.whole_file import write_whole
from stimuli.build.cache import cache_folder
from stimuli.build.recipe_to_set import build_set
from stimuli.build.set_copy import Saturated, copy_set
from stimuli.build.stimulus_set import StimulusSet
from stimuli.recipes.build_context import DisplaySetup


@dataclass(frozen=True, slots=True)
class BuiltStimulus:
    """A stimulus of a built set; ``saturated_percent`` by eye and channel is None where no display is known."""

    name: str
    factors: Mapping[str, str | float]
    flat: bool
    size_px: tuple[int, int]
    statistics: Mapping[str, Any]
    notes: tuple[str, ...]
    saturated_percent: Saturated | None

    def to_json(self) -> dict[str, Any]:
        """Return the facts as JSON."""
        facts = {
            "name": self.name,
            "factors": self.factors,
            "flat": self.flat,
            "size_px": list(self.size_px),
            "statistics": self.statistics,
            "said": list(self.notes),
        }
        return facts if self.saturated_percent is None else {**facts, "saturated_percent": self.saturated_percent}


@dataclass(frozen=True, slots=True)
class BuildReport:
    """A built set and its stimuli; ``output`` is the folder that it was copied to."""

    built: StimulusSet
    stimuli: tuple[BuiltStimulus, ...]
    output: Path | None

    def to_json(self) -> dict[str, Any]:
        """Return the facts as JSON."""
        facts = {
            "recipe": str(self.built.recipe_path),
            "folder": str(self.built.folder),
            "manifest": str(self.built.manifest_path),
            "digest": self.built.digest,
            "rendered": self.built.rendered,
            "stimuli": [stimulus.to_json() for stimulus in self.stimuli],
        }
        return facts if self.output is None else {**facts, "output": str(self.output)}


def build_report(
    recipe_path: Path,
    *,
    rig: Rig | None = None,
    pixel_pitch_mm: float | None = None,
    output: Path | None = None,
    progress: Callable[[str, int, int], None] = lambda doing, done, total: None,
    jobs: int = 1,
    force: bool = False,
    verify: bool = False,
) -> BuildReport:
    """Build the stimuli of a recipe for a ``rig``, or for pixels of ``pixel_pitch_mm``, and report what they are.

    Parameters
    ----------
    output
        A new or empty folder, to which pictures, manifest and a contact sheet are copied.
    progress
        Called with what is being done, how much of it is done, and of how much.
    jobs, force, verify
        See `build_set`.

    Raises
    ------
    InputError
        If the recipe or a picture is wrong, ``output`` is taken or lies in the cache, or a file cannot be written.
    ValueError
        Unless either ``rig`` or ``pixel_pitch_mm`` is given.
    """
    if (rig is None) == (pixel_pitch_mm is None):
        raise ValueError("give rig, or pixel_pitch_mm")
    if output is not None:
        _check_output(output)
    setup = None if rig is None else DisplaySetup.of(rig)
    pitch_mm = pixel_pitch_mm if rig is None else rig.display.panel.pixel_pitch_mm
    assert pitch_mm is not None
    built = build_set(
        recipe_path,
        pitch_mm,
        lambda _, done, total: progress("Building stimuli", done, total),
        setup=setup,
        jobs=jobs,
        force=force,
        verify=verify,
    )
    saturated = None
    if setup is not None:
        saturated = saturated_percent(built, setup, lambda done, total: progress("Looking at stimuli", done, total))
    if output is not None:
        copy_set(built, output, saturated, lambda done, total: progress("Copying", done, total))
    stimuli = tuple(
        BuiltStimulus(
            entry["name"],
            entry["factors"],
            entry["flat"],
            built.size_px(entry["name"]),
            entry["statistics"],
            tuple(_notes(entry["steps"])),
            None if saturated is None else saturated[entry["name"]],
        )
        for entry in built.manifest["stimuli"]
    )
    return BuildReport(built, stimuli, output)


def _notes(steps: list[Mapping[str, Any]]) -> list[str]:
    notes = [sentence for step in steps for sentence in step.get("said", ())]
    for step in steps:
        if step["step"] == "tone_map":
            asked, used = step["asked_luminance_scale"], step["luminance_scale"]
            note = f"tone mapped by {used:.3g}"
            if step["held_back"]:
                note += f" in place of {asked:.3g}: no more than {step['limit_percent']:g} % may saturate"
            notes.append(note)
    return notes


def _check_output(folder: Path) -> None:
    """Refuse a folder that holds anything, or lies in the cache, which is tidied up."""
    try:
        taken = folder.exists() and (not folder.is_dir() or any(folder.iterdir()))
        in_cache = folder.resolve().is_relative_to(cache_folder().resolve())
    except (OSError, RuntimeError) as error:  # links that lead to one another are a RuntimeError
        reason = getattr(error, "strerror", None) or error
        raise InputError(Finding(f"the folder cannot be made: {reason}", str(folder))) from error
    if in_cache:
        raise InputError(Finding("it lies in the cache of stimuli", str(folder), remedy="name a folder of your own"))
    if taken:
        raise InputError(Finding("there is something already", str(folder), remedy="name a new or an empty folder"))


def saturated_percent(
    built: StimulusSet, setup: DisplaySetup, report: Callable[[int, int], None] = lambda done, total: None
) -> dict[str, Saturated]:
    """Return for each stimulus and eye the percentage of pixels that ask the display for more than full light.

    Pictures are only read where the numbers for these very pictures and this display's range are not kept yet.
    """
    from stimuli.luminance.saturation import measure_saturation

    key = sha256_of_json([built.digest, setup.range_json()])[:16]
    record = built.folder.with_name(f".{built.folder.name}-saturated-{key}.json")
    with contextlib.suppress(OSError, ValueError):
        kept = json.loads(record.read_text(encoding="utf-8"))
        if isinstance(kept, dict) and kept.keys() == set(built.names):
            return kept
    percent: dict[str, Saturated] = {}
    for done, name in enumerate(built.names):
        report(done, len(built.names))
        image = built.load(name)
        left = measure_saturation(image.left, setup.models.left)
        same = image.is_flat and setup.models.left is setup.models.right
        right = left if same else measure_saturation(image.right, setup.models.right)
        percent[name] = {"left": left.to_json(), "right": right.to_json()}
    report(len(built.names), len(built.names))
    # Where the cache cannot be written, the numbers are counted again next time.
    with contextlib.suppress(OSError):
        write_whole(record, json.dumps(percent))
    return percent
