"""The surface: pixels to draw to, two back buffers of them where there is stereo, and what is pressed at it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import Enum
from typing import TYPE_CHECKING, Any, Protocol, Self

from analysis.records import SurfaceFacts
from devices.compensation import Size
from devices.display import Eye
from runner.ports import KeyPress
from runner.presenter.depth import Bits
from runner.presenter.pointer import Pointer
from runner.presenter.surfaces.gamma_tables import LoadedTable
from runner.presenter.surfaces.gl_calls import Codes, GlCalls

if TYPE_CHECKING:
    import moderngl


class Buffer(Enum):
    """Where a frame is drawn: the one back buffer, or that of one eye."""

    BACK = "back"
    BACK_LEFT = "back left"
    BACK_RIGHT = "back right"

    @classmethod
    def of(cls, eye: Eye | None) -> Buffer:
        """Return the buffer of ``eye``, or the one back buffer."""
        return {None: cls.BACK, "left": cls.BACK_LEFT, "right": cls.BACK_RIGHT}[eye]


class Surface(Protocol):
    """A surface of ``size_px`` with codes of ``bits`` a channel; the context is current from opening to closing.

    ``stereo`` says whether there is a right back buffer (GL_STEREO); with two ``windows``, each eye's buffer is a
    window. ``position_px`` is the pixel of the panel, from its top left, that the surface's own top left pixel stands
    on. ``on_damage`` is called while waiting for a key if the window system has lost what was shown, ``on_move`` if the
    window has been moved, ``on_wake`` after ``wake`` and before sleeping again, ``on_point`` if the pointer that
    follows the mouse was moved, ``on_window`` with what became of the window. With ``on_frame``, a window calls it for
    every refresh while waiting for a key. ``on_lost`` is called if the window system ended, before the process does.
    """

    size_px: Size
    position_px: tuple[int, int]
    context: moderngl.Context
    calls: GlCalls
    stereo: bool
    windows: int
    bits: Bits
    on_damage: Callable[[], object] | None
    on_move: Callable[[], object] | None
    on_wake: Callable[[], object] | None
    on_frame: Callable[[], object] | None
    on_point: Callable[[], object] | None
    on_window: Callable[[str, Mapping[str, Any]], object] | None
    on_lost: Callable[[], object] | None

    @property
    def facts(self) -> SurfaceFacts:
        """What to record of it."""

    def gamma_tables(self) -> Mapping[Eye, LoadedTable]:
        """Read the gamma table of the monitor that each eye's pixels stand on; unknown, and why, without a monitor."""

    def keyboard_labels(self) -> Mapping[str, str]:
        """Return what keys print at the places of digits and Latin letters that none prints; nothing without keys."""

    def target(self, buffer: Buffer) -> moderngl.Framebuffer:
        """Bind ``buffer`` for drawing and return its framebuffer; raise PresentationError if there is none."""

    def swap(self) -> None:
        """Show what was drawn and return once the graphics card is done."""

    def read(self, eye: Eye | None = None) -> Codes:
        """Return the codes (height, width, 3) of the back buffer, or of ``eye``'s, top row first.

        They are uint8 in 0..255 with 8 bits, uint16 in 0..1023 with 10.
        """

    def wait_key(self) -> KeyPress:
        """Sleep until something is pressed and return it; raise WindowClosed if nothing can come any more.

        A letter gives two presses, its key and ``text X``. A key held down gives ``again KEY`` as often as the keyboard
        repeats it; a click gives ``click_at X,Y``, its place in pixels from the middle of a view.
        """

    def follow_mouse(self, pointer: Pointer | None) -> None:
        """Let the mouse move ``pointer`` from now on, and stamp clicks with its place; with None it does neither.

        A gamepad's buttons that are down now are not pressed by what follows.
        """

    def wake(self) -> None:
        """Wake whoever sleeps in ``wait_key``, from any thread, to call ``on_wake``; nobody does without a window."""

    def hear(self) -> None:
        """Take what waits in the event queue, without sleeping: each press there is stamped with the time now."""

    def poll_keys(self) -> tuple[KeyPress, ...]:
        """Return the presses that wait, without sleeping."""

    def close(self) -> None:
        """Free everything; it cannot be used afterwards."""

    def __enter__(self) -> Self:
        """Return itself."""

    def __exit__(self, *_: object) -> None:
        """Close it."""
