"""A simulated instrument before a simulated display: a model with the faults of real ones, the same for a seed.

What can stand between the codes of a program and the light of a panel, for the simulated instrument.

Some change the codes on their way: a compositor that converts colours, a cable with codes 16 to 235, a panel of six
bits. Others change the light with what else is in the picture: a backlight that follows it, a supply that limits it.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, fields

import numpy as np

from devices.colour.adaptation import bradford_matrix
from devices.colour.spaces import rgb_to_xyz_matrix
from devices.colour.srgb_encoding import D65_XY, SRGB_PRIMARIES_XY, srgb_decoded
from devices.display.crosstalk import Crosstalk
from devices.display.display_file import Eye, EyeModels
from devices.display.gain_map import GainMap
from devices.display.model import DisplayModel
from devices.errors import DeviceError
from devices.readings.arrangement import PatchEye, degrees
from devices.readings.instrument import PatchOnScreen, Reading
from devices.readings.patch import Patch
from documents import Finding
from documents.arrays import Floats

_WARM_UP_S = 480.0
_NEVER_NEGATIVE = ("noise", "floor_cd_m2", "takes_s", "frame_rate_control", "white_segment", "stray_light")
_LOW, _HIGH, _FULL = 16.0, 235.0, 255.0
_ASSUMED_GAMMA = 2.2
# The backlight has gone so far of its way back when a patch is read after another one.
_BEFORE_SHARE = 0.5


@dataclass(frozen=True, slots=True)
class SignalFaults:
    """The faults between codes and light; see `devices.readings.simulated.Faults` for each."""

    compositor: float = 0.0
    stretched_range: float = 0.0
    squeezed_range: float = 0.0
    panel_bits: float = 0.0
    frame_rate_control: float = 0.0
    white_segment: float = 0.0
    dynamic_contrast: float = 0.0
    picture_level_limit: float = 0.0
    stray_light: float = 0.0


@dataclass(frozen=True, slots=True)
class Faults(SignalFaults):
    """How the display and the instrument depart from the model; all 0 depart in nothing.

    ``noise`` is the standard deviation of a reading, as a share of it, and ``floor_cd_m2`` of a reading of no light.
    ``drift_per_hour`` is the share of light gained in an hour. ``additivity_loss`` is the share of light that white
    lacks of the sum of its channels. ``interaction`` moves a channel's code by as much, in codes of 0..1, when the
    other two are at full drive and it is at half. ``takes_s`` is how long a reading takes.

    ``crosstalk`` is the share of the other eye's light that leaks in beside what the display file holds;
    ``edge_loss`` the share of light that the screen's corners lack of the centre, ``angle_loss`` that lacking at 30°;
    ``surround_gain`` the share that a patch gains on white; ``glasses_loss`` the share that the glasses take, so that
    there is more without them; ``warm_up_loss`` the share lacking at the beginning, which goes with a time constant of
    8 minutes.

    Of what stands between codes and light (`SignalFaults`), these are on where they are not 0: ``compositor``, which
    takes codes for sRGB and converts them to the panel's primaries; ``stretched_range``, where the panel takes codes
    16..235 for black to white; ``squeezed_range``, where the card sends 16..235 and the panel shows them as they are.
    ``panel_bits`` are the panel's own, such as 6; ``frame_rate_control`` lets it alternate between two levels for the
    codes between them, and is the standard deviation of a reading of those, as a share of it. ``white_segment`` is the
    light, as a share of white's, that a white segment or subpixel adds to white; ``dynamic_contrast`` the share that
    the backlight loses in a black picture; ``picture_level_limit`` the share that white loses when it fills the screen;
    ``stray_light`` the share of a surround's light that a patch is read with.

    Raises DeviceError if one is not finite, or is below 0 where only more makes sense.
    """

    noise: float = 0.002
    floor_cd_m2: float = 0.0
    drift_per_hour: float = 0.0
    additivity_loss: float = 0.0
    interaction: float = 0.0
    takes_s: float = 0.0
    crosstalk: float = 0.0
    edge_loss: float = 0.0
    angle_loss: float = 0.0
    surround_gain: float = 0.0
    glasses_loss: float = 0.0
    warm_up_loss: float = 0.0

    def __post_init__(self) -> None:
        for name in (field.name for field in fields(self)):
            value = getattr(self, name)
            if not np.isfinite(value) or (value < 0 and name in _NEVER_NEGATIVE):
                raise DeviceError(f"'{name}' of a simulated instrument cannot be {value}")
        for name in ("dynamic_contrast", "picture_level_limit"):
            if not 0.0 <= getattr(self, name) < 1.0:
                raise DeviceError(f"'{name}' of a simulated instrument cannot be {getattr(self, name)}: 1 is all light")
        if self.panel_bits and not 1.0 <= self.panel_bits <= 8.0:
            raise DeviceError(f"'panel_bits' of a simulated instrument cannot be {self.panel_bits}: 1 to 8")
        if self.glasses_loss >= 1.0:
            raise DeviceError(f"'glasses_loss' of a simulated instrument cannot be {self.glasses_loss}: 1 is all light")

    @classmethod
    def parse(cls, options: dict[str, str]) -> Faults:
        """Return faults of options such as ``noise=0.01``; raise DeviceError with a finding for each wrong one."""
        known = [field.name for field in fields(cls)]
        values: dict[str, float] = {}
        findings = []
        for key, text in options.items():
            if key not in known:
                findings.append(Finding(f"there is no option '{key}'", remedy=f"expected one of: {', '.join(known)}"))
                continue
            try:
                values[key] = float(text)
            except ValueError:
                findings.append(Finding(f"'{key}' is '{text}'", remedy="a number is needed"))
        if findings:
            raise DeviceError(findings)
        return cls(**values)


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedDisplay:
    """The display that a simulated instrument looks at: each eye's model, what leaks between them, and its evenness."""

    models: EyeModels
    crosstalk: Crosstalk | None = None
    gain_map: GainMap | None = None


class Simulated:
    """Reads ``display`` through the lens of ``eye`` with ``faults``; a model alone is that of both eyes.

    A patch that names its lens is read through that one; ``both`` sees what the left eye does. The noise of a patch
    depends on ``seed`` and its place in the order alone.
    """

    def __init__(
        self,
        display: DisplayModel | SimulatedDisplay,
        seed: int = 0,
        faults: Faults | None = None,
        eye: PatchEye = "both",
    ) -> None:
        if isinstance(display, SimulatedDisplay):
            self._display = display
        else:
            self._display = SimulatedDisplay(EyeModels(display, display))
        self._seed = seed
        self._faults = faults or Faults()
        self._eye = eye
        self.name = f"simulated (seed {seed})"

    def read(self, showing: PatchOnScreen) -> Reading:
        """Return what the simulated instrument reads."""
        faults = self._faults
        if faults.takes_s:
            time.sleep(faults.takes_s)
        # A negative leak takes no more light than there is.
        ambient = self._display.models.eye(self._side(showing)).ambient_XYZ_cd_m2
        light = np.maximum(self._own(showing) + self._leak(showing), 0.0) * self._share(showing)
        light = light * (1.0 + faults.drift_per_hour * showing.time_s / 3600.0)
        light = light * (1.0 - faults.warm_up_loss * float(np.exp(-showing.time_s / _WARM_UP_S)))
        # The room's light neither drifts nor dims with the display, and is all that is read while that is off.
        light = ambient + (0.0 if showing.patch is not None and showing.patch.screen_off else light)
        rng = np.random.default_rng([self._seed, showing.position])
        light = light * (1.0 + faults.noise * rng.standard_normal(3)) + faults.floor_cd_m2 * rng.standard_normal(3)
        if faults.frame_rate_control and between_levels(np.array(showing.codes), faults):
            light = light * (1.0 + faults.frame_rate_control * rng.standard_normal())
        return Reading((float(light[0]), float(light[1]), float(light[2])))

    def close(self) -> None:
        """Do nothing."""

    def _side(self, showing: PatchOnScreen) -> Eye:
        asked = (showing.patch.eye if showing.patch else None) or self._eye
        return "right" if asked == "right" else "left"

    def _own(self, showing: PatchOnScreen) -> Floats:
        """Return what arrives of the eye's own picture, without the room's light."""
        model, codes = self._display.models.eye(self._side(showing)), np.array(showing.codes)
        share, stray = share_with_picture(codes, showing.patch, self._faults, model)
        return share * (simulated_XYZ(model, codes, self._faults) - model.ambient_XYZ_cd_m2) + stray

    def _leak(self, showing: PatchOnScreen) -> Floats:
        """Return what arrives of the other eye's picture."""
        if showing.other is None:
            return np.zeros(3)
        eye = self._side(showing)
        model = self._display.models.right if eye == "left" else self._display.models.left
        light = simulated_XYZ(model, np.array(showing.other), self._faults) - model.shown_black_XYZ_cd_m2
        leaks = self._display.crosstalk
        matrix = np.zeros((3, 3)) if leaks is None else leaks.left if eye == "left" else leaks.right
        return np.asarray((matrix + self._faults.crosstalk * np.eye(3)) @ light)

    def _share(self, showing: PatchOnScreen) -> float:
        """Return the share of the light at the centre, straight ahead and through the glasses that is read."""
        patch, faults = showing.patch, self._faults
        across, down = showing.place
        share = 1.0 - faults.edge_loss * 2.0 * ((across - 0.5) ** 2 + (down - 0.5) ** 2)
        if self._display.gain_map is not None:
            width_px, height_px = self._display.gain_map.resolution_px
            share *= float(self._display.gain_map.gain(across * width_px, down * height_px))
        if patch is None:
            return share
        if patch.angle:
            share *= 1.0 - faults.angle_loss * (degrees(patch.angle) / 30.0) ** 2
        if patch.around is not None:
            share *= 1.0 + faults.surround_gain * float(np.mean(patch.around))
        return share if patch.glasses else share / (1.0 - faults.glasses_loss)


def simulated_XYZ(model: DisplayModel, codes: Floats, faults: Faults) -> Floats:
    """Return the light of ``codes``, shape (..., 3), on a display with ``faults``, before drift and noise."""
    codes = codes_at_panel(codes, faults, model)
    others = (codes.sum(axis=-1, keepdims=True) - codes) / 2.0
    moved = np.clip(codes + faults.interaction * others * 4.0 * codes * (1.0 - codes), 0.0, 1.0)
    above = model.xyz(moved) - model.dark_XYZ_cd_m2
    linear = np.stack([curve.linear(moved[..., i]) for i, curve in enumerate(model.curves)], axis=-1)
    together = (linear.sum(axis=-1) - linear.max(axis=-1)) / 2.0
    lost = 1.0 - faults.additivity_loss * together
    white = faults.white_segment * linear.min(axis=-1)[..., np.newaxis] * model.primaries_XYZ_cd_m2.sum(axis=1)
    return np.asarray(model.dark_XYZ_cd_m2 + above * lost[..., np.newaxis] + white)


def codes_at_panel(codes: Floats, faults: SignalFaults, model: DisplayModel) -> Floats:
    """Return the codes that drive the panel, shape (..., 3), for those that a program sends."""
    arrived = codes if not faults.compositor else composited(codes, model)
    if faults.stretched_range:
        arrived = np.clip((_FULL * arrived - _LOW) / (_HIGH - _LOW), 0.0, 1.0)
    if faults.squeezed_range:
        arrived = np.round(_LOW + (_HIGH - _LOW) * arrived) / _FULL
    if faults.stretched_range:
        arrived = np.round(_FULL * arrived) / _FULL
    if faults.panel_bits:
        step = 2.0 ** (8.0 - faults.panel_bits)
        whole = np.round(_FULL * arrived)
        # Frames in turn give the mean between two levels, and nothing above the last level.
        shown = np.minimum(whole, 256.0 - step) if faults.frame_rate_control else step * np.floor(whole / step)
        arrived = shown / (256.0 - step)
    return np.asarray(arrived)


def composited(codes: Floats, model: DisplayModel) -> Floats:
    """Return codes of sRGB as a compositor converts them to ``model``'s primaries, taking its curve for gamma 2.2."""
    matrix = srgb_to_display(model)
    linear = srgb_decoded(codes)
    return np.asarray(np.clip(linear @ matrix.T, 0.0, 1.0) ** (1.0 / _ASSUMED_GAMMA))


def srgb_to_display(model: DisplayModel) -> Floats:
    """Return what brings linear sRGB to the linear light of ``model``'s channels, white to white, shape (3, 3)."""
    primaries = model.primaries_XYZ_cd_m2
    white = primaries.sum(axis=1)
    of_srgb = rgb_to_xyz_matrix(*SRGB_PRIMARIES_XY, D65_XY)
    adapted = bradford_matrix(of_srgb.sum(axis=1), white / white[1]) @ of_srgb
    return np.asarray(np.linalg.solve(primaries / white[1], adapted))


def between_levels(codes: Floats, faults: SignalFaults) -> bool:
    """Return whether some channel's code lies between two levels of the panel, so that frames alternate."""
    step = 2.0 ** (8.0 - faults.panel_bits)
    return bool(np.any(np.round(_FULL * codes) % step))


def share_with_picture(
    codes: Floats, patch: Patch | None, faults: SignalFaults, model: DisplayModel
) -> tuple[float, Floats]:
    """Return the share of its light that a patch keeps in its picture, and the stray light beside it, XYZ, (3,)."""
    area = 1.0 if patch is None else patch.filled
    around = codes if patch is None or area == 1.0 else np.array(patch.surround)
    brightest = max(float(codes.max()), float(around.max()))
    if patch is not None and patch.before is not None:
        brightest = max(brightest, _BEFORE_SHARE * max(patch.before))
    share = 1.0 - faults.dynamic_contrast * (1.0 - brightest)
    beside = model.xyz(around) if area < 1.0 and (faults.picture_level_limit or faults.stray_light) else np.zeros(3)
    if faults.picture_level_limit:
        white = float(model.xyz(np.ones(3))[1])
        level = (area * float(model.xyz(codes)[1]) + (1.0 - area) * float(beside[1])) / white
        share *= min(1.0, (1.0 - faults.picture_level_limit) / max(level, 1e-12))
    return share, np.asarray(faults.stray_light * (1.0 - area) * share * beside)
