"""Rig files: `configs/rigs/*.yaml`: which display, in which stereo mode, seen from where."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, PositiveFloat

from devices.crosstalk import Crosstalk
from devices.display_file import Display, EyeModels, read_display
from devices.gain_map import GainMap
from documents import Finding, InputError, load_document


class RigSpec(BaseModel):
    """A rig file."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    schema_version: Literal[1]
    display: str
    mode: str
    distance_mm: PositiveFloat
    interpupillary_distance_mm: PositiveFloat = 65.0
    glasses: str = ""
    mode_options: dict[str, Any] = Field(default_factory=dict)
    lift_black: bool = False
    dither: Literal["none", "shared", "independent"] = "none"
    photodiode_verification: str = ""


@dataclass(frozen=True, slots=True)
class Rig:
    """A display in a stereo mode at a viewing distance.

    ``characterised_as`` is the mode whose measurements serve: ``mode`` itself, unless an uncharacterised mode was
    allowed. ``mode_options`` are as the file has them; the presenter's modes know which there are. ``lift_black`` asks
    for enough light in every picture that crosstalk can be cancelled to the last; ``dither`` says whether pictures are
    dithered, and whether the eyes share the mask; ``photodiode_verification`` names a
    record that onsets were checked with a photodiode.
    """

    file: str
    display: Display
    mode: str
    models: EyeModels
    distance_mm: float
    interpupillary_distance_mm: float
    glasses: str
    characterised_as: str
    mode_options: Mapping[str, Any]
    lift_black: bool
    dither: Literal["none", "shared", "independent"]
    photodiode_verification: str

    @property
    def output_bits(self) -> Literal[8, 10]:
        """How many bits a channel to ask the graphics driver for: 10 for a panel that has them."""
        return 10 if self.display.panel.bits >= 10 else 8

    @property
    def crosstalk(self) -> Crosstalk | None:
        """The crosstalk that was measured in this mode, or None."""
        return self.display.crosstalk(self.characterised_as)

    @property
    def gain_map(self) -> GainMap | None:
        """How evenly the panel was measured to shine in this mode, or None."""
        return self.display.gain_map(self.characterised_as)

    @property
    def is_characterised(self) -> bool:
        """Whether the display was measured in this very mode."""
        return self.characterised_as == self.mode


def read_rig(path: Path, mode: str | None = None, *, allow_uncharacterised: bool = False) -> Rig:
    """Read the rig file at ``path``, with ``mode`` in place of the file's own if given.

    With ``allow_uncharacterised``, a mode that was not characterised borrows the measurements of the display file's
    first mode; the rig says so.

    Raises
    ------
    InputError
        If the rig or its display file is wrong, or the display was not characterised in the mode.
    """
    spec, source = load_document(path, RigSpec)

    def located(error: InputError, key: str) -> InputError:
        place = source.place((key,))
        line, column = (place.line, place.column) if place else (None, None)
        return InputError(
            [Finding(f"{f.message}: {f.file}", source.file, line, column, f.remedy) for f in error.findings]
        )

    display_path = path.parent / spec.display
    if not display_path.is_file():
        raise located(InputError(Finding("there is no such display file", spec.display)), "display")
    display = read_display(display_path)
    wanted = mode or spec.mode
    characterised_as = wanted
    if allow_uncharacterised and wanted not in display.modes:
        characterised_as = next(iter(display.modes))
    try:
        models = display.models(characterised_as)
    except InputError as error:
        raise error if mode else located(error, "mode") from None
    return Rig(
        str(path),
        display,
        wanted,
        models,
        spec.distance_mm,
        spec.interpupillary_distance_mm,
        spec.glasses,
        characterised_as,
        MappingProxyType(spec.mode_options),
        spec.lift_black,
        spec.dither,
        spec.photodiode_verification,
    )
