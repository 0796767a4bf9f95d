"""Contrast over exposure of a set of stimuli: the numbers, and a figure after thesis Figures 4.10 and 4.11."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from devices.display import AskMonitor
from documents import Finding, InputError, WorkError
from documents.figures import DEEP, FAINT, INK, SERIES_COLOURS, WIDE_IN, Drawing, drawing, drawn
from documents.files import whole_file, write_whole, writing
from documents.options import Typed
from documents.text import did_you_mean
from extensions.sparkle.exposures import ContrastOverExposure, contrast_over_exposure, exposure_words
from stimuli.build import StimulusSet, build_set, display_of
from stimuli.pictures import StereoImage
from stimuli.recipes import DisplaySetup
from stimuli.sparkles import SparkleThreshold

_SHOWN = SERIES_COLOURS[1]


def contrast(
    recipe: Path,
    *,
    rig: Annotated[Path | None, Typed(metavar="RIG.yaml")] = None,
    pixel_pitch_mm: Annotated[float | None, Typed(metavar="MM")] = None,
    names: Annotated[Sequence[str], Typed("--stimuli", "NAME,...", read="documents.options.names_of")] = (),
    mean_cd_m2: Annotated[float | None, Typed("--mean", "CD_M2")] = None,
    times: Annotated[float, Typed(least=1, above=True)] = 2.0,
    figure: Annotated[Path | None, Typed("-o --output", "FIGURE.svg|.pdf")] = None,
    ask_monitor: AskMonitor | None = None,
    progress: Callable[[str, int, int], None] = lambda what, done, of: None,
) -> ContrastOverExposure:
    """Contrast of sparkles over the exposure of their photographs.

    RECIPE photographs one plate at two exposures or more; its pictures are built, or taken from the cache. All are
    measured at the sparkles of the shortest exposure: long exposures fill the sensor, and the contrast falls.

    Parameters
    ----------
    recipe
        Recipe of the pictures.
    rig
        Rig that will show the pictures; its display clips them.
    pixel_pitch_mm
        Pixel pitch of the display, if there is no rig.
    names
        Pictures of one plate. Default: all that were not scaled.
    mean_cd_m2
        Mean luminance to bring each picture to before.
    times
        A sparkle is so many times as bright as its background.
    figure
        Figure to write.
    ask_monitor, progress
        As for `stimuli.build.build_report`.

    Raises
    ------
    InputError
        If a file is wrong, a name is not there or has no exposure, or two pictures have one exposure.
    WorkError
        If the figure cannot be written.
    """
    if figure is not None and figure.suffix.lower() not in (".svg", ".pdf"):
        raise InputError(Finding("the figure is no .svg or .pdf file", str(figure), remedy="name one"))
    shown_by, pitch_mm = display_of(rig, pixel_pitch_mm, ask_monitor)
    built = build_set(recipe, pitch_mm, progress, setup=None if shown_by is None else DisplaySetup.of(shown_by))
    models = None if shown_by is None else shown_by.models
    found = contrast_over_exposure(
        _pictures(built, names), models, threshold=SparkleThreshold(times), mean_cd_m2=mean_cd_m2
    )
    if figure is not None:
        with writing(figure, "figure", WorkError):
            write_figure(found, figure)
    return replace(found, figure=figure)


def _pictures(built: StimulusSet, names: Sequence[str]) -> list[tuple[str, float, StereoImage]]:
    """Return the pictures ``names`` of a set, each with its name and exposure in s.

    Without names, all pictures with an exposure are taken whose luminance was not scaled; of one in stereo and flat the
    stereo one.
    """
    file = str(built.recipe_path)
    chosen: dict[str, float] = {}
    for name in names:
        if name not in built.names:
            remedy = did_you_mean(name, built.names)
            raise InputError(Finding(f"there is no stimulus '{name}'", file, remedy=remedy))
        exposure_s = _statistics(built, name)["exposure_s"]
        if exposure_s is None:
            raise InputError(Finding(f"the stimulus '{name}' has no exposure", file, remedy="leave it out"))
        chosen[name] = exposure_s
    if not names:
        told = {name: _statistics(built, name) for name in built.names}
        plain = {name: of["exposure_s"] for name, of in told.items() if of["luminance_scale"] == 1}
        chosen = {name: exposure_s for name, exposure_s in plain.items() if exposure_s is not None}
        in_stereo = {built.factors(name).get("image") for name in chosen if _is_stereo(built, name)}
        chosen = {
            name: exposure_s
            for name, exposure_s in chosen.items()
            if _is_stereo(built, name) or built.factors(name).get("image") not in in_stereo
        }
    by_time: dict[float, str] = {}
    for name, exposure_s in chosen.items():
        if exposure_s in by_time:
            raise InputError(
                Finding(
                    f"'{by_time[exposure_s]}' and '{name}' have one exposure, {exposure_s:g} s",
                    file,
                    remedy="name the pictures of one plate with --stimuli NAME,NAME,...",
                )
            )
        by_time[exposure_s] = name
    return [(name, exposure_s, built.load(name)) for name, exposure_s in chosen.items()]


def _statistics(built: StimulusSet, name: str) -> dict[str, Any]:
    found: dict[str, Any] = built.entry(name)["statistics"]
    return found


def _is_stereo(built: StimulusSet, name: str) -> bool:
    return built.factors(name).get("view") == "stereo"


def write_figure(found: ContrastOverExposure, figure: Path) -> None:
    """Write the figure as SVG or PDF, by its suffix, whole or not at all. Raises OSError if it cannot be written."""
    made = contrast_figure(found)
    if figure.suffix.lower() == ".svg":
        write_whole(figure, made.svg_file())
    else:
        with whole_file(figure) as draft:
            draft.write_bytes(made.pdf())


def contrast_figure(found: ContrastOverExposure) -> Drawing:
    """Return two panels over exposure: light on the sensor of sparkles and background, and their contrast."""
    from matplotlib.ticker import LogLocator, StrMethodFormatter

    times = [row.exposure_s for row in found.rows]
    with drawing("contrast-over-exposure", WIDE_IN, 3.2) as (figure, axes):
        figure.clear()
        left, right = figure.subplots(1, 2)
        for name, colour, marker, values in (
            ("sparkles", DEEP, "o", [row.exposed_sparkle_cd_s_m2 for row in found.rows]),
            ("background", INK, "s", [row.exposed_background_cd_s_m2 for row in found.rows]),
        ):
            left.plot(times, values, marker=marker, color=colour, linewidth=1.3, markersize=4.5, label=name)
        left.set_ylabel("luminance × exposure (cd·s/m²)", color=INK)
        left.set_yscale("log")
        left.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        left.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        series = [("as photographed", DEEP, "o", [row.as_photographed for row in found.rows])]
        shown = [row.as_shown for row in found.rows if row.as_shown is not None]
        if shown:
            series.append(("on the display", _SHOWN, "s", shown))
        for name, colour, marker, contrasts in series:
            values = [one.contrast.value for one in contrasts]
            errors = [one.contrast.se for one in contrasts]
            right.errorbar(
                times, values, yerr=errors, marker=marker, color=colour, linewidth=1.3, markersize=4.5, label=name
            )
        right.set_ylabel("Weber contrast of sparkles", color=INK)
        right.set_ylim(bottom=0)
        for axes in (left, right):
            axes.set_xscale("log")
            axes.set_xticks(times, [exposure_words(time) for time in times])
            axes.minorticks_off()
            axes.set_xlabel("exposure (s)", color=INK)
            axes.grid(color=FAINT, linewidth=0.7)
            axes.set_axisbelow(True)
            axes.spines[["top", "right"]].set_visible(False)
            axes.patch.set_alpha(0)
            axes.legend(frameon=False, fontsize=9)
        return drawn(figure, f"Contrast of {found.sparkles} sparkles over exposure, {found.eye} eye")
