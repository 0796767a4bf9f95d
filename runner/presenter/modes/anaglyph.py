"""Anaglyph: both views in one picture, told apart by coloured filters before the eyes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from devices.display.display_file import EyeModels
from runner.presenter.errors import PresentationError
from runner.presenter.modes.filters import Filter, Filters
from runner.presenter.modes.mixture import Mixture, channel_split, least_squares
from runner.presenter.modes.mode import EyeArea, Mode
from runner.presenter.modes.options import refuse_options
from runner.presenter.rectangle import Rectangle, Size


@dataclass(frozen=True)
class _Anaglyph(Mode):
    """The whole surface for both eyes.

    The views are mixed by least squares (see `mixture`), or, on request, each channel is one eye's alone. With one
    characterisation for both eyes, measured without the filters, the shares of light that the filters pass are
    ``left_passes`` and ``right_passes``, unless the rig says better; measured through each filter, it needs none.
    """

    filters: Filters | None = None

    needs_stereo: ClassVar[bool] = False
    left_channels: ClassVar[tuple[bool, bool, bool]]
    # Shares of red, green and blue light. Round figures of what gel filters pass, not measurements of any.
    left_passes: ClassVar[tuple[float, float, float]]
    right_passes: ClassVar[tuple[float, float, float]]

    def unavailable(self, size_px: Size, *, stereo: bool, windows: int = 1) -> str | None:
        """Return None: every surface can."""
        return None

    def areas(self, size_px: Size, position_px: tuple[int, int] = (0, 0)) -> tuple[EyeArea, ...]:
        """Return the whole surface, for both eyes."""
        return (EyeArea(("left", "right"), Rectangle(0, 0, *size_px)),)

    def with_filters(self, filters: Filters) -> Mode:
        """Return the mode with ``filters``."""
        return replace(self, filters=filters)

    def mixture(self, models: EyeModels) -> Mixture:
        """Return how the two views make one.

        Raises
        ------
        PresentationError
            If filters are given though the characterisation was measured through them, or cannot make white.
        """
        filters = self.filters or Filters()
        per_eye = models.left is not models.right
        if per_eye and (filters.left is not None or filters.right is not None):
            why = "was characterised per eye, through its filters, and is given filters besides"
            raise refuse_options(self.name, why, "leave 'left_filter' and 'right_filter' out")
        through = self._through(filters, per_eye=per_eye)
        if filters.split_channels:
            return channel_split(models, self.left_channels, *through)
        try:
            return least_squares(models, *through)
        except PresentationError as error:
            finding = error.findings[0]
            raise PresentationError(f"the mode '{self.name}' cannot be shown: {finding}") from error

    def _through(self, filters: Filters, *, per_eye: bool) -> tuple[Filter | None, Filter | None]:
        if per_eye:
            return None, None
        return filters.left or self.left_passes, filters.right or self.right_passes


class AnaglyphRedCyan(_Anaglyph):
    """Red before the left eye, cyan before the right."""

    name: ClassVar[str] = "anaglyph-red-cyan"
    left_channels: ClassVar[tuple[bool, bool, bool]] = (True, False, False)
    left_passes: ClassVar[tuple[float, float, float]] = (0.90, 0.05, 0.02)
    right_passes: ClassVar[tuple[float, float, float]] = (0.03, 0.75, 0.80)


class AnaglyphGreenMagenta(_Anaglyph):
    """Green before the left eye, magenta before the right."""

    name: ClassVar[str] = "anaglyph-green-magenta"
    left_channels: ClassVar[tuple[bool, bool, bool]] = (False, True, False)
    left_passes: ClassVar[tuple[float, float, float]] = (0.03, 0.75, 0.05)
    right_passes: ClassVar[tuple[float, float, float]] = (0.85, 0.05, 0.80)


class AnaglyphAmberBlue(_Anaglyph):
    """Amber before the left eye, blue before the right."""

    name: ClassVar[str] = "anaglyph-amber-blue"
    left_channels: ClassVar[tuple[bool, bool, bool]] = (True, True, False)
    left_passes: ClassVar[tuple[float, float, float]] = (0.90, 0.75, 0.03)
    right_passes: ClassVar[tuple[float, float, float]] = (0.02, 0.03, 0.70)
