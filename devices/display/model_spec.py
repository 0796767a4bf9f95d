"""What a display file holds of a mode: the display model of each eye, crosstalk and a gain map."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from devices.colour_matching import DEFAULT_OBSERVER, ObserverSpec
from devices.display.crosstalk import Crosstalk
from devices.display.gain_map import GainMap, Normalise, Positions
from devices.display.gamma_table_spec import GammaTableSpec
from devices.display.model import DisplayModel
from devices.display.plvc import Plvc
from devices.display.residual import MOST_KNOTS, Residual
from devices.display.srgb_curve import SrgbCurve
from devices.display.table_curve import TableCurve
from devices.display.tone_curve import Curve, ToneCurve, bt1886_curve
from devices.errors import DeviceError
from documents import Finding
from documents.yaml import NotNegative, Number, Positive, Strict

Triple = tuple[Number, Number, Number]
# The room's light from the screen while it is off, through the glasses, in cd/m².
AmbientSpec = tuple[NotNegative, NotNegative, NotNegative]
Matrix = tuple[Triple, Triple, Triple]


class PrimariesSpec(Strict):
    """XYZ of each channel at full drive minus black, in cd/m²."""

    red: Triple
    """XYZ of the red channel at full drive minus black, in cd/m²."""
    green: Triple
    """XYZ of the green channel at full drive minus black, in cd/m²."""
    blue: Triple
    """XYZ of the blue channel at full drive minus black, in cd/m²."""


class ChannelSpec(Strict):
    """One channel's curve: linear = max(0, gain · code + offset) ^ gamma + lift, code in 0..1."""

    gain: Positive = 1.0
    """The gain a of (a · code + b) ^ gamma + c."""
    offset: Number = 0.0
    """The offset b of (a · code + b) ^ gamma + c."""
    gamma: Positive
    """The exponent of the curve."""
    lift: Number = 0.0
    """The lift c of (a · code + b) ^ gamma + c."""


# What each kind of curve leaves fixed.
_FIXED = {"gog": ("lift",), "ggo": ("offset",), "gogo": (), "gamma": ("gain", "offset", "lift")}


class CurveSpec(Strict):
    """The tone curves of the three channels."""

    kind: Literal["gog", "gogo", "ggo", "gamma"]
    """Which kind of entry this is; it decides which other keys there are."""
    red: ChannelSpec
    """The tone curve of the red channel."""
    green: ChannelSpec
    """The tone curve of the green channel."""
    blue: ChannelSpec
    """The tone curve of the blue channel."""

    def curves(self) -> tuple[Curve, Curve, Curve]:
        """Return the curves of red, green and blue."""
        channels = (self.red, self.green, self.blue)
        for channel in channels:
            for name in _FIXED[self.kind]:
                if name in channel.model_fields_set:
                    raise DeviceError(f"a curve of kind '{self.kind}' has no '{name}'")
        red, green, blue = (ToneCurve(c.gain, c.offset, c.gamma, c.lift) for c in channels)
        return red, green, blue


class TableSpec(Strict):
    """One channel's curve as a table: the share of full light at each code; both rise from 0 to 1."""

    codes: Annotated[tuple[Number, ...], Field(min_length=3)]
    """Device codes from 0 to 1, rising."""
    light: Annotated[tuple[Number, ...], Field(min_length=3)]
    """The share of full light at each code."""


class TableCurveSpec(Strict):
    """The tone curves of the three channels as tables, joined by monotone cubics."""

    kind: Literal["table"]
    """Which kind of entry this is; it decides which other keys there are."""
    red: TableSpec
    """The tone curve of the red channel."""
    green: TableSpec
    """The tone curve of the green channel."""
    blue: TableSpec
    """The tone curve of the blue channel."""

    def curves(self) -> tuple[Curve, Curve, Curve]:
        """Return the curves of red, green and blue."""
        red, green, blue = (TableCurve(c.codes, c.light) for c in (self.red, self.green, self.blue))
        return red, green, blue


class SrgbCurveSpec(Strict):
    """The tone curve of sRGB (IEC 61966-2-1) in every channel."""

    kind: Literal["srgb"]
    """Which kind of entry this is; it decides which other keys there are."""

    def curves(self) -> tuple[Curve, Curve, Curve]:
        """Return the curves of red, green and blue."""
        return SrgbCurve(), SrgbCurve(), SrgbCurve()


class Bt1886CurveSpec(Strict):
    """The tone curve of ITU-R BT.1886 in every channel, for the panel's white and black: the mode's, or these."""

    kind: Literal["bt1886"]
    """Which kind of entry this is; it decides which other keys there are."""
    white_cd_m2: Positive | None = None
    """The luminance of the panel's white, in cd/m²; left out, the mode's."""
    black_cd_m2: NotNegative | None = None
    """The luminance of the panel's black, in cd/m²; left out, the mode's."""

    def curves(self, white_cd_m2: float, black_cd_m2: float) -> tuple[Curve, Curve, Curve]:
        """Return the curves of red, green and blue for the luminances of the mode's white and black."""
        curve = bt1886_curve(
            white_cd_m2 if self.white_cd_m2 is None else self.white_cd_m2,
            black_cd_m2 if self.black_cd_m2 is None else self.black_cd_m2,
        )
        return curve, curve, curve


class PlvcChannelSpec(TableSpec):
    """One channel's table, and its XYZ per share of light where √light is 0, 1/4, 1/2 and 3/4; at 1 the primary."""

    codes: Annotated[tuple[Number, ...], Field(min_length=3, max_length=4096)]
    """Device codes from 0 to 1, rising."""
    light: Annotated[tuple[Number, ...], Field(min_length=3, max_length=4096)]
    """The share of full light at each code."""
    XYZ_per_light_cd_m2: tuple[Triple, Triple, Triple, Triple]
    """The channel's XYZ per share of light at four levels, in cd/m²."""


class MixturesSpec(Strict):
    """XYZ that channels at full drive make of each other, and that the first's middle levels do while the other shines.

    The names' order is that of `devices.display.plvc.Plvc.mixtures_XYZ_cd_m2`.
    """

    red_green: Triple = (0.0, 0.0, 0.0)
    """XYZ that red and green at full drive add to or take from each other, in cd/m²."""
    red_blue: Triple = (0.0, 0.0, 0.0)
    """XYZ that red and blue at full drive add to or take from each other, in cd/m²."""
    green_blue: Triple = (0.0, 0.0, 0.0)
    """XYZ that green and blue at full drive add to or take from each other, in cd/m²."""
    red_green_blue: Triple = (0.0, 0.0, 0.0)
    """XYZ that all three channels at full drive add or take together, in cd/m²."""
    red_while_green: Triple = (0.0, 0.0, 0.0)
    """XYZ that red's middle levels add while green shines, in cd/m²."""
    red_while_blue: Triple = (0.0, 0.0, 0.0)
    """XYZ that red's middle levels add while blue shines, in cd/m²."""
    green_while_red: Triple = (0.0, 0.0, 0.0)
    """XYZ that green's middle levels add while red shines, in cd/m²."""
    green_while_blue: Triple = (0.0, 0.0, 0.0)
    """XYZ that green's middle levels add while blue shines, in cd/m²."""
    blue_while_red: Triple = (0.0, 0.0, 0.0)
    """XYZ that blue's middle levels add while red shines, in cd/m²."""
    blue_while_green: Triple = (0.0, 0.0, 0.0)
    """XYZ that blue's middle levels add while green shines, in cd/m²."""


class ResidualSpec(Strict):
    """What PLVC leaves over, as kernels at knots; see `devices.display.residual`."""

    width: Positive
    """How wide the kernels are."""
    knots: Annotated[tuple[Triple, ...], Field(min_length=1, max_length=MOST_KNOTS)]
    """The places of the kernels."""
    XYZ_cd_m2: Annotated[tuple[Triple, ...], Field(min_length=1, max_length=MOST_KNOTS)]
    """The weights of the kernels, XYZ in cd/m²."""

    def residual(self) -> Residual:
        """Return the residual; DeviceError if knots and XYZ do not go together."""
        return Residual(np.array(self.knots), self.width, np.array(self.XYZ_cd_m2))


class PlvcSpec(Strict):
    """Channels whose chromaticity varies with their level and that act on each other; see `devices.display.plvc`."""

    kind: Literal["plvc"]
    """Which kind of entry this is; it decides which other keys there are."""
    red: PlvcChannelSpec
    """The table of the red channel."""
    green: PlvcChannelSpec
    """The table of the green channel."""
    blue: PlvcChannelSpec
    """The table of the blue channel."""
    mixtures_XYZ_cd_m2: MixturesSpec = MixturesSpec()
    """What the channels do to each other."""
    residual: ResidualSpec | None = None
    """What the model leaves over, as kernels."""

    def curves(self) -> tuple[Curve, Curve, Curve]:
        """Return the curves of red, green and blue."""
        red, green, blue = (TableCurve(c.codes, c.light) for c in (self.red, self.green, self.blue))
        return red, green, blue

    def model(self, additive: DisplayModel) -> Plvc:
        """Return the model whose black, primaries and curves are those of ``additive``.

        Raises
        ------
        DeviceError
            If it cannot be undone.
        """
        model = Plvc(
            additive.black_XYZ_cd_m2,
            additive.primaries_XYZ_cd_m2,
            additive.curves,
            np.array([channel.XYZ_per_light_cd_m2 for channel in (self.red, self.green, self.blue)]),
            np.array([getattr(self.mixtures_XYZ_cd_m2, name) for name in MixturesSpec.model_fields]),
            None if self.residual is None else self.residual.residual(),
        )
        try:
            assert model.steps
        except DeviceError as error:
            raise DeviceError(
                Finding(str(error), remedy="check the numbers, or fit again with --model table")
            ) from error
        return model


class ModelSpec(Strict):
    """One characterisation, measured through the glasses in its stereo mode."""

    black_XYZ_cd_m2: Triple
    """XYZ of black, in cd/m²."""
    primaries_XYZ_cd_m2: PrimariesSpec
    """XYZ of each channel at full drive minus black, in cd/m²."""
    curve: Annotated[
        CurveSpec | TableCurveSpec | SrgbCurveSpec | Bt1886CurveSpec | PlvcSpec, Field(discriminator="kind")
    ]
    """The tone curves of the channels."""
    observer: ObserverSpec = DEFAULT_OBSERVER
    """The colorimetric observer of the XYZ, such as CIE 1931 2 or CIE 1964 10."""
    source: str = ""
    """Where the numbers come from, in words."""
    gamma_table: GammaTableSpec | None = None
    """The graphics card's gamma table that was loaded while this was measured."""
    ambient_XYZ_cd_m2: AmbientSpec | None = None
    """The room's light from the screen while it is off, XYZ in cd/m²."""

    def model(self) -> DisplayModel:
        """Return the display model."""
        primaries = self.primaries_XYZ_cd_m2
        columns = np.array([primaries.red, primaries.green, primaries.blue]).T
        black_cd_m2 = self.black_XYZ_cd_m2[1]
        curves = (
            self.curve.curves(float(black_cd_m2 + columns[1].sum()), black_cd_m2)
            if isinstance(self.curve, Bt1886CurveSpec)
            else self.curve.curves()
        )
        additive = DisplayModel(np.array(self.black_XYZ_cd_m2), columns, curves)
        model = self.curve.model(additive) if isinstance(self.curve, PlvcSpec) else additive
        return model if self.ambient_XYZ_cd_m2 is None else model.in_room(self.ambient_XYZ_cd_m2)


class CrosstalkSpec(Strict):
    """What leaks into each eye: seen = own + matrix · other, in XYZ above black; three rows of three numbers each."""

    left: Matrix
    """What reaches the left eye of the right eye's light: three rows of three numbers."""
    right: Matrix
    """What reaches the right eye of the left eye's light: three rows of three numbers."""
    source: str = ""
    """Where the numbers come from, in words."""

    def crosstalk(self) -> Crosstalk:
        """Return the crosstalk; DeviceError if it cannot be undone."""
        return Crosstalk(np.array(self.left), np.array(self.right))


class GainMapSpec(Strict):
    """Luminance readings over the panel, top row first, in one unit; see `devices.display.gain_map.GainMap`."""

    luminance: Annotated[list[Annotated[list[Positive], Field(min_length=1)]], Field(min_length=1)]
    """Readings of luminance over the panel, top row first, in one unit."""
    positions: Positions
    """Where on the panel the readings were taken."""
    normalise: Normalise
    """Which reading counts as 1."""
    source: str = ""
    """Where the numbers come from, in words."""

    def gain_map(self, resolution_px: tuple[int, int]) -> GainMap:
        """Return the gain map of a panel; DeviceError if the rows differ in length or are too few."""
        lengths = [len(row) for row in self.luminance]
        if len(set(lengths)) > 1:
            raise DeviceError(
                f"the rows of the gain map hold {', '.join(map(str, lengths))} readings; all need as many"
            )
        return GainMap(np.array(self.luminance), resolution_px, self.positions, self.normalise)
