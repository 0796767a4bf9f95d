"""What a display file may hold, key by key: the panel, modes that were measured, a nominal display for all others."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, Discriminator, Field, Tag, model_validator

from devices.colour_matching import DEFAULT_OBSERVER, mixed_observers
from devices.display.held_out import HeldOut
from devices.display.model import EYES, Eye, EyeModels
from devices.display.model_spec import AmbientSpec, CrosstalkSpec, GainMapSpec, GammaTableSpec, ModelSpec
from devices.display.monitor_settings import MonitorSettings
from devices.display.nominal import Nominal, refuse_black
from devices.display.options import NominalKind
from devices.display.panel import PanelSpec
from devices.errors import DeviceError
from documents.yaml import FileModel, NotNegative, Positive


class SameAsSpec(FileModel):
    """A mode whose light is that of another mode: same panel state and glasses, other signal."""

    same_as: str
    """The mode whose measurements serve: same panel state and glasses, another signal."""


class _ExtrasSpec(FileModel):
    """What a mode holds of both eyes at once."""

    crosstalk: CrosstalkSpec | None = None
    """What leaks between the eyes."""
    gain_map: GainMapSpec | None = None
    """How evenly the panel shines."""
    monitor_settings: MonitorSettings | None = None
    """What the monitor's own menu said."""


class BothEyesSpec(ModelSpec, _ExtrasSpec):
    """A mode with one characterisation for both eyes."""

    def eye_models(self) -> EyeModels:
        """Return the model, the same object for both eyes."""
        model = self.model()
        return EyeModels(model, model)

    @property
    def held_out(self) -> dict[Eye, HeldOut]:
        """What is stated of how far the characterisation is from readings that it was not fitted to."""
        stated = HeldOut.stated_in(self.source)
        return {} if stated is None else dict.fromkeys(EYES, stated)

    def ambient_specs(self) -> dict[Eye, AmbientSpec | None]:
        """Return the mode's own word on the room's light, for each eye."""
        return dict.fromkeys(EYES, self.ambient_XYZ_cd_m2)

    def gamma_table_specs(self) -> dict[Eye, GammaTableSpec | None]:
        """Return what is said of the gamma table, for each eye."""
        return dict.fromkeys(EYES, self.gamma_table)


class PerEyeSpec(_ExtrasSpec):
    """A mode characterised through each lens, or through one so far: then no session can use it yet."""

    left: ModelSpec | None = None
    """The characterisation through the left lens."""
    right: ModelSpec | None = None
    """The characterisation through the right lens."""

    @property
    def source(self) -> str:
        """Where the numbers come from."""
        return next((spec.source for spec in (self.left, self.right) if spec), "")

    @property
    def held_out(self) -> dict[Eye, HeldOut]:
        """What is stated of how far each eye's characterisation is from readings that it was not fitted to."""
        stated = {eye: HeldOut.stated_in(spec.source) if spec else None for eye, spec in self._eyes.items()}
        return {eye: errors for eye, errors in stated.items() if errors is not None}

    @property
    def _eyes(self) -> dict[Eye, ModelSpec | None]:
        return {"left": self.left, "right": self.right}

    @property
    def observer(self) -> str:
        """The colorimetric observer of the XYZ."""
        return next((str(spec.observer) for spec in (self.left, self.right) if spec), DEFAULT_OBSERVER)

    def lacking(self) -> tuple[Eye, ...]:
        """Return the eyes without a model; each that has one is tried."""
        made = {"left": self.left and self.left.model(), "right": self.right and self.right.model()}
        return tuple(eye for eye in EYES if made[eye] is None)

    def eye_models(self) -> EyeModels:
        """Return each eye's model; DeviceError if one is lacking, or the two are for different observers."""
        if self.left is None or self.right is None:
            raise DeviceError(f"the {' and '.join(self.lacking())} eye has no characterisation")
        observers = [("the left eye", str(self.left.observer)), ("the right eye", str(self.right.observer))]
        if mixed := mixed_observers(observers):
            raise DeviceError(mixed)
        return EyeModels(self.left.model(), self.right.model())

    def ambient_specs(self) -> dict[Eye, AmbientSpec | None]:
        """Return the mode's own word on the room's light, for each eye."""
        left, right = (None if spec is None else spec.ambient_XYZ_cd_m2 for spec in (self.left, self.right))
        return {"left": left, "right": right}

    def gamma_table_specs(self) -> dict[Eye, GammaTableSpec | None]:
        """Return what is said of the gamma table that each eye was measured with."""
        left, right = (None if spec is None else spec.gamma_table for spec in (self.left, self.right))
        return {"left": left, "right": right}


def _shape(value: Any) -> str:
    keys = value if isinstance(value, dict) else {}
    if isinstance(value, BaseModel):
        keys = dict.fromkeys(type(value).model_fields)
    return "same" if "same_as" in keys else "eyes" if "left" in keys or "right" in keys else "model"


ModeSpec = Annotated[
    Annotated[SameAsSpec, Tag("same")] | Annotated[PerEyeSpec, Tag("eyes")] | Annotated[BothEyesSpec, Tag("model")],
    Discriminator(_shape),
]


class DisplaySpec(FileModel):
    """A display file: modes that were measured, or a nominal display for all that were not, or both."""

    schema_version: Literal[1]
    """The version of the file format: 1."""
    panel: PanelSpec
    """The panel: pixels, pixel pitch, refresh rate and bits."""
    ambient_XYZ_cd_m2: AmbientSpec | None = None
    """The room's light from the screen while it is off, XYZ in cd/m²."""
    modes: dict[str, ModeSpec] = Field(default_factory=dict)
    """The stereo modes that the display was measured in, by name."""
    nominal: NominalKind | None = None
    """The standard that the display is taken for: srgb, gamma2.2, bt1886 or display-p3."""
    white_cd_m2: Positive | None = None
    """The luminance of the nominal display's white, in cd/m²."""
    black_cd_m2: NotNegative | None = None
    """The luminance of the nominal display's black, in cd/m²."""

    @model_validator(mode="after")
    def _has_modes(self) -> Self:
        if self.nominal is None and not self.modes:
            raise ValueError(
                "a display file needs 'modes:' that were measured, or 'nominal: srgb' and 'white_cd_m2: 100'"
            )
        if self.nominal is None and (self.white_cd_m2, self.black_cd_m2) != (None, None):
            raise ValueError("white_cd_m2 and black_cd_m2 are those of a nominal display: add 'nominal: srgb'")
        if self.nominal is not None and self.white_cd_m2 is None:
            raise ValueError("a nominal display needs its white: add 'white_cd_m2: 100'")
        refuse_black(self.white_cd_m2, self.black_cd_m2)
        return self

    @property
    def nominal_display(self) -> Nominal | None:
        """The nominal display, None where the file has none."""
        if self.nominal is None or self.white_cd_m2 is None:
            return None
        return Nominal.of(self.nominal, self.white_cd_m2, self.black_cd_m2)
