"""The table of measures of two pictures: for each eye and for both."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from devices.colour_matching import DEFAULT_OBSERVER
from devices.eyes import AnyEye
from documents.pages import Cell, Column, ShownAs, Table
from documents.text import JsonResult
from stimuli.errors import StimulusError
from stimuli.measures.measure import EyeMeasured, Measure
from stimuli.measures.registry import package_of
from stimuli.measures.viewing import ViewingConditions


@dataclass(frozen=True, eq=False, slots=True)
class MeasureRow(JsonResult):
    """What one measure says: of each eye, ``both`` for a flat picture, and ``binocular``, None for a flat picture."""

    measure: Measure
    eyes: Mapping[AnyEye, EyeMeasured]
    binocular: float | None

    json_keys: ClassVar = {"values": "*"}
    json_names: ClassVar = "measure.name measure.title measure.unit measure.better measure.identical values remarks"

    @property
    def values(self) -> dict[str, float]:
        """The value of each eye, and of both where there are two; only those of identical pictures are infinite."""
        both = {} if self.binocular is None else {"binocular": self.binocular}
        return {**{str(eye): measured.value for eye, measured in self.eyes.items()}, **both}

    @property
    def remarks(self) -> tuple[str, ...]:
        """What was assumed of either eye, each once, and whose measure it is where it is not ours."""
        said = dict.fromkeys(remark for measured in self.eyes.values() for remark in measured.remarks)
        return (*said, *package_of(self.measure.name))


@dataclass(frozen=True, eq=False, slots=True)
class MeasureTable:
    """The measures of two pictures, one row each; ``left_out`` says which could not be made, and why."""

    rows: tuple[MeasureRow, ...]
    viewing: ViewingConditions
    left_out: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> MeasureRow:
        """Return the row of the measure of that name."""
        for row in self.rows:
            if row.measure.name == name:
                return row
        raise KeyError(name)

    def binocular(self, name: str) -> float:
        """Return the value of a measure for both eyes. Raises StimulusError for flat pictures, which have none."""
        value = self[name].binocular
        if value is None:
            raise StimulusError.of(
                f"the pictures are flat, and '{name}' has no value for two eyes",
                "give pairs for two eyes, or take the value of the one picture",
            )
        return value

    def remarks(self) -> list[str]:
        """Return what was assumed, each once."""
        remarks = {
            f"{eye} eye: {remark}" if eye != "both" else remark: None
            for row in self.rows
            for eye, measured in row.eyes.items()
            for remark in measured.remarks
        }
        for row in self.rows:
            remarks |= {f"{row.measure.title}: {remark}": None for remark in package_of(row.measure.name)}
        observer = self.viewing.observer
        if observer not in (None, DEFAULT_OBSERVER):
            of = f"measures of pictures are defined for {DEFAULT_OBSERVER}, and they take XYZ for {observer} here"
            remarks[of] = None
        return [*self.left_out, *remarks]

    def told(self) -> Table:
        """Return the table for a page, the terminal or a notebook."""
        pair = any(row.binocular is not None for row in self.rows)
        headings = ("left", "right", "both eyes") if pair else ("value",)
        columns = (
            Column("Measure", "measure"),
            *(Column(heading, heading, "number") for heading in headings),
            Column("closer is", "better"),
            Column("identical pictures", "identical pictures", "number"),
            Column("source", "source"),
        )
        rows: list[tuple[Cell, ...]] = []
        for row in self.rows:
            measure, values = row.measure, (*row.values.values(), row.measure.identical)
            *numbers, same = (ShownAs(value, printed(value, measure)) for value in values)
            rows.append((measure.title, *numbers, measure.better, same, measure.source))
        return Table("measures", "", columns, tuple(rows))


def printed(value: float, measure: Measure) -> str:
    """Return a value with its unit: four significant digits, more where it would look like that of identical pictures.

    Infinity is ``∞``.
    """
    if np.isinf(value):
        number = "∞"
    else:
        texts = [f"{value:.{digits}g}" for digits in (4, 6, 8, 10)]
        same = f"{measure.identical:.4g}"
        number = next((text for text in texts if text != same or value == measure.identical), texts[-1])
    return f"{number} {measure.unit}".rstrip()
