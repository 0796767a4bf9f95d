"""What a ``.ti3`` states of its readings: the device, the observer, the levels sent and the calibration in force.

ArgyllCMS's dispread writes the calibration that it was given (-k: loaded in the graphics card, -K: applied to the
codes) as a second table, CAL. Either way the panel received CAL(code), so that this is the code which gives the same
light through an identity table. Where that leaves no reading at code 0 or near full drive, the calibration stays the
graphics card's table of the readings instead. With -E each value v was sent as (16 + 219 v) / 255 [Argyll].
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from devices.display.gamma_table import GammaTable
from devices.errors import DeviceError
from devices.readings.cgats import CgatsTable
from devices.readings.code_range import ROUNDING, can_be_modelled
from devices.readings.table import CIE_1931_2, OBSERVERS, observer_name
from documents import Finding
from documents.arrays import Floats

_CAL_FIELDS = ("RGB_I", "RGB_R", "RGB_G", "RGB_B")
_COLOURS = ("red", "green", "blue")
# Less than a quarter of a code of 10 bits changes no verdict.
_SAME = 0.25 / 1023
_MOST_FINDINGS = 20


@dataclass(frozen=True, slots=True, eq=False)
class Statements:
    """``observer`` by name; ``calibration``: codes in equal or other steps and what they became, (k, 4), or None.

    ``codes`` in 0..1 are those of the file, shape (n, 3).
    """

    observer: str
    calibration: Floats | None
    codes: Floats

    @property
    def _departure(self) -> float:
        """The largest difference of the calibration from the identity, as a share of full code."""
        return (
            0.0 if self.calibration is None else float(np.abs(self.calibration[:, 1:] - self.calibration[:, :1]).max())
        )

    @property
    def _applies(self) -> bool:
        """Whether the codes that the panel received stand for those of the file, which else hold with the table."""
        return self.calibration is not None and can_be_modelled(self.calibration[0, 1:], self.codes, self._received)

    @property
    def _received(self) -> Floats:
        """The codes that the panel received, shape (n, 3)."""
        assert self.calibration is not None
        steps, values = self.calibration[:, 0], self.calibration[:, 1:]
        return np.stack([np.interp(self.codes[:, i], steps, values[:, i]) for i in range(3)], axis=1)

    @property
    def gamma_table(self) -> GammaTable | None:
        """The graphics card's table with which `codes_sent` hold, None where the file states none."""
        if self.calibration is None:
            return None
        if self._applies or self._departure <= _SAME:
            return GammaTable.identity(2)
        steps = np.concatenate([[0.0], self.calibration[1:-1, 0], [1.0]])
        return GammaTable.from_shares(self.calibration[:, 1:], steps)

    @property
    def codes_sent(self) -> Floats:
        """The codes in 0..1 that hold with `gamma_table`, shape (n, 3)."""
        return self.codes if self._departure <= _SAME or not self._applies else self._received

    def notes(self) -> list[str]:
        """Return what was taken for granted of the calibration, in sentences."""
        if self.calibration is None or self._departure <= _SAME:
            return []
        begin = (
            "the readings were taken through a calibration of the graphics card's table, up to "
            f"{self._departure:.2g} of full code from the identity"
        )
        highest = self.calibration[:, 1:].max(axis=0)
        short = [f"{name} {value:.3g}" for name, value in zip(_COLOURS, highest, strict=True) if value < 1 - _SAME]
        if not self._applies:
            lifts = bool(np.any(self.calibration[0, 1:] > ROUNDING))
            why = "lifts code 0" if lifts else f"sends no codes above {', '.join(short)}"
            return [f"{begin}, which {why}: the model holds only while this calibration is loaded"]
        notes = [f"{begin}; the codes are those that it sent, so that the model holds with an identity table"]
        if short:
            notes.append(f"the calibration sent no codes above {', '.join(short)}: what they give is extrapolated")
        return notes


def read_statements(table: CgatsTable, calibration: CgatsTable | None, codes: Floats) -> Statements:
    """Return what ``table`` and the CAL table after it, if there is one, state of the readings with ``codes`` (n, 3).

    Raises
    ------
    DeviceError
        With line and column: if these are no readings of a display driven over full range; if the observer is not
        known; if the calibration is not one of three channels over 0..1.
    """
    findings = [*_of_a_display(table), *_full_range(table)]
    if calibration is not None:
        findings += _full_range(calibration)
    observer = CIE_1931_2
    if (said := table.keywords.get("OBSERVER")) is not None:
        known = observer_name(said.text)
        if known is None:
            remedy = f"one of {', '.join(OBSERVERS)} (1931_2, 1964_10, 2012_2, 2012_10)"
            findings.append(table.finding(f"the observer '{said.text}' is not known", said, remedy))
        observer = known or observer
    curves = None if calibration is None else _calibration(calibration, findings)
    if findings:
        raise DeviceError(findings[:_MOST_FINDINGS])
    return Statements(observer, curves, codes)


def _of_a_display(table: CgatsTable) -> list[Finding]:
    findings = []
    if table.kind in ("CTI1", "CTI2"):
        at = table.fields[0]
        remedy = "the .ti3 that dispread writes"
        findings.append(table.finding(f"{table.kind} is a list of patches to measure, not of readings", at, remedy))
    device = table.keywords.get("DEVICE_CLASS")
    if device is not None and device.text.strip().upper() != "DISPLAY":
        remedy = "readings of a display: DISPLAY"
        findings.append(table.finding(f"DEVICE_CLASS is '{device.text}'", device, remedy))
    colours = table.keywords.get("COLOR_REP")
    if colours is not None and not colours.text.strip().upper().startswith("RGB"):
        findings.append(table.finding(f"COLOR_REP is '{colours.text}'", colours, "RGB_XYZ"))
    return findings


def _full_range(table: CgatsTable) -> list[Finding]:
    """Refuse codes of 16..235: of what 0..255 give, which are the codes sent here, such readings say nothing."""
    said = table.keywords.get("TV_OUTPUT_ENCODING")
    levels = table.keywords.get("OUTPUT_ENCODING")
    remedy = "set the display and the graphics card to full range (0..255), and measure without -E"
    if said is not None and said.text.strip().upper() != "NO":
        what = f"TV_OUTPUT_ENCODING is '{said.text}': the codes were sent as 16..235 of 255"
        return [table.finding(what, said, remedy)]
    if levels is not None and levels.text.split() not in (["0", "255"], ["0.0", "255.0"]):
        return [table.finding(f"OUTPUT_ENCODING is '{levels.text}', not 0 255", levels, remedy)]
    return []


def _calibration(table: CgatsTable, findings: list[Finding]) -> Floats | None:
    names = table.names()
    missing = [name for name in _CAL_FIELDS if name not in names]
    if missing:
        findings.append(
            table.finding(f"the calibration has no {', '.join(missing)}", table.fields[0], "calibrate again")
        )
        return None
    places = [names.index(name) for name in _CAL_FIELDS]
    before = len(findings)
    values = np.zeros((len(table.rows), 4))
    for index, row in enumerate(table.rows):
        for column, place in enumerate(places):
            value = _number(row[place].text)
            if not -ROUNDING <= value <= 1 + ROUNDING:
                what = f"{_CAL_FIELDS[column]} of the calibration is '{row[place].text}'"
                findings.append(table.finding(what, row[place], "a number in 0..1 is needed"))
            values[index, column] = value
    if len(findings) > before:
        return None
    values = np.clip(values, 0.0, 1.0)
    steps = values[:, 0]
    if len(steps) < 2 or np.any(np.diff(steps) <= 0) or steps[0] > _SAME or steps[-1] < 1 - _SAME:
        at = table.rows[0][places[0]]
        findings.append(table.finding("RGB_I of the calibration does not rise from 0 to 1", at, "calibrate again"))
        return None
    return values


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        return math.nan
    return value if math.isfinite(value) else math.nan


def calibration_lines(gamma_table: GammaTable | None) -> Sequence[str]:
    """Return the CAL table of a ``.ti3`` with ``gamma_table``; nothing where it is not known."""
    if gamma_table is None or not gamma_table.known:
        return []
    head = ["", "CAL", "", 'DESCRIPTOR "Device calibration state"', 'ORIGINATOR "cyclopean"', 'DEVICE_CLASS "DISPLAY"']
    head += ['COLOR_REP "RGB"', "", "NUMBER_OF_FIELDS 4", "BEGIN_DATA_FORMAT", " ".join(_CAL_FIELDS)]
    head += ["END_DATA_FORMAT", "", f"NUMBER_OF_SETS {gamma_table.size}", "BEGIN_DATA"]
    steps = np.linspace(0.0, 1.0, gamma_table.size)
    rows = [
        " ".join(f"{value:.7g}" for value in (step, *row))
        for step, row in zip(steps.tolist(), gamma_table.shares.tolist(), strict=True)
    ]
    return [*head, *rows, "END_DATA"]
