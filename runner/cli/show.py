"""`cyclopean show`: one stereo image on the screen, or its exact code values in a PNG."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal

import click

if TYPE_CHECKING:
    from devices.display.display_file import Eye

_BITS: Mapping[str, Literal[8, 10]] = MappingProxyType({"8": 8, "10": 10})


@click.command(short_help="Show one stereo image with the display's response inverted.")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--display", "display_file", type=click.Path(path_type=Path), required=True, help="Display file.")
@click.option("--mode", required=True, help="Stereo mode that the display was characterised in.")
@click.option(
    "--screenshot", type=click.Path(path_type=Path), help="PNG file to write with the framebuffer's codes; then exit."
)
@click.option("--headless", is_flag=True, help="Draw without a window, at the panel's resolution.")
@click.option(
    "--backend", type=click.Choice(["egl", "null"]), default="egl", show_default=True, help="Where to draw if headless."
)
@click.option("--windowed", is_flag=True, help="Use a window instead of the full screen.")
@click.option(
    "--colour-space",
    type=click.Choice(["xyz", "rec709"]),
    help="Colour space of the file's values, if it does not say.",
)
@click.option("--white-luminance", type=float, metavar="CD_M2", help="Luminance of the value 1.")
@click.option("--clip-negative", is_flag=True, help="Set negative XYZ to 0 instead of refusing the picture.")
@click.option("--flat", is_flag=True, help="Show the centre view to both eyes.")
@click.option(
    "--mode-option",
    "mode_options",
    multiple=True,
    metavar="KEY=VALUE",
    help="Option of the stereo mode, as in a rig file: swap_eyes=true.",
)
@click.option(
    "--bits",
    type=click.Choice(list(_BITS)),
    help="Bits of a channel's codes. Default: 10 for a panel that has them, if the driver does.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    file: Path,
    display_file: Path,
    mode: str,
    screenshot: Path | None,
    headless: bool,
    backend: str,
    windowed: bool,
    colour_space: Literal["xyz", "rec709"] | None,
    white_luminance: float | None,
    clip_negative: bool,
    flat: bool,
    mode_options: tuple[str, ...],
    bits: str | None,
    as_json: bool,
) -> None:
    """Show one stereo image with the display's response inverted.

    FILE is an OpenEXR picture; it stands at 1:1 in the middle of each eye's area until Escape is pressed. The
    shares of pixels that the display cannot show are printed for each eye. Crosstalk and a gain map of the display
    file are compensated. Where both eyes see the same pixels, the flat version is shown.
    Of a screenshot of 10 bits, the upper 10 of each 16-bit value are the code.
    """
    from devices.compensation.compensate import Correction
    from devices.compensation.eye_costs import eye_clip_costs
    from devices.display.display_file import read_display
    from runner.cli.main import WorkError
    from runner.ports import WindowClosed
    from runner.presenter.errors import GraphicsError
    from runner.presenter.modes.options import ModeOptions
    from runner.presenter.modes.registry import find_mode
    from runner.presenter.presenter import Presenter
    from runner.presenter.scene import Picture, Scene
    from runner.presenter.screenshot import check_screenshot_path, write_screenshot
    from runner.presenter.surfaces.surface import open_surface
    from stimuli.pictures.exr_read import read_exr

    if headless and screenshot is None:
        raise click.UsageError("Without a window there is nothing to see: add --screenshot OUT.png.")
    if screenshot is not None:
        check_screenshot_path(screenshot)
    display = read_display(display_file)
    models = display.models(mode)
    stereo_mode = find_mode(mode, ModeOptions.parse(dict(map(_option, mode_options))))
    areas = stereo_mode.areas(display.panel.resolution_px)
    alike = stereo_mode.mixture(models) is None and any(len(area.eyes) > 1 for area in areas)
    image = read_exr(
        file,
        colour_space,
        flat=flat or alike,
        white_luminance_cd_m2=white_luminance,
        negative="clip" if clip_negative else "refuse",
    )
    correction = Correction(display.crosstalk(mode), display.gain_map(mode))
    compensation = stereo_mode.compensation(models, display.panel.resolution_px, correction)
    try:
        with (
            open_surface(
                backend if headless else "window",
                display.panel.resolution_px,
                stereo=stereo_mode.needs_stereo,
                windows=stereo_mode.windows,
                windowed=windowed,
                bits=_BITS[bits] if bits else display.panel.code_bits,
            ) as surface,
            Presenter(surface, stereo_mode, models, lambda _: image, correction=correction) as presenter,
        ):
            if display.panel.bits < surface.facts.bits == 10:
                told = f"codes have {surface.facts.bits} bits, and the panel has {display.panel.bits}"
                click.echo(f"warning: {told} ({display_file})", err=True)
            for remark in surface.facts.remarks:
                click.echo(f"warning: {remark}", err=True)
            presenter.show(Scene((Picture(str(file)),)))
            files = write_screenshot(presenter.capture(), screenshot) if screenshot else []
            shown = _Shown(
                str(file),
                mode,
                (image.width_px, image.height_px),
                image.is_flat,
                eye_clip_costs(models, compensation.mixture, *compensation.evened((image.left, image.right), (0, 0))),
                asdict(surface.facts),
                tuple(str(path) for path in files),
            )
            click.echo(json.dumps(asdict(shown), indent=1) if as_json else _in_words(shown))
            while screenshot is None and surface.wait_key().key != "escape":
                pass
            work = presenter.counters
            if work.frames_alternated:
                seen = f"{work.frames_alternated} frames in turn, {work.frames_missed} refreshes missed"
                click.echo(seen, err=as_json)
    except WindowClosed:
        pass
    except GraphicsError as error:
        raise WorkError(str(error)) from error


def _option(text: str) -> tuple[str, object]:
    """Return the key and value of ``KEY=VALUE``, the value as YAML reads it."""
    import yaml

    from runner.presenter.errors import PresentationError

    key, equals, value = text.partition("=")
    try:
        return key.strip(), yaml.safe_load(value) if equals else None
    except yaml.YAMLError as error:
        raise PresentationError(f"the mode option '{text}' cannot be read: {error}".splitlines()[0]) from None


@dataclass(frozen=True, slots=True)
class _Shown:
    file: str
    mode: str
    picture_px: tuple[int, int]
    flat: bool
    clipping: Mapping[Eye, dict[str, float]]
    surface: dict[str, object]
    screenshots: tuple[str, ...]


def _in_words(shown: _Shown) -> str:
    width, height = shown.picture_px
    lines = [f"{shown.file}: {width} × {height} px, {'flat' if shown.flat else 'stereo'}, shown {shown.mode}"]
    for eye, share in shown.clipping.items():
        channels = ", ".join(f"{name} {share[f'percent_{name}']:.2f}" for name in ("red", "green", "blue"))
        lines.append(
            f"{eye} eye: {share['percent_any']:.2f} % of the pixels lie outside the gamut ({channels} %), "
            f"{share['percent_above_full']:.2f} % above full drive; "
            f"that costs {share['delta_e_00_mean']:.3f} ΔE00 on average, at most {share['delta_e_00_max']:.1f}"
        )
    lines += [f"written: {path}" for path in shown.screenshots]
    return "\n".join(lines)
