"""How one picture is shown, in Python and typed: here, so that help appears before numpy is there."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from documents.options import MONITOR, Typed

if TYPE_CHECKING:
    from stimuli.pictures import Packing


@dataclass(frozen=True, slots=True)
class ShowOptions:
    """How a picture is shown.

    Attributes
    ----------
    headless
        Draw without a window, at the panel's resolution.
    backend
        Where to draw if headless.
    screenshot
        PNG file to write with the framebuffer's codes; then exit.
    windowed
        Use a window instead of the full screen.
    monitors
        Monitor for the window, as `cyclopean doctor` lists them; twice for dual-window, the left eye's first. Default:
        the rig's, else the first of the panel's resolution.
    colour_space
        Colour space of the file, if it does not state it; xyz and rec709 are linear light.
    white_luminance_cd_m2
        Luminance of the value 1, or of an ordinary picture's white.
    right
        The right eye's file, if FILE is the left eye's alone.
    packing
        How both eyes lie in an ordinary picture: side-by-side or top-bottom, then -half, -crossed or both.
    flat_eye
        The eye whose picture both eyes see if the mode is flat.
    alpha_background_cd_m2
        Luminance of the grey behind a transparent picture.
    clip_negative
        Set negative XYZ to 0 instead of refusing the picture.
    flat
        Show the centre view to both eyes.
    mode_options
        Option of the stereo mode, as in a rig file: swap_eyes=true.
    bits
        Bits of a channel's codes. Default: 10 for a panel that has them, if the driver does.
    notify
        Called with each line that the user should read first.
    on_shown
        Called with the `ShownPicture` once it is on the screen, before a key is awaited.
    """

    headless: bool = False
    backend: Literal["egl", "null"] = "egl"
    screenshot: Path | None = None
    windowed: bool = False
    monitors: Annotated[tuple[str, ...], MONITOR] = ()
    colour_space: Literal["srgb", "display-p3", "adobe-rgb", "rec2020", "icc", "xyz", "rec709"] | None = None
    white_luminance_cd_m2: Annotated[float | None, Typed("--white-luminance", "CD_M2")] = None
    right: Annotated[Path | str | None, Typed(metavar="FILE")] = None
    packing: Annotated[Packing | None, Typed(metavar="LAYOUT")] = None
    flat_eye: Literal["left", "right"] | None = None
    alpha_background_cd_m2: Annotated[float | None, Typed("--alpha-background", "CD_M2")] = None
    clip_negative: bool = False
    flat: bool = False
    mode_options: Annotated[
        Mapping[str, object] | None, Typed("--mode-option", "KEY=VALUE", read="runner.presenter.show_options.option_of")
    ] = None
    bits: Annotated[Literal[8, 10] | None, Typed(read="builtins.int")] = None
    notify: Callable[[str], None] = lambda line: None
    on_shown: Callable[[Any], None] = lambda shown: None


def option_of(text: str) -> tuple[str, object]:
    """Return the key and value of ``KEY=VALUE``, the value as YAML reads it; PresentationError if it cannot."""
    import yaml

    from runner.presenter.errors import PresentationError

    key, equals, value = text.partition("=")
    try:
        return key.strip(), yaml.safe_load(value) if equals else None
    except yaml.YAMLError as error:
        raise PresentationError(f"the mode option '{text}' cannot be read: {error}".splitlines()[0]) from None
