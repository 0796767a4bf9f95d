"""The report on a comparison: the two pictures compared, the page on them, and an experiment that asks observers.

The page is one HTML file that needs nothing but itself.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from markupsafe import Markup

from documents import Finding, InputError
from documents.files import unwritable, write_whole, writing
from documents.pages import page_environment
from documents.text import with_error
from runner.reports.comparison.experiment import checked_name, write_experiment
from runner.reports.comparison.figures import (
    chromaticity_figure,
    delta_e_figure,
    disparity_figure,
    draw_pictures,
    draw_profiles,
    histogram_figure,
    luminance_figure,
    map_figure,
    measure_figures,
)
from stimuli.comparison import (
    CompareOptions,
    Comparison,
    EyeComparison,
    Outcome,
    compare_pictures,
    decision_sentence,
    outcome_lines,
    passing_heading,
    passing_lines,
)
from stimuli.measures import MeasureTable, printed

_MARKS: dict[Outcome, str] = {"fails": "fails", "cannot say": "not known", "noted": "noted"}

# The measures of two eyes as the page's table names them.
_DEPTH_WORDS = {
    "disparity across": "median disparity across, px",
    "disparity down": "median disparity down, px",
    "roll": "right view turned against left, °",
    "relief": "relief: standard deviation of disparity, px",
    "depth scale": "depth, times the photograph's",
    "disparity left": "what depth differs by from place to place, px",
    "eye luminance": "luminance, ln of right over left",
    "eye contrast": "contrast, ln of right over left",
    "eye agreement": "correlation of both views",
    "one-eyed share": "share of sparkles seen by one eye only",
    "sparkle depth": "mean disparity of sparkles from their surface, px",
}


@dataclass(frozen=True, slots=True, eq=False)
class ComparisonReport:
    """A ``comparison``, the ``page`` on it, and the files of an ``experiment`` if one was written."""

    comparison: Comparison
    page: Path | None
    experiment: tuple[Path, ...]

    @property
    def validated(self) -> bool:
        """Whether the rendering is validated."""
        return self.comparison.verdict.decision == "validated"

    def to_json(self) -> dict[str, Any]:
        """Return the comparison and the places of the files as JSON values."""
        written: dict[str, Any] = {}
        if self.experiment:
            written["experiment"] = [str(file) for file in self.experiment]
        if self.page is not None:
            written["page"] = str(self.page)
        return self.comparison.to_json() | {"written": written}

    def lines(self) -> list[str]:
        """Return the lines that a terminal shows."""
        lines = self.comparison.lines()
        if self.experiment:
            lines.append(f"Experiment: {', '.join(map(str, self.experiment))}")
        if self.page is not None:
            lines.append(f"Page: {self.page}")
        return lines


@dataclass(frozen=True, slots=True)
class _Drawings:
    """The contents of the page for one eye: figures by name, names of profiles, and both pictures as data URLs.

    ``white_cd_m2`` is the luminance that the pictures show as white, which has the colour of the display's white if
    ``white_is_display``, else that of CIELAB's.
    """

    figures: dict[str, Markup]
    profiles: tuple[str, ...]
    photo_url: str
    rendering_url: str
    white_cd_m2: float
    white_is_display: bool


def report_comparison(
    photo: Path,
    rendering: Path,
    regions: Path,
    options: CompareOptions | None = None,
    *,
    page: Path | None = None,
    experiment: str | None = None,
    rig: Path | None = None,
    root: Path = Path(),
    progress: Callable[[str, int, int], None] | None = None,
    settings: Mapping[str, Any] | None = None,
) -> ComparisonReport:
    """Compare a photograph with its rendering, and write a page and an experiment where they are asked for.

    Parameters
    ----------
    photo, rendering, regions, options, progress, settings
        As `compare_pictures` takes them.
    page
        The HTML page to write, whole or not at all; its folder is made if need be.
    experiment
        The name of an experiment that shows both pictures to observers on the ``rig``.
    rig
        The rig of the experiment.
    root
        The folder below which the experiment, its recipe and its pictures are written.

    Returns
    -------
    ComparisonReport
        The comparison, and the places of the files.

    Raises
    ------
    InputError
        If the pictures cannot be compared, or the page or the experiment would take the place of something else:
        nothing is then written; or if one of them cannot be written.
    OSError
        If there is no room for temporary files, or a file cannot be read.
    ValueError
        If there is an ``experiment`` and no ``rig``.
    """
    if experiment is not None and rig is None:
        raise ValueError("an experiment needs a rig")
    if page is not None:
        check_page(page, (photo, rendering, regions))
    if experiment is not None:
        checked_name(experiment, root)
    comparison = compare_pictures(photo, rendering, regions, options, progress=progress, settings=settings)
    files: tuple[Path, ...] = ()
    if experiment is not None and rig is not None:
        with writing(root, "experiment"):
            files = write_experiment(comparison, experiment, rig, root)
    if page is not None:
        with writing(page, "page"):
            write_whole(page, render(comparison))
    return ComparisonReport(comparison, page, files)


def check_page(page: Path, inputs: Sequence[Path]) -> None:
    """Refuse a page that would take the place of something else, or cannot be written there. Raises InputError."""
    if page.suffix.lower() not in (".html", ".htm"):
        raise InputError(Finding("the page is no .html file", str(page), remedy="name one"))
    try:
        is_folder = page.is_dir()
        above = next(folder for folder in page.absolute().parents if folder.exists())
    except OSError as error:
        raise InputError(unwritable(error, page, "page")) from error
    if is_folder:
        raise InputError(Finding("the page would take a folder's place", str(page), remedy="name a file"))
    if not above.is_dir():
        raise InputError(Finding(f"{above} is no folder", str(page), remedy="name another place"))
    if page.exists() and any(file.exists() and page.samefile(file) for file in inputs):
        raise InputError(Finding("an input would be written over", str(page), remedy="name another output"))


def render(comparison: Comparison) -> str:
    """Return the page's HTML; text from people is escaped."""
    from runner.reports.display.page import short, typeset

    # The style is that of the report on a display.
    environment = page_environment("runner.reports.comparison", "runner.reports.display")
    environment.filters.update(
        {
            "short": short,
            "typeset": typeset,
            "places": _places,
            "signed": _signed,
            "printed": printed,
            "with_error": _with_error,
        }
    )
    verdict = comparison.verdict
    return environment.get_template("compare.html.j2").render(
        comparison=comparison,
        sentence=decision_sentence(verdict),
        reasons=[(outcome, mark, line) for outcome, mark in _MARKS.items() for line in outcome_lines(verdict, outcome)],
        passing=passing_lines(verdict),
        passing_heading=passing_heading(verdict),
        eyes=[(eye, result, _drawings(comparison, result, str(eye))) for eye, result in comparison.eyes.items()],
        measures=_measure_figures(comparison.measures),
        depth_figures=_depth_figures(comparison),
        depth_words=_DEPTH_WORDS,
        versions={name: version(name) for name in ("cyclopean", "numpy", "scipy", "opencv-python-headless")},
        settings=[
            (key.replace("_", " "), _plain(value)) for key, value in comparison.settings.items() if key != "regions"
        ],
        steps=[
            (picture, [_in_words(step) for step in picture.steps])
            for picture in (comparison.photo, comparison.rendering)
        ],
    )


def _measure_figures(table: MeasureTable | None) -> list[tuple[str, Markup]]:
    """Return the caption and the figure of each error map."""
    return [
        (
            row.measure.title if eye == "both" else f"{row.measure.title}, {eye} eye",
            Markup(_own_names(svg, f"{eye}-{row.measure.name}")),
        )
        for row in (table.rows if table is not None else ())
        for eye, svg in measure_figures(row).items()
    ]


def _depth_figures(comparison: Comparison) -> list[tuple[Markup, str]]:
    """Return figures of disparities in squares and of sparkles, with captions; none of a flat picture."""
    if comparison.disparity is None:
        return []
    eyes = comparison.disparity.eyes
    drawn = []
    if len(eyes.across):
        label = "How many squares have which disparity, photograph and rendering"
        figure = disparity_figure(eyes.across[:, 0], eyes.across[:, 1], "squares", label)
        drawn.append((figure, "Disparities of squares at the same places."))
    if eyes.sparkles is not None and all(len(one.disparity_px) for one in eyes.sparkles):
        label = "How many sparkles have which disparity, photograph and rendering"
        photo, rendering = (one.disparity_px for one in eyes.sparkles)
        drawn.append(
            (disparity_figure(photo, rendering, "sparkles", label), "Disparities of sparkles that both eyes see.")
        )
    return [(Markup(_own_names(svg, f"depth-{place}")), caption) for place, (svg, caption) in enumerate(drawn)]


def _drawings(comparison: Comparison, result: EyeComparison, eye: str) -> _Drawings:
    limit, table = comparison.verdict.limits.delta_e, result.table
    figures: dict[str, str] = {}
    for name, words, overview in (
        ("plain", "pixel by pixel", result.per_pixel_overview),
        ("seen", "as the eye resolves it", result.seen_overview),
    ):
        if overview is not None:
            figures[f"{name} map"] = map_figure(overview.reduced, f"ΔE00 {words}, 0 to 10")
            label = f"How many pixels differ by how much, {words}"
            figures[f"{name} histogram"] = histogram_figure(overview, limit, label)
    profiles = draw_profiles(result.photo, result.rendering, result.regions.regions)
    for place, (_, svg) in enumerate(profiles):
        figures[f"profile {place}"] = svg
    figures["luminance"] = luminance_figure(table, "Luminance of the photograph over that of the rendering")
    figures["chromaticity"] = chromaticity_figure(table, "Chromaticities, and where the rendering's lie")
    if len(table.rows) > 1:
        figures["bars"] = delta_e_figure(table, limit, "ΔE00 of each region")
    white = comparison.options.display_white_XYZ
    pictures = draw_pictures(result.photo, result.rendering, table.white_XYZ if white is None else white)
    # matplotlib escapes the text that it writes.
    safe = {name: Markup(_own_names(svg, f"{eye}-{name.replace(' ', '-')}")) for name, svg in figures.items()}
    return _Drawings(safe, tuple(name for name, _ in profiles), *pictures, white_is_display=white is not None)


def _own_names(svg: str, prefix: str) -> str:
    """Return a figure whose names no other figure on the page has."""
    names = set(re.findall(r'\bid="([^"]+)"', svg))
    if not names:
        return svg
    pattern = re.compile(
        r'(\bid="|url\(#|href="#)(' + "|".join(sorted(map(re.escape, names), key=len, reverse=True)) + r')(?=["\)])'
    )
    return pattern.sub(lambda match: f"{match[1]}{prefix}-{match[2]}", svg)


def _places(value: float | None, count: int) -> str:
    """Return a number with ``count`` decimals and a real minus sign, a dash for none."""
    if value is None or value != value:
        return "–"
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    text = f"{value:.{count}f}"
    if float(text) == 0:
        text = text.lstrip("-")
    return text.replace("-", "−")


def _signed(value: float, count: int) -> str:
    text = _places(value, count)
    return text if text.startswith("−") or value != value or float(text) == 0 else f"+{text}"


def _with_error(value: float | None, error: float | None, *, signed: bool = False) -> str:
    """Return a number with its error, a real minus sign, and a plus sign if it is ``signed``; a dash for none."""
    if value is None or value != value:
        return "–"
    if math.isinf(value):
        return _places(value, 0)
    text = with_error(value, error)
    plus = "+" if signed and value > 0 and text[0].isdigit() and float(text.split()[0]) > 0 else ""
    return plus + text.replace("-", "−")


def _plain(value: Any) -> str:
    if isinstance(value, tuple | list):
        return " ".join(str(item) for item in value)
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _in_words(step: Any) -> str:
    """Return a step of reading as words."""
    parts = [f"{key.replace('_', ' ')} {_plain(value)}" for key, value in step.items() if key not in ("step", "sha256")]
    return f"{str(step.get('step', '')).replace('_', ' ')}: " + ", ".join(parts)
