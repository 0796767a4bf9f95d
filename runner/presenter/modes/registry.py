"""The modes by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from documents import Finding
from documents.text.words import did_you_mean
from runner.presenter.errors import PresentationError
from runner.presenter.modes.adjusted import Adjusted
from runner.presenter.modes.anaglyph import AnaglyphAmberBlue, AnaglyphGreenMagenta, AnaglyphRedCyan
from runner.presenter.modes.dual_window import DualWindow
from runner.presenter.modes.flat import Flat
from runner.presenter.modes.frame_sequential import FrameSequential
from runner.presenter.modes.interleaved import Checkerboard, ColumnInterleaved, RowInterleaved
from runner.presenter.modes.mode import Mode
from runner.presenter.modes.options import ModeOptions
from runner.presenter.modes.quad_buffered import QuadBuffered
from runner.presenter.modes.side_by_side import SideBySide, SideBySideHalf
from runner.presenter.modes.top_bottom import TopBottom, TopBottomHalf
from runner.presenter.surfaces.surface import Surface

MODES: Mapping[str, Callable[[], Mode]] = MappingProxyType(
    {
        mode.name: mode
        for mode in (
            Flat,
            SideBySide,
            SideBySideHalf,
            TopBottom,
            TopBottomHalf,
            RowInterleaved,
            ColumnInterleaved,
            Checkerboard,
            AnaglyphRedCyan,
            AnaglyphGreenMagenta,
            AnaglyphAmberBlue,
            QuadBuffered,
            FrameSequential,
            DualWindow,
        )
    }
)


def find_mode(name: str, options: ModeOptions | None = None) -> Mode:
    """Return the mode called ``name``, adjusted by ``options``.

    Raises
    ------
    PresentationError
        If there is no such mode, with the nearest name; or if it cannot be adjusted so.
    """
    if name not in MODES:
        remedy = did_you_mean(name, MODES)
        raise PresentationError(Finding(f"there is no stereo mode '{name}'", remedy=remedy))
    mode = MODES[name]()
    if options is None or options == ModeOptions():
        return mode
    return Adjusted(mode.with_filters(options.filters) if options.filters else mode, options)


def available(surface: Surface) -> dict[str, str | None]:
    """Return, for each mode, None if ``surface`` can show it, else the reason why not."""
    return {name: _reason(mode(), surface) for name, mode in MODES.items()}


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
