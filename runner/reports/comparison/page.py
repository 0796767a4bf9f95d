"""The page on a comparison: one HTML file that needs nothing but itself."""

from __future__ import annotations

import re
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from markupsafe import Markup

from documents.files.whole_file import write_whole
from documents.pages.environment import page_environment
from runner.reports.comparison.figures import (
    chromaticity_figure,
    delta_e_figure,
    draw_pictures,
    draw_profiles,
    histogram_figure,
    luminance_figure,
    map_figure,
)
from stimuli.comparison.results import Comparison, EyeComparison
from stimuli.comparison.verdict import Outcome
from stimuli.comparison.wording import decision_sentence, outcome_lines, passing_heading, passing_lines

_MARKS: dict[Outcome, str] = {"fails": "fails", "cannot say": "not known", "noted": "noted"}


@dataclass(frozen=True, slots=True)
class _Drawings:
    """What the page shows of one eye: figures by name, names of profiles, and both pictures as data URLs.

    ``white_cd_m2`` is the luminance that the pictures show as white, which has the colour of the display's white if
    ``white_is_display``, else that of CIELAB's.
    """

    figures: dict[str, Markup]
    profiles: tuple[str, ...]
    photo_url: str
    rendering_url: str
    white_cd_m2: float
    white_is_display: bool


def write_page(comparison: Comparison, output: Path) -> None:
    """Write the page to ``output``, whole or not at all; its folder is made if need be. Raises OSError if it cannot."""
    write_whole(output, render(comparison))


def render(comparison: Comparison) -> str:
    """Return the page's HTML; text from people is escaped."""
    from runner.reports.display.page import short, typeset

    # The style is that of the report on a display.
    environment = page_environment("runner.reports.comparison", "runner.reports.display")
    environment.filters.update({"short": short, "typeset": typeset, "places": _places, "signed": _signed})
    verdict = comparison.verdict
    return environment.get_template("compare.html.j2").render(
        comparison=comparison,
        sentence=decision_sentence(verdict),
        reasons=[(outcome, mark, line) for outcome, mark in _MARKS.items() for line in outcome_lines(verdict, outcome)],
        passing=passing_lines(verdict),
        passing_heading=passing_heading(verdict),
        eyes=[(eye, result, _drawings(comparison, result, str(eye))) for eye, result in comparison.eyes.items()],
        versions={name: version(name) for name in ("cyclopean", "numpy", "scipy", "opencv-python-headless")},
        settings=[
            (key.replace("_", " "), _plain(value)) for key, value in comparison.settings.items() if key != "regions"
        ],
        steps=[
            (picture, [_in_words(step) for step in picture.steps])
            for picture in (comparison.photo, comparison.rendering)
        ],
    )


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
    text = f"{value:.{count}f}"
    if float(text) == 0:
        text = text.lstrip("-")
    return text.replace("-", "−")


def _signed(value: float, count: int) -> str:
    text = _places(value, count)
    return text if text.startswith("−") or value != value or float(text) == 0 else f"+{text}"


def _plain(value: Any) -> str:
    if isinstance(value, tuple | list):
        return " ".join(str(one) for one in value)
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _in_words(step: Any) -> str:
    """Return a step of reading as words."""
    parts = [f"{key.replace('_', ' ')} {_plain(value)}" for key, value in step.items() if key not in ("step", "sha256")]
    return f"{str(step.get('step', '')).replace('_', ' ')}: " + ", ".join(parts)
