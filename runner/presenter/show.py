"""One stereo picture on a screen, or its exact codes in a PNG."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from devices.compensation import Correction, eye_clip_costs
from devices.display import EYES, Eye, read_display
from runner.ports import WindowClosed
from runner.presenter.counters import Counters
from runner.presenter.depth import Bits
from runner.presenter.gamma_check import compare_tables, tables_json
from runner.presenter.modes.mode import EyeArea, visible_part
from runner.presenter.modes.options import ModeOptions
from runner.presenter.modes.registry import find_mode
from runner.presenter.presenter import Presenter
from runner.presenter.screenshot import check_screenshot_path, write_screenshot
from runner.presenter.surfaces.opening import open_surface
from runner.presenter.surfaces.surface import SurfaceFacts
from runner.scene import Picture, Scene
from stimuli.pictures import ColourSpace, Packing, Part, Region, read_picture


@dataclass(frozen=True, slots=True)
class ShowOptions:
    """How a picture is shown.

    Parameters
    ----------
    screenshot
        PNG file to write with the framebuffer's codes; then nobody is waited for.
    backend
        Where to draw: ``window``, ``egl`` (offscreen) or ``null`` (a window without a screen).
    windowed
        Whether to use a window in place of the full screen.
    monitors
        The monitor for the window, by name or number; two for a window for each eye.
    colour_space
        Colour space of the file's values, if it does not say.
    white_luminance_cd_m2
        Luminance of the value 1, or of an ordinary picture's white.
    clip_negative
        Whether to set negative XYZ to 0 in place of refusing the picture.
    flat
        Whether to show the centre view to both eyes.
    right
        The right eye's file, where each eye has one.
    packing
        How both eyes lie in one ordinary picture, such as ``side-by-side``.
    flat_eye
        The eye whose picture is the flat version of a pair without a centre view.
    alpha_background_cd_m2
        Luminance of the grey behind a partly transparent picture.
    mode_options
        Options of the stereo mode, as in a rig file.
    bits
        Bits of a channel's codes; if None, 10 for a panel that has them, where the driver does.
    notify
        Called with each line that the user should read first.
    on_shown
        Called once the picture is on the screen, before a key is awaited.
    """

    screenshot: Path | None = None
    backend: Literal["window", "egl", "null"] = "window"
    windowed: bool = False
    monitors: tuple[str, ...] = ()
    colour_space: ColourSpace | None = None
    white_luminance_cd_m2: float | None = None
    clip_negative: bool = False
    flat: bool = False
    right: str | Path | None = None
    packing: Packing | None = None
    flat_eye: Eye | None = None
    alpha_background_cd_m2: float | None = None
    mode_options: Mapping[str, object] | None = None
    bits: Bits | None = None
    notify: Callable[[str], None] = lambda line: None
    on_shown: Callable[[ShownPicture], None] = lambda shown: None


@dataclass(frozen=True, slots=True)
class ShownPicture:
    """A picture as it was shown.

    ``picture_px`` is its size, ``read_px`` that of the part in its middle that was read: what can be seen.
    ``clipping`` holds for each eye what the gamut clip costs: shares of pixels in percent, costs in ΔE00. ``crosstalk``
    holds for each eye what could not be cancelled of the other's picture, as a trial's record does; it is empty where
    none was measured. ``flat`` is whether both eyes saw the same picture, ``work`` the presenter's so far, ``closed``
    whether the window was closed before Escape was pressed. ``gamma_table`` is the table that is loaded for each eye,
    or for ``both``.
    """

    file: str
    mode: str
    picture_px: tuple[int, int]
    flat: bool
    clipping: Mapping[Eye, dict[str, float]]
    crosstalk: Mapping[str, Any]
    surface: SurfaceFacts
    screenshots: tuple[str, ...]
    work: Counters
    closed: bool = False
    gamma_table: Mapping[str, Any] = field(default_factory=dict)
    read_px: tuple[int, int] = (0, 0)

    def to_json(self) -> dict[str, Any]:
        """Return the picture's facts as plain JSON: all but ``work`` and ``closed``."""
        return {key: value for key, value in asdict(self).items() if key not in ("work", "closed")}


def show_picture(
    file: str | Path, display_file: str | Path, mode: str, options: ShowOptions | None = None
) -> ShownPicture:
    """Show a picture at 1:1 in the middle of each eye's area, with the display's response inverted.

    In a window it stays until Escape is pressed. Crosstalk and a gain map of the display file are compensated. Where
    both eyes see the same pixels, the flat version is shown.

    Parameters
    ----------
    file
        OpenEXR picture in XYZ, or with a colour space; or a PNG, JPEG, TIFF, WebP, MPO or JPS.
    display_file
        Display file that was characterised in ``mode``.
    mode
        Stereo mode, such as ``side-by-side``.
    options
        How it is shown; on a full screen if None.

    Returns
    -------
    ShownPicture
        What the gamut clip and the crosstalk that could not be cancelled cost each eye, what it was shown on, and the
        screenshots.

    Raises
    ------
    InputError
        If a file is wrong, or the surface cannot show the mode.
    GraphicsError
        If the graphics driver failed.

    Examples
    --------
    >>> import numpy as np
    >>> from tempfile import TemporaryDirectory
    >>> from stimuli.pictures import StereoImage, write_exr
    >>> display = "configs/displays/asus_vg248qe.yaml"
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder) / "grey.exr"
    ...     write_exr(file, StereoImage.flat(np.full((20, 30, 3), 10, np.float32)))
    ...     options = ShowOptions(screenshot=Path(folder) / "codes.png", backend="egl")
    ...     shown = show_picture(file, display, "side-by-side", options)
    >>> shown.picture_px, shown.flat, shown.clipping["left"]["percent_any"]
    ((30, 20), True, 0.0)
    """
    options = options or ShowOptions()
    if options.screenshot is not None:
        check_screenshot_path(options.screenshot)
    display = read_display(Path(display_file))
    models = display.models(mode)
    stereo_mode = find_mode(mode, ModeOptions.parse(dict(options.mode_options or {})))
    panel = display.panel
    areas = stereo_mode.areas(panel.resolution_px)
    seen = _seen_part(areas)
    whole_px: list[tuple[int, int]] = []

    def part(size_px: tuple[int, int]) -> Region:
        whole_px.append(size_px)
        return seen(size_px) if seen else Region(0, 0, *size_px)

    alike = stereo_mode.mixture(models) is None and any(len(area.eyes) > 1 for area in areas)
    image = read_picture(
        file,
        options.colour_space,
        right=options.right,
        packing=options.packing,
        flat=options.flat or alike,
        flat_eye=options.flat_eye,
        alpha_background_cd_m2=options.alpha_background_cd_m2,
        white_luminance_cd_m2=options.white_luminance_cd_m2,
        negative="clip" if options.clip_negative else "refuse",
        observer=display.observer(mode),
        part=part if seen else None,
    )
    correction = Correction(display.crosstalk(mode), display.gain_map(mode))
    compensation = stereo_mode.compensation(models, panel.resolution_px, correction)
    with (
        open_surface(
            options.backend,
            panel.resolution_px,
            stereo=stereo_mode.needs_stereo,
            windows=stereo_mode.windows,
            windowed=options.windowed,
            monitors=options.monitors,
            bits=options.bits or panel.code_bits,
        ) as surface,
        Presenter(surface, stereo_mode, models, lambda _: image, correction=correction) as presenter,
    ):
        facts = surface.facts
        if panel.bits < facts.bits == 10:
            bits = f"codes have {facts.bits} bits, and the panel has {panel.bits}"
            options.notify(f"warning: {bits} ({display_file})")
        if nominal := display.nominal_in(mode):
            options.notify(f"warning: {nominal.remark}")
        for remark in facts.remarks:
            options.notify(f"warning: {remark}")
        loaded = surface.gamma_tables()
        verdict = compare_tables({eye: display.gamma_table(mode, eye) for eye in EYES}, loaded)
        for remark in filter(None, (verdict.refusal, verdict.warning)):
            options.notify(f"warning: {remark}")
        presenter.show(Scene((Picture(str(file)),)))
        files = write_screenshot(presenter.capture(), options.screenshot) if options.screenshot else []
        views = compensation.evened((image.left, image.right), (0, 0))
        shown = ShownPicture(
            str(file),
            mode,
            whole_px[0] if whole_px else (image.width_px, image.height_px),
            image.is_flat,
            eye_clip_costs(models, compensation.mixture, *views, half=image.half),
            compensation.uncancelled((image.left, image.right), half=image.half),
            facts,
            tuple(str(path) for path in files),
            presenter.counters,
            gamma_table=tables_json(loaded),
            read_px=(image.width_px, image.height_px),
        )
        options.on_shown(shown)
        closed = options.screenshot is None and not _escape_pressed(presenter)
        return replace(shown, work=presenter.counters, closed=closed)


def _seen_part(areas: Sequence[EyeArea]) -> Part | None:
    """Return which part of a picture in the middle of each eye's area can be seen; None where it may be all."""
    first = areas[0]
    alike = all(area.view_px == first.view_px and area.squeeze == first.squeeze for area in areas)
    moved = any(area.offset_px != (0, 0) or any(area.mirror) for area in areas)
    return visible_part(first.view_px, first) if alike and not moved else None


def _escape_pressed(presenter: Presenter) -> bool:
    """Wait until Escape is pressed; return False if the window is closed before."""
    try:
        while presenter.surface.wait_key().key != "escape":
            pass
    except WindowClosed:
        return False
    return True
