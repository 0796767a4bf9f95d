"""The matrix and curves of an ICC profile, as they are, into a mode of a display file."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from devices.characterise.figures import ModelNumbers
from devices.characterise.mode_file import ModeLines, write_mode
from devices.characterise.told import black_words, curves_tables, notes
from devices.display import DisplayModel, GammaTable, PanelSpec
from devices.display.model_spec import ModelSpec
from devices.profiles import model_of_profile, read_profile
from devices.readings import PROFILE_ENDINGS, PatchEye, carried
from documents.arrays import Floats
from documents.pages import Block
from documents.text import JsonResult


@dataclass(frozen=True, slots=True, eq=False)
class ProfileMode(JsonResult):
    """A display model that an ICC profile states, ``notes`` in sentences, and the gamma table that it goes with.

    ``written`` is what was written of it into the ``mode`` of a display file, in sentences, for ``eye``.
    """

    file: str
    model: DisplayModel
    notes: tuple[str, ...]
    gamma_table: GammaTable | None = None
    mode: str | None = None
    eye: PatchEye = "both"
    written: str = ""
    json_keys: ClassVar = {"notes": "said", "kind": "model"}
    json_names: ClassVar = "notes kind white_XYZ_cd_m2 numbers"
    json_only: ClassVar = "facts"

    @property
    def facts(self) -> dict[str, Any]:
        """What a command prints as JSON."""
        facts = {"file": self.file, "mode": self.mode, self.eye: self}
        return facts | ({"written": self.written} if self.written else {})

    def told(self) -> Iterator[str | Block]:
        """Yield what people read of it, and what was written."""
        white = " ".join(f"{value:.4g}" for value in self.white_XYZ_cd_m2)
        yield f"The profile's matrix and curves, as they are ({self.kind}); its white: {white} cd/m²"
        yield from curves_tables(self.numbers)
        yield black_words(self.numbers, None)
        yield from notes(
            (*self.notes, "nothing in the profile says how well it describes the display: display verify does")
        )
        if self.written:
            yield self.written

    @property
    def kind(self) -> str:
        """The kind of its curves, as a display file names it."""
        return self.model.curves[0].kind_of_curve.replace("gogo", "gog")

    @property
    def numbers(self) -> ModelNumbers:
        """The model's numbers; a profile states no standard errors."""
        return ModelNumbers.of(self.model, {})

    @property
    def white_XYZ_cd_m2(self) -> Floats:
        """XYZ (3,) at full drive."""
        return self.model.xyz(np.ones(3))

    def write(
        self,
        file: str | Path,
        mode: str,
        panel: PanelSpec | None = None,
        *,
        eye: PatchEye = "both",
        replace: bool = False,
    ) -> ProfileMode:
        """Write the model into a display file; all else in the file stays as it is.

        Parameters
        ----------
        file
            The display file, made if it does not exist.
        mode
            The stereo mode.
        panel
            The panel of a new file.
        eye
            The eye that the model is of.
        replace
            Whether a characterisation that the mode has already is overwritten.

        Returns
        -------
        ProfileMode
            It, with what was ``written``.

        Raises
        ------
        DeviceError
            As `devices.characterise.mode_file.write_mode`.
        """
        source = f"matrix and curves of the ICC profile {Path(self.file).name}, as they are"
        spec = ModelSpec.of(self.model, source=source, gamma_table=self.gamma_table and self.gamma_table.to_json())
        written = write_mode(Path(file), mode, ModeLines({eye: spec.lines()}, {}), panel, replace=replace)
        return dataclasses.replace(self, written=written)


def read_profile_mode(path: str | Path, white_cd_m2: float | None = None) -> ProfileMode | None:
    """Return the matrix and curves of an ICC profile as a display model, if they are all that it says of its light.

    Parameters
    ----------
    path
        A file.
    white_cd_m2
        Luminance of the white in cd/m², above 0, in place of what the profile says of it.

    Returns
    -------
    ProfileMode or None
        None if the file is no profile, or one with measurements or a table inside, which are fitted.

    Raises
    ------
    DeviceError
        As `devices.profiles.read_profile` and `devices.profiles.model_of_profile`.
    """
    if Path(path).suffix.lower() not in PROFILE_ENDINGS:
        return None
    profile = read_profile(path)
    if profile.table_name or carried(profile) is not None:
        return None
    made = model_of_profile(profile, white_cd_m2)
    return ProfileMode(str(path), made.model, made.notes, profile.gamma_table)
