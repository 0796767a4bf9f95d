"""Records of a photodiode's verification: how far light changed from when the program recorded that it did.

A small YAML file that a rig names. It holds for the stereo mode, refresh rate and, where named, display server and
renderer that it was measured with, and for no other.
"""

from __future__ import annotations

import datetime
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from documents import load_document, sha256_of_file
from documents.yaml import FileModel, Natural, NotNegative, Number, Positive

# Window systems report the refresh rate in whole hertz, and rates such as 59.94 and 119.88 Hz are called 60 and 120.
REFRESH_TOLERANCE = 0.02


def _day(value: Any) -> datetime.date:
    if not isinstance(value, str):
        raise ValueError("expected a day such as 2026-03-14")
    try:
        return datetime.date.fromisoformat(value)
    except ValueError:
        raise ValueError("expected a day such as 2026-03-14") from None


class OnsetErrorSpec(FileModel):
    """The photodiode's onset minus the recorded onset, in ms: positive where light came later than recorded.

    ``worst`` is the error of the largest magnitude, with its sign.
    """

    mean: Number
    """The mean error, in ms."""
    standard_deviation: NotNegative
    """The standard deviation of the errors, in ms."""
    worst: Number
    """The error furthest from 0, with its sign, in ms."""

    @model_validator(mode="after")
    def _worst_is_no_better_than_the_mean(self) -> OnsetErrorSpec:
        if abs(self.worst) < abs(self.mean):
            raise ValueError("'worst' is the error furthest from 0, and cannot be nearer to it than 'mean'")
        return self


class VerificationSpec(FileModel):
    """A record of a photodiode's verification."""

    schema_version: Literal[1]
    """The version of the file format: 1."""
    date: Annotated[datetime.date, BeforeValidator(_day)]
    """The day of the verification, such as 2026-03-14."""
    instrument: Annotated[str, Field(min_length=1)]
    """The instrument, in words."""
    mode: Annotated[str, Field(min_length=1)]
    """The stereo mode, such as side-by-side."""
    refresh_hz: Positive
    """The refresh rate, in Hz."""
    display_server: str = ""
    """The display server, such as X11."""
    renderer: str = ""
    """The graphics card and driver."""
    onsets: Annotated[Natural, Field(ge=2)]
    """How many onsets were verified."""
    onset_error_ms: OnsetErrorSpec
    """The photodiode's onset minus the recorded one, in ms."""
    left_onset_error_ms: OnsetErrorSpec | None = None
    """The same for the left eye alone."""
    right_onset_error_ms: OnsetErrorSpec | None = None
    """The same for the right eye alone."""
    notes: str = ""
    """Anything else, in words."""


@dataclass(frozen=True, slots=True)
class Verification:
    """A record, where it stands, and the SHA-256 of its file."""

    file: str
    spec: VerificationSpec
    sha256: str

    def mismatches(
        self,
        *,
        mode: str,
        refresh_hz: float | None = None,
        display_server: str | None = None,
        renderer: str | None = None,
    ) -> tuple[str, ...]:
        """Return in what the record differs from what is given, a phrase each; empty where it holds.

        What is None is not known yet and is not compared; nor are display server and renderer where the record names
        none. Refresh rates are the same within 2 %.
        """
        spec = self.spec
        differences = []
        if mode != spec.mode:
            differences.append(f"measured in the mode '{spec.mode}', not '{mode}'")
        if refresh_hz is not None and abs(refresh_hz / spec.refresh_hz - 1.0) > REFRESH_TOLERANCE:
            differences.append(f"measured at {spec.refresh_hz:g} Hz, not {refresh_hz:.4g} Hz")
        for what, measured, here in (
            ("display server", spec.display_server, display_server),
            ("renderer", spec.renderer, renderer),
        ):
            if measured and here is not None and measured != here:
                differences.append(f"measured with the {what} '{measured}', not '{here}'")
        return tuple(differences)

    def sentence(self) -> str:
        """Return what was verified, in a sentence without its full stop."""
        spec, error = self.spec, self.spec.onset_error_ms
        return (
            f"verified with a photodiode on {spec.date.isoformat()}: in {spec.onsets} onsets light came "
            f"{error.mean:g} ms after the recorded onset on average (standard deviation "
            f"{error.standard_deviation:g} ms, worst {error.worst:g} ms)"
        )

    def to_json(self) -> dict[str, Any]:
        """Return the contents with the file's name and SHA-256, for a session's header."""
        contents = self.spec.model_dump(mode="json", exclude_none=True)
        return {"file": Path(self.file).name, "sha256": self.sha256, **contents}


def read_verification(path: Path) -> Verification:
    """Read the record at ``path``.

    Parameters
    ----------
    path
        The record of how a photodiode checked the onsets of pictures, YAML.

    Returns
    -------
    Verification
        The record, with the SHA-256 of the file.

    Raises
    ------
    InputError
        With every fault's file, line, column and remedy.
    """
    spec, source = load_document(path, VerificationSpec, "verification")
    return Verification(source.file, spec, sha256_of_file(path))
