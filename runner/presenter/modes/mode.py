"""A stereo mode says which pixels each eye sees; nothing else in the presenter knows which mode it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

from devices.display_file import Eye
from runner.presenter.rectangle import Rectangle, Size
from runner.presenter.surfaces.surface import Buffer


@dataclass(frozen=True, slots=True)
class EyeArea:
    """Pixels of one buffer, and the eyes that see them: one, or both where the two see the same pixels."""

    eyes: tuple[Eye, ...]
    rectangle: Rectangle
    buffer: Buffer = Buffer.BACK


class Mode(Protocol):
    """One way to show two pictures. ``name`` is the mode's key in display files.

    ``needs_stereo`` says whether to ask the surface for a back buffer for each eye.
    """

    name: ClassVar[str]
    needs_stereo: ClassVar[bool]

    def unavailable(self, size_px: Size, *, stereo: bool) -> str | None:
        """Say why a surface of ``size_px``, with a right back buffer or not, cannot show this mode; None if it can."""

    def areas(self, size_px: Size) -> tuple[EyeArea, ...]:
        """Return each eye's area of a surface of ``size_px``."""
