"""How the instrument stands while a patch is read, and what a person must do to bring it there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from devices.errors import DeviceError
from devices.eyes import AnyEye

PatchEye = AnyEye
_DOWN: Mapping[int, str] = MappingProxyType({1: "top", 2: "middle", 3: "bottom"})
_ACROSS: Mapping[int, str] = MappingProxyType({1: "left", 2: "middle", 3: "right"})


@dataclass(frozen=True, slots=True)
class GridCell:
    """A cell of a grid of ``rows`` × ``columns`` over the screen; ``row`` and ``column`` count from 1 at the top left.

    Raises DeviceError if there is no such cell.
    """

    row: int
    column: int
    rows: int = 3
    columns: int = 3

    def __post_init__(self) -> None:
        if not (1 <= self.row <= self.rows and 1 <= self.column <= self.columns):
            raise DeviceError(f"a grid of {self.rows} × {self.columns} has no row {self.row}, column {self.column}")

    @property
    def centre(self) -> tuple[float, float]:
        """The cell's middle, across and down, as shares of the screen."""
        return (self.column - 0.5) / self.columns, (self.row - 0.5) / self.rows

    @property
    def window(self) -> tuple[float, float, float, float]:
        """The cell's left, top, right and bottom edges, as shares of the screen."""
        return (
            (self.column - 1) / self.columns,
            (self.row - 1) / self.rows,
            self.column / self.columns,
            self.row / self.rows,
        )

    def words(self) -> str:
        """Return the place in words."""
        cell = f"row {self.row}, column {self.column}"
        if (self.rows, self.columns) != (3, 3):
            return cell
        words = dict.fromkeys((_DOWN[self.row], _ACROSS[self.column]))
        return f"{cell}: {' '.join(words)}"


@dataclass(frozen=True, slots=True)
class Arrangement:
    """Which lens is before the instrument (``both`` for any), where it points, from what angle, and if with glasses.

    ``place`` is None for the middle of the screen; ``angle`` is as in a reading's name, such as ``20deg`` or
    ``v-10deg``, empty for straight ahead. ``screen_off``: the display is switched off, and the room lit.
    """

    eye: PatchEye = "both"
    place: GridCell | None = None
    angle: str = ""
    glasses: bool = True
    screen_off: bool = False

    def request(self, before: Arrangement) -> str:
        """Return what a person must do to come here from ``before``, in sentences; empty for nothing."""
        asked = []
        if self.screen_off and not before.screen_off:
            asked.append("Light the room as in the experiment, and switch the display off at its power button.")
        if before.screen_off and not self.screen_off:
            asked.append("Switch the display on again, and let it warm up.")
        if self.glasses != before.glasses:
            asked.append(
                "Put the glasses before the instrument again."
                if self.glasses
                else "Take the glasses away from before the instrument."
            )
        if self.glasses and (self.eye != before.eye or not before.glasses) and self.eye != "both":
            asked.append(f"Put the {self.eye} lens before the instrument.")
        if self.eye == "both" and before.eye != "both" and self.glasses and before.glasses:
            asked.append("Put either lens before the instrument, as at the beginning.")
        if self.place != before.place:
            asked.append(
                "Point the instrument at the middle of the screen."
                if self.place is None
                else f"Point the instrument at the patch ({self.place.words()})."
            )
        if self.angle != before.angle:
            asked.append(f"Aim the instrument at the middle of the screen from {angle_words(self.angle)}.")
        return " ".join(asked)


def degrees(angle: str) -> float:
    """Return the degrees of an angle in a reading's name: ``v-10deg`` is -10; 0 for an empty one."""
    return float(angle.lstrip("hv").removesuffix("deg")) if angle else 0.0


def angle_words(angle: str) -> str:
    """Return an angle of a reading's name in words: ``v-10deg`` is 10° below."""
    turned = degrees(angle)
    if turned == 0:
        return "straight ahead"
    sides = ("above", "below") if angle.startswith("v") else ("to the right", "to the left")
    return f"{abs(turned):g}° {sides[turned < 0]}"
