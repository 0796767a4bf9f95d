"""One stereo picture on a screen, or its exact codes in a PNG."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

from analysis.records import SurfaceFacts
from devices.compensation import Correction, eye_clip_costs
from devices.display import EYES, Eye, read_display
from documents import Finding
from documents.text import JsonResult
from runner.ports import WindowClosed
from runner.presenter.counters import Counters
from runner.presenter.errors import PresentationError
from runner.presenter.gamma_check import compare_tables, tables_json
from runner.presenter.modes.mode import EyeArea, visible_part
from runner.presenter.modes.options import ModeOptions
from runner.presenter.modes.registry import find_mode
from runner.presenter.presenter import Presenter
from runner.presenter.screenshot import check_screenshot_path, write_screenshot
from runner.presenter.show_options import ShowOptions as ShowOptions
from runner.presenter.surfaces.opening import open_surface
from runner.scene import Picture, Scene
from stimuli.pictures import Part, Region, read_picture


@dataclass(frozen=True, slots=True)
class ShownPicture(JsonResult):
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
    json_keys: ClassVar = {"work": None, "closed": None}

    def told(self) -> list[str]:
        """Return what was shown, and what the gamut clip and crosstalk cost each eye, a line each."""
        width, height = self.picture_px
        lines = [f"{self.file}: {width} × {height} px, {'flat' if self.flat else 'stereo'}, shown {self.mode}"]
        if self.read_px != self.picture_px:
            lines[0] += "; of it {} × {} px are seen, to which the numbers apply".format(*self.read_px)
        for eye, share in self.clipping.items():
            channels = ", ".join(f"{name} {share[f'percent_{name}']:.2f}" for name in ("red", "green", "blue"))
            lines.append(
                f"{eye} eye: {share['percent_any']:.2f} % of the pixels lie outside the gamut ({channels} %), "
                f"{share['percent_above_full']:.2f} % above full drive; "
                f"that costs {share['delta_e_00_mean']:.3f} ΔE00 on average, at most {share['delta_e_00_max']:.1f}"
            )
            if "projection_delta_e_00_mean" in share:
                lines.append(
                    f"{eye} eye: the anaglyph's filters change colours besides by "
                    f"{share['projection_delta_e_00_mean']:.3f} ΔE00 on average, at most "
                    f"{share['projection_delta_e_00_max']:.1f}"
                )
            if self.crosstalk:
                lines.append(f"{eye} eye: {_ghosts(self.crosstalk[eye])}")
        lines += [f"written: {path}" for path in self.screenshots]
        return lines


def _ghosts(cost: Mapping[str, float]) -> str:
    """Say what crosstalk could not be cancelled for an eye."""
    where = []
    if cost["percent_negative"]:
        where.append(
            f"at {cost['percent_negative']:.2f} % of the pixels, which keep a ghost of the other eye's picture"
        )
    if cost["percent_above_full"]:
        where.append(f"at {cost['percent_above_full']:.2f} % of the pixels, which would need more than full drive")
    if not where:
        return "crosstalk is cancelled at every pixel"
    return (
        f"crosstalk cannot be cancelled {' and '.join(where)}; what this eye sees is {cost['delta_e_00_mean']:.3f} "
        f"ΔE00 on average, at most {cost['delta_e_00_max']:.1f}, from what was asked"
    )


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
    ...     options = ShowOptions(screenshot=Path(folder) / "codes.png", headless=True)
    ...     shown = show_picture(file, display, "side-by-side", options)
    >>> shown.picture_px, shown.flat, shown.clipping["left"]["percent_any"]
    ((30, 20), True, 0.0)
    """
    options = options or ShowOptions()
    if options.headless and options.screenshot is None:
        remedy = "add --screenshot OUT.png"
        raise PresentationError(Finding("without a window there is nothing to see", remedy=remedy))
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
            options.backend if options.headless else "window",
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
