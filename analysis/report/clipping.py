"""What the display could not show of each stimulus, by eye."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from analysis.records.session_record import Header

EYES = ("left", "right")


@dataclass(frozen=True, slots=True)
class ClippingRow:
    """A stimulus in one eye: percent of pixels out of gamut, and the clip's cost in ΔE00; None where not recorded."""

    stimulus: str
    eye: str
    percent_any: float | None
    percent_above_full: float | None
    delta_e_00_mean: float | None
    delta_e_00_max: float | None


def clipping_rows(header: Header, names: Sequence[str]) -> list[ClippingRow]:
    """Return one row per stimulus and eye, in the order of ``names``; one row for both eyes where they are equal."""
    known = {str(stimulus["name"]): stimulus for stimulus in header.stimuli}
    rows = []
    for name in names:
        clipping = known.get(name, {}).get("clipping") or {}
        both = [_row(name, eye, clipping[eye]) for eye in EYES if eye in clipping]
        if len(both) == 2 and _numbers(both[0]) == _numbers(both[1]):
            both = [_row(name, "both", clipping["left"])]
        rows += both
    return rows


def _row(name: str, eye: str, cost: dict[str, float]) -> ClippingRow:
    keys = ("percent_any", "percent_above_full", "delta_e_00_mean", "delta_e_00_max")
    return ClippingRow(name, eye, *(cost.get(key) for key in keys))


def _numbers(row: ClippingRow) -> tuple[float | None, ...]:
    return row.percent_any, row.percent_above_full, row.delta_e_00_mean, row.delta_e_00_max
