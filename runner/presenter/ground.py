"""The light that scenes are drawn on and words are drawn in, each eye's through its own display model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from devices.compensation import Compensation
from devices.display import EYES, DisplayModel, Eye
from documents.arrays import Floats

# The share of white of plain words on black; brighter and fainter items keep their proportion to it.
PLAIN = 0.4
# A background of a larger share of white has darker words, of this share of its own light.
_LIGHT, _DARK_TEXT = 0.2, 0.05


@dataclass(frozen=True, slots=True)
class Light:
    """A light of ``luminance_cd_m2``, or of a share of the display's white; of the white's colour if ``xy`` is None."""

    luminance_cd_m2: float | None = None
    share_of_white: float | None = None
    xy: tuple[float, float] | None = None

    def XYZ_cd_m2(self, model: DisplayModel) -> Floats:
        """Return XYZ (3,) on the display of ``model``."""
        white = model.white_XYZ_cd_m2
        given = self.luminance_cd_m2
        luminance_cd_m2 = (self.share_of_white or 0.0) * white[1] if given is None else given
        if self.xy is None:
            return np.asarray(white / white[1] * luminance_cd_m2)
        x, y = self.xy
        return np.array([x / y, 1.0, (1.0 - x - y) / y]) * luminance_cd_m2


@dataclass(frozen=True, slots=True)
class Ground:
    """The ``background`` of every scene, black if None, and the light of plain ``text`` on it.

    Without a light of its own, text is lighter than a dark background and darker than a light one.
    """

    background: Light | None = None
    text: Light | None = None

    def background_XYZ_cd_m2(self, model: DisplayModel) -> Floats:
        """Return the background's XYZ (3,)."""
        return np.zeros(3) if self.background is None else self.background.XYZ_cd_m2(model)

    def text_XYZ_cd_m2(self, model: DisplayModel) -> Floats:
        """Return the XYZ (3,) of plain words."""
        if self.text is not None:
            return self.text.XYZ_cd_m2(model)
        below, white = self.background_XYZ_cd_m2(model), model.white_XYZ_cd_m2
        return np.asarray(below + PLAIN * white if below[1] < _LIGHT * white[1] else _DARK_TEXT * below)

    def contrast(self, model: DisplayModel) -> float:
        """Return the luminance as shown of plain words over that of the background, or the reverse if it is above 1."""
        words, below = (
            max(float(light[1]), float(model.shown_black_XYZ_cd_m2[1]), 1e-6)
            for light in (self.text_XYZ_cd_m2(model), self.background_XYZ_cd_m2(model))
        )
        return max(words / below, below / words)

    def shown_XYZ_cd_m2(self, compensation: Compensation) -> dict[Eye, Floats]:
        """Return what each eye's display is asked for as the background, less what leaks from the other eye."""
        views = [self.background_XYZ_cd_m2(compensation.models.eye(eye)) for eye in EYES]
        if self.background is not None and compensation.correction.crosstalk is not None:
            squares = [np.broadcast_to(view, (2, 2, 3)).astype(np.float32) for view in views]
            views = [view[0, 0].astype(np.float64) for view in compensation.apply((squares[0], squares[1]))[0]]
        return dict(zip(EYES, views, strict=True))


@dataclass(frozen=True, slots=True)
class Inks:
    """The codes in 0..1 of a ``ground`` and of all that is drawn on it, in one mode on one display.

    The gain map is left out of ``compensation``: background and words are as uneven as the panel.
    """

    ground: Ground
    compensation: Compensation

    def background(self) -> dict[Eye, Floats]:
        """Return the background's codes (3,) for each eye; one picture for both where the mode mixes the views."""
        return self._codes(self.ground.shown_XYZ_cd_m2(self._of))

    def ramp(self, eye: Eye, luminance_share: float) -> Floats:
        """Return what to add (256, 3) for 0 to 255 parts of an item that covers the background's codes in part.

        Added to 255 to 0 parts of these codes, it makes the codes of the mean light of item and background: edges are
        smooth in linear light. An item of ``luminance_share`` 0 is as the background; `PLAIN` is plain words; what is
        to be brighter or darker than these goes as far as there is light for.
        """
        part = np.linspace(0.0, 1.0, 256)[:, np.newaxis]
        below = self.ground.shown_XYZ_cd_m2(self._of)
        light = {}
        for each, shown in below.items():
            model = self._of.models.eye(each)
            step = self.ground.text_XYZ_cd_m2(model) - self.ground.background_XYZ_cd_m2(model)
            brightest = np.maximum(model.white_XYZ_cd_m2, self.ground.text_XYZ_cd_m2(model))
            so_far = luminance_share / PLAIN
            if step[1] < 0.0 and so_far < 1.0:
                so_far **= 0.5  # dark words that are to be fainter remain as plain to the eye as light ones do
            item = np.clip(shown + step * so_far, 0.0, brightest)
            light[each] = (1.0 - part) * shown + part * item
        codes = self._codes(light)[eye]
        return np.asarray(np.clip(codes - (1.0 - part) * codes[0], 0.0, 1.0))

    def leaves_gamut(self) -> dict[str, bool]:
        """Return whether the display cannot show the ``background`` or the ``text`` to an eye."""
        models = self._of.models
        asked = {
            "background": self.ground.shown_XYZ_cd_m2(self._of),
            "text": {eye: self.ground.text_XYZ_cd_m2(models.eye(eye)) for eye in EYES},
        }
        return {what: self._outside(lights) for what, lights in asked.items() if getattr(self.ground, what) is not None}

    @property
    def _of(self) -> Compensation:
        return self.compensation

    def _outside(self, lights: dict[Eye, Floats]) -> bool:
        models, mixture = self._of.models, self._of.mixture
        if all(light[1] <= models.eye(eye).shown_black_XYZ_cd_m2[1] for eye, light in lights.items()):
            return False  # as dark as the display can be is dark enough: no panel is black
        if mixture is not None:
            return _beyond(mixture.light(lights["left"], lights["right"]), mixture.limits)
        return any(_beyond(models.eye(eye).linear(light), models.eye(eye).limits) for eye, light in lights.items())

    def _codes(self, light: dict[Eye, Floats]) -> dict[Eye, Floats]:
        models, mixture = self._of.models, self._of.mixture
        if mixture is not None:
            both = mixture.code(light["left"], light["right"])
            return {eye: both for eye in EYES}
        return {eye: models.eye(eye).code(light[eye]) for eye in EYES}


_TOLERANCE = 1e-3  # of a channel's light: less than half of the smallest step of 8 bits at the top


def _beyond(linear: Floats, limits: tuple[Floats, Floats]) -> bool:
    return bool(((linear < limits[0] - _TOLERANCE) | (linear > limits[1] + _TOLERANCE)).any())
