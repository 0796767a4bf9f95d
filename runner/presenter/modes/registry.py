"""The modes by name, and any mode adjusted to the rig."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from devices.compensation import Mixture, Rectangle, Size
from devices.display import Eye, EyeModels
from documents import Finding
from documents.text import did_you_mean
from runner.presenter.errors import PresentationError
from runner.presenter.modes.kinds import (
    Anaglyph,
    DualWindow,
    Flat,
    FrameSequential,
    Interleaved,
    QuadBuffered,
    SideBySide,
    TopBottom,
)
from runner.presenter.modes.mode import EyeArea, Mode, SeenThrough, Weave
from runner.presenter.modes.options import ModeOptions, refuse_options
from runner.presenter.surfaces.surface import Surface

MODES: Mapping[str, Mode] = MappingProxyType(
    {
        mode.name: mode
        for mode in (
            Flat(),
            SideBySide(),
            SideBySide("side-by-side-half", squeeze=(2, 1)),
            TopBottom(),
            TopBottom("top-bottom-half", squeeze=(1, 2)),
            # For the left eye: even rows, as on line-polarised panels; even columns, as behind parallax barriers; the
            # square of the panel's first pixel and its like, as in DLP projection.
            Interleaved("row-interleaved", Weave(0, 1)),
            Interleaved("column-interleaved", Weave(1, 0)),
            Interleaved("checkerboard", Weave(1, 1)),
            # Before the left eye red, green or amber; before the right cyan, magenta or blue.
            Anaglyph("anaglyph-red-cyan", (True, False, False), (0.90, 0.05, 0.02), (0.03, 0.75, 0.80)),
            Anaglyph("anaglyph-green-magenta", (False, True, False), (0.03, 0.75, 0.05), (0.85, 0.05, 0.80)),
            Anaglyph("anaglyph-amber-blue", (True, True, False), (0.90, 0.75, 0.03), (0.02, 0.03, 0.70)),
            QuadBuffered(),
            FrameSequential(),
            DualWindow(),
        )
    }
)


def find_mode(name: str, options: ModeOptions | None = None) -> Mode:
    """Return a stereo mode by its name.

    Parameters
    ----------
    name
        One of `MODES`, such as ``side-by-side``.
    options
        How the mode is adjusted to the rig; not at all if None.

    Returns
    -------
    Mode
        The mode; it defines which pixels each eye sees.

    Raises
    ------
    PresentationError
        If there is no such mode, with the nearest name; or if it cannot be adjusted so.

    Examples
    --------
    >>> left, right = find_mode("side-by-side").areas((1920, 1080))
    >>> left.rectangle.width, right.rectangle.left
    (960, 960)
    """
    if name not in MODES:
        remedy = did_you_mean(name, MODES)
        raise PresentationError(Finding(f"there is no stereo mode '{name}'", remedy=remedy))
    mode = MODES[name]
    if options is None or options == ModeOptions():
        return mode
    return AdjustedMode(mode.with_filters(options.filters) if options.filters else mode, options)


def available(surface: Surface) -> dict[str, str | None]:
    """Return, for each mode, None if ``surface`` can show it, else the reason why not."""
    return {name: _reason(mode, surface) for name, mode in MODES.items()}


def require(mode: Mode, surface: Surface) -> None:
    """Raise PresentationError if ``surface`` cannot show ``mode``, saying why and which modes it can show."""
    reason = _reason(mode, surface)
    if reason is not None:
        others = ", ".join(name for name, why in available(surface).items() if why is None)
        raise PresentationError(
            Finding(f"the mode '{mode.name}' cannot be shown: {reason}", remedy=f"available here: {others or 'none'}")
        )


def _reason(mode: Mode, surface: Surface) -> str | None:
    return mode.unavailable(surface.size_px, stereo=surface.stereo, windows=surface.windows)


_OTHER: dict[Eye, Eye] = {"left": "right", "right": "left"}


@dataclass(frozen=True, slots=True)
class AdjustedMode(Mode):
    """``mode`` with ``options``; it keeps the mode's name, because the light is the same.

    Raises PresentationError if the mode shows both eyes the same pixels and the options would make them differ.
    """

    mode: Mode
    options: ModeOptions

    def __post_init__(self) -> None:
        options = self.options
        areas = self.mode.areas((2, 2))
        frames = {(area.buffer, area.turn) for area in areas}
        if options.sync_line and len(frames) < 2:
            why = "shows both eyes in one frame, and a sync line distinguishes frames"
            raise refuse_options(self.name, why, "leave 'sync_line' out")
        alike = (options.left_offset_px, options.left_mirror) == (options.right_offset_px, options.right_mirror)
        if not alike and any(len(area.eyes) > 1 for area in areas):
            why = "shows both eyes the same pixels: it cannot move or mirror one of them"
            raise refuse_options(self.name, why, "give both eyes the same offset and mirror")

    @property
    def name(self) -> str:
        """The mode's own name."""
        return self.mode.name

    @property
    def needs_stereo(self) -> bool:
        """Whether the mode needs a right back buffer."""
        return self.mode.needs_stereo

    @property
    def windows(self) -> int:
        """How many windows the mode needs."""
        return self.mode.windows

    def unavailable(self, size_px: Size, *, stereo: bool, windows: int = 1) -> str | None:
        """Say why the mode cannot be shown, None if it can."""
        return self.mode.unavailable(size_px, stereo=stereo, windows=windows)

    def areas(self, size_px: Size, position_px: tuple[int, int] = (0, 0)) -> tuple[EyeArea, ...]:
        """Return the mode's areas, adjusted."""
        return tuple(self._adjust(area) for area in self.mode.areas(size_px, position_px))

    def mixture(self, models: EyeModels) -> Mixture | None:
        """Return how the views make one picture, each lens before the other eye if they are swapped."""
        if not self.options.swap_eyes:
            return self.mode.mixture(models)
        mixture = self.mode.mixture(EyeModels(models.right, models.left))
        return mixture.swapped() if mixture else None

    def seen_through(self, models: EyeModels) -> SeenThrough | None:
        """Return the mode's filters, each before the other eye if they are swapped."""
        if not self.options.swap_eyes:
            return self.mode.seen_through(models)
        through = self.mode.seen_through(EyeModels(models.right, models.left))
        return through.swapped() if through else None

    def patch(self, size_px: Size) -> Rectangle | None:
        """Return the photodiode's square."""
        corner = self.options.photodiode_corner
        if corner is None:
            return None
        side = min(self.options.photodiode_size_px, *size_px)
        return Rectangle((size_px[0] - side) * corner[0], (size_px[1] - side) * corner[1], side, side)

    def _adjust(self, area: EyeArea) -> EyeArea:
        options = self.options
        eyes = tuple(_OTHER[eye] for eye in area.eyes) if options.swap_eyes else area.eyes
        left = eyes[0] == "left"
        whole = area.rectangle
        line = Rectangle(whole.left, whole.top + whole.height - 1, whole.width * (1 if left else 3) // 4, 1)
        return replace(
            area,
            eyes=eyes,
            offset_px=options.left_offset_px if left else options.right_offset_px,
            mirror=options.left_mirror if left else options.right_mirror,
            sync_line=line if options.sync_line else None,
        )
