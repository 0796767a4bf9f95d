"""The key ``observer`` of a file: a colorimetric observer by name, or by field and age."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from devices.colour_matching.observers import AGE_YEARS, FIELD_DEG, canonical_name, cie_2006_name
from devices.errors import DeviceError
from documents.yaml import FileModel


class Cie2006Spec(FileModel):
    """The observer of CIE 170 for an age and a field of view."""

    kind: Literal["cie2006"]
    """Which kind of entry this is; it decides which other keys there are."""
    age_years: Annotated[float, Field(ge=AGE_YEARS[0], le=AGE_YEARS[1])]
    """The age of the observer in years."""
    field_deg: Annotated[float, Field(ge=FIELD_DEG[0], le=FIELD_DEG[1])]
    """The field of view in degrees."""


def _name(value: str | Cie2006Spec) -> str:
    if isinstance(value, Cie2006Spec):
        return cie_2006_name(value.field_deg, value.age_years)
    try:
        return canonical_name(value)
    except DeviceError as error:
        finding = error.findings[0]
        raise ValueError(finding.remedy or finding.message) from error


ObserverSpec = Annotated[str | Cie2006Spec, AfterValidator(_name)]
