"""What a display file holds of a mode: the display model of each eye, crosstalk and a gain map."""

from __future__ import annotations

from collections.abc import Mapping
from inspect import getattr_static
from itertools import product
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, ValidationError, model_validator

from devices.colour_matching import DEFAULT_OBSERVER, ObserverSpec
from devices.display.crosstalk import Crosstalk
from devices.display.curves import Curve, SrgbCurve, TableCurve, ToneCurve, bt1886_curve
from devices.display.gain_map import GainMap, Normalise, Positions
from devices.display.gamma_table import GammaTable
from devices.display.model import DisplayModel
from devices.display.plvc import Plvc
from devices.display.residual import MOST_KNOTS, Residual
from devices.errors import DeviceError
from documents import Finding
from documents.arrays import Floats
from documents.extensions import Registry, of_base
from documents.yaml import ByKind, FileModel, NotNegative, Number, Positive, yaml_lines


class GammaTableSpec(FileModel):
    """A gamma table: its hash, largest departure from the identity, size and entries; or why it is unknown.

    The identity needs no entries. ``display fit`` writes it from the readings.
    """

    hash: str | None = None
    """The SHA-256 of the table's entries."""
    departure_codes: NotNegative | None = None
    """The largest departure from the identity, in codes."""
    size: int | None = Field(default=None, ge=2, le=65536)
    """How many entries the table has."""
    entries: str | None = None
    """The entries, packed as text."""
    unknown: str | None = Field(default=None, min_length=1)
    """Why the table is not known."""

    def table(self) -> GammaTable:
        """Return the table; DeviceError if the keys do not make one."""
        held = self.model_dump(exclude_none=True)
        if self.unknown is not None and len(held) > 1:
            raise DeviceError("a gamma table that is unknown has no other key")
        return GammaTable.from_json(held)


COLOURS = ("red", "green", "blue")
Triple = tuple[Number, Number, Number]
# The room's light from the screen while it is off, through the glasses, in cd/m².
AmbientSpec = tuple[NotNegative, NotNegative, NotNegative]
Matrix = tuple[Triple, Triple, Triple]


class PrimariesSpec(FileModel):
    """XYZ of each channel at full drive minus black, in cd/m²."""

    red: Triple
    """XYZ of the red channel at full drive minus black, in cd/m²."""
    green: Triple
    """XYZ of the green channel at full drive minus black, in cd/m²."""
    blue: Triple
    """XYZ of the blue channel at full drive minus black, in cd/m²."""


class DisplayCurves(FileModel):
    """The tone curves of the three channels: a kind that display files name."""

    kind: str
    """Which kind of entry this is; it decides which other keys there are."""

    @property
    def channels(self) -> tuple[Curve, Curve, Curve]:
        """The curves of red, green and blue, where they are written one by one."""
        red, green, blue = (getattr(self, colour) for colour in COLOURS)
        return red, green, blue

    def model(self, black_XYZ_cd_m2: Floats, primaries_XYZ_cd_m2: Floats) -> DisplayModel:
        """Return the display model of these curves; XYZ of black (3,), and of the channels at full drive, columns."""
        return DisplayModel(black_XYZ_cd_m2, primaries_XYZ_cd_m2, self.channels)

    @classmethod
    def fitted(cls, codes: Floats, XYZ_cd_m2: Floats, begin: DisplayModel) -> tuple[DisplayModel, int]:
        """Return the model of such curves fitted to readings, and how many of its numbers were free.

        ``codes`` (n, 3) in 0..1, their light (n, 3), and the best GOGO model of them to ``begin`` with.
        """
        raise NotImplementedError(cls.__name__)  # those that do not say how: `can_be_fitted`

    @classmethod
    def can_be_fitted(cls) -> bool:
        """Whether they say how they are `fitted`."""
        return getattr_static(cls, "fitted") is not getattr_static(DisplayCurves, "fitted")

    @classmethod
    def written(cls, model: DisplayModel) -> dict[str, Any]:
        """Return the curves of ``model`` as a file has them; DeviceError where these cannot be."""
        raise DeviceError(f"curves of the kind '{model.curves[0].kind_of_curve}' cannot be written from a model")


# What each kind of the GOGO family leaves fixed.
_FIXED = {"gamma": ("gain", "offset", "lift"), "gog": ("lift",), "ggo": ("offset",), "gogo": ()}


class ToneCurves(DisplayCurves):
    """The tone curves of the three channels."""

    kind: Literal["gog", "gogo", "ggo", "gamma"]
    """Which kind of entry this is; it decides which other keys there are."""
    red: ToneCurve
    """The tone curve of the red channel."""
    green: ToneCurve
    """The tone curve of the green channel."""
    blue: ToneCurve
    """The tone curve of the blue channel."""

    @model_validator(mode="after")
    def _fixed_numbers_are_left_out(self) -> Self:
        for colour, name in product(COLOURS, _FIXED[self.kind]):
            if name in getattr(self, colour).model_fields_set:
                raise ValueError(f"a curve of kind '{self.kind}' has no '{name}'")
        return self

    @classmethod
    def written(cls, model: DisplayModel) -> dict[str, Any]:
        """Return the curves of ``model`` as a file has them: offset and lift rounded, of the simplest kind."""
        curves = [curve.model_dump() for curve in model.curves]
        usual = {"gain": 1.0, "offset": 0.0, "lift": 0.0}
        changed = {name for name, value in usual.items() if any(curve[name] != value for curve in curves)}
        kind = "gogo" if "lift" in changed else "gog" if changed else "gamma"
        names = [name for name in ToneCurve.model_fields if name not in _FIXED[kind]]
        rounded = {"gain": float, "gamma": float}
        channels = [{name: rounded.get(name, ten_digits)(curve[name]) for name in names} for curve in curves]
        return {"kind": kind, **dict(zip(COLOURS, channels, strict=True))}


class TableCurves(DisplayCurves):
    """The tone curves of the three channels as tables, joined by monotone cubics."""

    kind: Literal["table"]
    """Which kind of entry this is; it decides which other keys there are."""
    red: TableCurve
    """The tone curve of the red channel."""
    green: TableCurve
    """The tone curve of the green channel."""
    blue: TableCurve
    """The tone curve of the blue channel."""

    @classmethod
    def written(cls, model: DisplayModel) -> dict[str, Any]:
        """Return the curves of ``model`` as a file has them."""
        channels = [ten_digits(curve.model_dump(include={"codes", "light"})) for curve in model.curves]
        return {"kind": "table", **dict(zip(COLOURS, channels, strict=True))}


class SrgbCurves(DisplayCurves):
    """The tone curve of sRGB (IEC 61966-2-1) in every channel."""

    kind: Literal["srgb"]
    """Which kind of entry this is; it decides which other keys there are."""

    @property
    def channels(self) -> tuple[Curve, Curve, Curve]:
        """The curves of red, green and blue."""
        return SrgbCurve(), SrgbCurve(), SrgbCurve()

    @classmethod
    def written(cls, model: DisplayModel) -> dict[str, Any]:
        """Return the curves of ``model`` as a file has them."""
        return {"kind": "srgb"}


class Bt1886Curves(DisplayCurves):
    """The tone curve of ITU-R BT.1886 in every channel, for the panel's white and black: the mode's, or these."""

    kind: Literal["bt1886"]
    """Which kind of entry this is; it decides which other keys there are."""
    white_cd_m2: Positive | None = None
    """The luminance of the panel's white, in cd/m²; left out, the mode's."""
    black_cd_m2: NotNegative | None = None
    """The luminance of the panel's black, in cd/m²; left out, the mode's."""

    def model(self, black_XYZ_cd_m2: Floats, primaries_XYZ_cd_m2: Floats) -> DisplayModel:
        """Return the display model; DeviceError where the white is not above the black."""
        black_cd_m2 = float(black_XYZ_cd_m2[1])
        curve = bt1886_curve(
            float(black_cd_m2 + primaries_XYZ_cd_m2[1].sum()) if self.white_cd_m2 is None else self.white_cd_m2,
            black_cd_m2 if self.black_cd_m2 is None else self.black_cd_m2,
        )
        return DisplayModel(black_XYZ_cd_m2, primaries_XYZ_cd_m2, (curve, curve, curve))


class PlvcChannel(TableCurve):
    """One channel's table, and its XYZ per share of light where √light is 0, 1/4, 1/2 and 3/4; at 1 the primary."""

    codes: Annotated[tuple[Number, ...], Field(min_length=3, max_length=4096)]
    """Device codes from 0 to 1, rising."""
    light: Annotated[tuple[Number, ...], Field(min_length=3, max_length=4096)]
    """The share of full light at each code."""
    XYZ_per_light_cd_m2: tuple[Triple, Triple, Triple, Triple]
    """The channel's XYZ per share of light at four levels, in cd/m²."""


class MixturesSpec(FileModel):
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


class ResidualSpec(FileModel):
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


class PlvcCurves(DisplayCurves):
    """Channels whose chromaticity varies with their level and that act on each other; see `devices.display.plvc`."""

    kind: Literal["plvc"]
    """Which kind of entry this is; it decides which other keys there are."""
    red: PlvcChannel
    """The table of the red channel."""
    green: PlvcChannel
    """The table of the green channel."""
    blue: PlvcChannel
    """The table of the blue channel."""
    mixtures_XYZ_cd_m2: MixturesSpec = MixturesSpec()
    """What the channels do to each other."""
    residual: ResidualSpec | None = None
    """What the model leaves over, as kernels."""

    def model(self, black_XYZ_cd_m2: Floats, primaries_XYZ_cd_m2: Floats) -> Plvc:
        """Return the display model; DeviceError if it cannot be undone."""
        model = Plvc(
            black_XYZ_cd_m2,
            primaries_XYZ_cd_m2,
            self.channels,
            np.array([channel.XYZ_per_light_cd_m2 for channel in (self.red, self.green, self.blue)]),
            np.array(list(self.mixtures_XYZ_cd_m2.model_dump().values())),
            None if self.residual is None else self.residual.residual(),
        )
        try:
            assert model.steps
        except DeviceError as error:
            raise DeviceError(
                Finding(str(error), remedy="check the numbers, or fit again with --model table")
            ) from error
        return model

    @classmethod
    def written(cls, model: DisplayModel) -> dict[str, Any]:
        """Return the curves of ``model``, and what its channels do to each other, as a file has them."""
        assert isinstance(model, Plvc)
        curves = TableCurves.written(model) | {"kind": "plvc"}
        for colour, rows in zip(COLOURS, model.XYZ_per_light_cd_m2.tolist(), strict=True):
            curves[colour]["XYZ_per_light_cd_m2"] = ten_digits(rows)
        mixtures = zip(MixturesSpec.model_fields, model.mixtures_XYZ_cd_m2.tolist(), strict=True)
        curves["mixtures_XYZ_cd_m2"] = ten_digits(dict(mixtures))
        if model.residual is not None:
            curves["residual"] = ten_digits({key: getattr(model.residual, key) for key in ResidualSpec.model_fields})
        return curves


# By what a display file names them: ours, and those of other packages (`docs/extend.md`).
CURVES: Registry[type[DisplayCurves]] = Registry(
    "cyclopean.models",
    {
        **dict.fromkeys(("gog", "gogo", "ggo", "gamma"), "devices.display.model_spec:ToneCurves"),
        "table": "devices.display.model_spec:TableCurves",
        "srgb": "devices.display.model_spec:SrgbCurves",
        "bt1886": "devices.display.model_spec:Bt1886Curves",
        "plvc": "devices.display.model_spec:PlvcCurves",
    },
    of_base(DisplayCurves),
)


class ModelSpec(FileModel):
    """One characterisation, measured through the glasses in its stereo mode."""

    black_XYZ_cd_m2: Triple
    """XYZ of black, in cd/m²."""
    primaries_XYZ_cd_m2: PrimariesSpec
    """XYZ of each channel at full drive minus black, in cd/m²."""
    curve: Annotated[DisplayCurves, ByKind(CURVES)]
    """The tone curves of the channels."""
    observer: ObserverSpec = DEFAULT_OBSERVER
    """The colorimetric observer of the XYZ, such as CIE 1931 2 or CIE 1964 10."""
    source: str = ""
    """Where the numbers come from, in words."""
    gamma_table: GammaTableSpec | None = None
    """The graphics card's gamma table that was loaded while this was measured."""
    ambient_XYZ_cd_m2: AmbientSpec | None = None
    """The room's light from the screen while it is off, XYZ in cd/m²."""

    @classmethod
    def of(cls, model: DisplayModel, *, observer: str = DEFAULT_OBSERVER, **beside: Any) -> Self:
        """Return what a file writes of ``model``, its ``observer`` and ``beside`` it, such as its ``source``.

        Numbers are kept to ten digits, gain and gamma to the last.
        """
        kind = CURVES.wanted(model.curves[0].kind_of_curve if model.additive else "plvc", "kind of curve", DeviceError)
        primaries = ten_digits(dict(zip(COLOURS, model.primaries_XYZ_cd_m2.T.tolist(), strict=True)))
        black = ten_digits(model.black_XYZ_cd_m2.tolist())
        given = {"black_XYZ_cd_m2": black, "primaries_XYZ_cd_m2": primaries, "curve": kind.written(model)}
        given |= {"observer": observer, **{key: value for key, value in beside.items() if value is not None}}
        try:
            return cls.model_validate(given)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            raise DeviceError(f"{'.'.join(map(str, first['loc']))} cannot be written: {first['msg']}") from None

    def lines(self) -> list[str]:
        """Return it as lines of YAML, not indented."""
        return yaml_lines(self.model_dump(exclude_unset=True))

    def model(self) -> DisplayModel:
        """Return the display model."""
        primaries = self.primaries_XYZ_cd_m2
        columns = np.array([primaries.red, primaries.green, primaries.blue]).T
        with CURVES.blamed(self.curve.kind):
            model = self.curve.model(np.array(self.black_XYZ_cd_m2), columns)
        return model if self.ambient_XYZ_cd_m2 is None else model.in_room(self.ambient_XYZ_cd_m2)


def ten_digits(value: Any) -> Any:
    """Return numbers, in lists and by key, to ten digits: what a display file holds of a fit."""
    if isinstance(value, Mapping):
        return {key: ten_digits(inner) for key, inner in value.items()}
    return float(f"{value:.10g}") if np.ndim(value) == 0 else [ten_digits(inner) for inner in value]


class CrosstalkSpec(FileModel):
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


class GainMapSpec(FileModel):
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
