"""The monitor's own settings, as its menu gives them: when it was measured (display file) and in use (rig file).

No program reads them from the monitor; a person writes them down, as the thesis did in its Table 3.2 [Medina2016].
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import Field

from devices.errors import DeviceError
from documents import Finding, InputError
from documents.yaml import FileModel, Number, checked, parse_yaml, yaml_lines

Percent = Annotated[float, Field(ge=0, le=100)]
Level = Percent | Annotated[str, Field(min_length=1)]

# What changes the light by itself, with what is shown or with the room.
_BY_ITSELF = {
    "dynamic_contrast": "dynamic contrast is on: a patch's light changes with the rest of the picture",
    "local_dimming": "local dimming is on: a patch's light changes with what is around it",
    "automatic_brightness": "automatic brightness is on: the light changes with the room",
}


class GainsSpec(FileModel):
    """The gains of the channels in the monitor's menu, in percent."""

    red: Percent
    """The gain of the red channel, in percent."""
    green: Percent
    """The gain of the green channel, in percent."""
    blue: Percent
    """The gain of the blue channel, in percent."""


class MonitorSettings(FileModel):
    """What the monitor's menu says; whatever is not stated is not compared.

    ``preset``: the name of the mode, such as the thesis's ``Standard``. ``colour_temperature``: a name or kelvin.
    ``gamma_preset``: as the menu writes it. ``overdrive`` and ``lightboost`` (the strobed backlight of 3D modes):
    percent or a name. ``input_range``: what the monitor takes codes for, 0..255 or 16..235. ``other``: further entries
    by name.
    """

    preset: str | None = Field(default=None, min_length=1)
    """The monitor's preset, as its menu calls it."""
    brightness_percent: Percent | None = None
    """The brightness in the monitor's menu, in percent."""
    contrast_percent: Percent | None = None
    """The contrast in the monitor's menu, in percent."""
    colour_temperature: Annotated[float, Field(ge=1000, le=25000)] | str | None = None
    """The colour temperature in the monitor's menu."""
    gains_percent: GainsSpec | None = None
    """The gains of the channels in the monitor's menu."""
    saturation_percent: Percent | None = None
    """The saturation in the monitor's menu, in percent."""
    sharpness_percent: Percent | None = None
    """The sharpness in the monitor's menu, in percent."""
    gamma_preset: Number | str | None = None
    """The gamma preset in the monitor's menu."""
    overdrive: Level | None = None
    """The overdrive or response time in the monitor's menu."""
    lightboost: Level | None = None
    """The strobed backlight in the monitor's menu."""
    dynamic_contrast: bool | None = None
    """Whether dynamic contrast is on."""
    local_dimming: bool | None = None
    """Whether local dimming is on."""
    automatic_brightness: bool | None = None
    """Whether a light sensor changes the brightness."""
    input_range: Literal["full", "limited"] | None = None
    """Whether the monitor takes the full or the limited range of codes."""
    firmware: str | None = None
    """The monitor's firmware."""
    other: dict[str, bool | Number | str] = Field(default_factory=dict)
    """Other settings by their names."""

    @property
    def stated(self) -> dict[str, Any]:
        """Every entry that is stated, by a name such as ``gains_percent.red`` or ``other.Eye Saver``."""
        return dict(_flat(self.model_dump(mode="json", exclude_none=True)))

    @property
    def words(self) -> str:
        """All that is stated, in a line."""
        return ", ".join(f"{name.removeprefix('other.')} {_value(value)}" for name, value in self.stated.items())

    @property
    def doubts(self) -> tuple[str, ...]:
        """Sentences on what makes the light change by itself, or codes mean something else."""
        found = [words for name, words in _BY_ITSELF.items() if getattr(self, name)]
        if self.input_range == "limited":
            found.append("the monitor takes codes for 16..235: what lies beyond looks alike")
        return tuple(found)

    def differences(self, other: MonitorSettings) -> tuple[str, ...]:
        """Return what both state differently, such as ``brightness_percent 35, not 40`` (``other``'s second)."""
        mine, theirs = self.stated, other.stated
        return tuple(
            f"{name} {_value(value)}, not {_value(theirs[name])}"
            for name, value in mine.items()
            if name in theirs and theirs[name] != value
        )

    def to_text(self) -> str:
        """Return all that is stated as JSON on one line; empty if nothing is."""
        stated = self.model_dump(mode="json", exclude_none=True, exclude_defaults=True)
        return json.dumps(stated, ensure_ascii=False, sort_keys=False) if stated else ""

    @classmethod
    def parse(cls, text: str, file: str | None = None) -> MonitorSettings:
        """Read what `to_text` writes.

        Parameters
        ----------
        text
            JSON, or nothing.
        file
            The file that it stands in, for the message.

        Returns
        -------
        MonitorSettings
            The entries of ``text``.

        Raises
        ------
        DeviceError
            If it is no JSON object of such settings.
        """
        if not text.strip():
            return cls()
        try:
            return checked(parse_yaml(text, file or ""), cls)  # JSON is YAML
        except InputError as error:
            first = error.findings[0]
            remedy = 'write them as {"brightness_percent": 35}' + (f"; {first.remedy}" if first.remedy else "")
            raise DeviceError(
                Finding(f"the monitor's settings are wrong: {first.message}", file, remedy=remedy)
            ) from None

    def yaml_lines(self) -> list[str]:
        """Return the lines of a file's ``monitor_settings``, not indented; none if nothing is stated."""
        stated = self.model_dump(mode="json", exclude_none=True, exclude_defaults=True)
        return yaml_lines({"monitor_settings": stated}) if stated else []


def _flat(values: dict[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in values.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{before}{name}.")
        else:
            yield f"{before}{name}", value


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    return f"{value:g}" if isinstance(value, float) else str(value)
