"""`cyclopean show`: one stereo image on the screen, or its exact code values in a PNG."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal

import click

from runner.cli.monitor_option import monitor_option
from runner.cli.options import NUMBER

if TYPE_CHECKING:
    from runner.presenter.show import ShownPicture
    from stimuli.pictures import ColourSpace, Packing

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
@monitor_option
@click.option(
    "--colour-space",
    type=click.Choice(["srgb", "display-p3", "adobe-rgb", "rec2020", "icc", "xyz", "rec709"]),
    help="Colour space of the file, if it does not state it; xyz and rec709 are linear light.",
)
@click.option(
    "--white-luminance",
    type=NUMBER,
    metavar="CD_M2",
    help="Luminance of the value 1, or of an ordinary picture's white.",
)
@click.option("--right", metavar="FILE", help="The right eye's file, if FILE is the left eye's alone.")
@click.option(
    "--packing",
    metavar="LAYOUT",
    help="How both eyes lie in an ordinary picture: side-by-side or top-bottom, then -half, -crossed or both.",
)
@click.option(
    "--flat-eye", type=click.Choice(["left", "right"]), help="The eye whose picture both eyes see if the mode is flat."
)
@click.option(
    "--alpha-background", type=NUMBER, metavar="CD_M2", help="Luminance of the grey behind a transparent picture."
)
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
    backend: Literal["egl", "null"],
    windowed: bool,
    monitors: tuple[str, ...],
    colour_space: ColourSpace | None,
    white_luminance: float | None,
    right: str | None,
    packing: Packing | None,
    flat_eye: Literal["left", "right"] | None,
    alpha_background: float | None,
    clip_negative: bool,
    flat: bool,
    mode_options: tuple[str, ...],
    bits: str | None,
    as_json: bool,
) -> None:
    """Show one stereo image with the display's response inverted.

    FILE is an OpenEXR picture, or a PNG, JPEG, TIFF, WebP, MPO or JPS with its --white-luminance. It stands at 1:1 in
    the middle of each eye's area until Escape is pressed. The shares of pixels that the display cannot show, and that
    keep a ghost of the other eye's picture, are printed for each eye. Crosstalk and a gain map of the display file are
    compensated. Where both eyes see the same pixels, the flat version is shown.
    Of a screenshot of 10 bits, the upper 10 of each 16-bit value are the code.
    """
    from documents import WorkError
    from runner.presenter.errors import GraphicsError
    from runner.presenter.show import ShowOptions, show_picture

    if headless and screenshot is None:
        raise click.UsageError("Without a window there is nothing to see: add --screenshot OUT.png.")

    def report(shown: ShownPicture) -> None:
        click.echo(json.dumps(shown.to_json(), indent=1) if as_json else _in_words(shown))

    options = ShowOptions(
        screenshot=screenshot,
        backend=backend if headless else "window",
        windowed=windowed,
        monitors=monitors,
        colour_space=colour_space,
        white_luminance_cd_m2=white_luminance,
        right=right,
        packing=packing,
        flat_eye=flat_eye,
        alpha_background_cd_m2=alpha_background,
        clip_negative=clip_negative,
        flat=flat,
        mode_options=dict(map(_option, mode_options)),
        bits=_BITS[bits] if bits else None,
        notify=lambda line: click.echo(line, err=True),
        on_shown=report,
    )
    try:
        shown = show_picture(file, display_file, mode, options)
    except GraphicsError as error:
        raise WorkError(str(error)) from error
    work = shown.work
    if work.frames_alternated and not shown.closed:
        click.echo(f"{work.frames_alternated} frames in turn, {work.frames_missed} refreshes missed", err=as_json)


def _option(text: str) -> tuple[str, object]:
    """Return the key and value of ``KEY=VALUE``, the value as YAML reads it."""
    import yaml

    from runner.presenter.errors import PresentationError

    key, equals, value = text.partition("=")
    try:
        return key.strip(), yaml.safe_load(value) if equals else None
    except yaml.YAMLError as error:
        raise PresentationError(f"the mode option '{text}' cannot be read: {error}".splitlines()[0]) from None


def _in_words(shown: ShownPicture) -> str:
    width, height = shown.picture_px
    lines = [f"{shown.file}: {width} × {height} px, {'flat' if shown.flat else 'stereo'}, shown {shown.mode}"]
    if shown.read_px != shown.picture_px:
        lines[0] += "; of it {} × {} px are seen, to which the numbers apply".format(*shown.read_px)
    for eye, share in shown.clipping.items():
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
        if shown.crosstalk:
            lines.append(f"{eye} eye: {_ghosts(shown.crosstalk[eye])}")
    lines += [f"written: {path}" for path in shown.screenshots]
    return "\n".join(lines)


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
