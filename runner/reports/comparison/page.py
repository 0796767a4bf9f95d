"""The page on a comparison: one HTML file that needs nothing but itself."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from typing import Any

from documents.files.whole_file import write_whole
from documents.pages.environment import page_environment
from runner.reports.comparison.words import decision_sentence, kept, kept_heading, told
from stimuli.comparison.reason import Outcome
from stimuli.comparison.results import Comparison, EyeComparison

_MARKS: dict[Outcome, str] = {"fails": "fails", "cannot say": "not known", "noted": "noted"}


def write_page(found: Comparison, output: Path) -> None:
    """Write the page to ``output``, whole or not at all; its folder is made if need be. Raises OSError if it cannot."""
    write_whole(output, render(found))


def render(found: Comparison) -> str:
    """Return the page's HTML; text from people is escaped. ``found`` must have been drawn."""
    from runner.reports.display.page import short, typeset

    # The style is that of the report on a display.
    environment = page_environment("runner.reports.comparison", "runner.reports.display")
    environment.filters.update({"short": short, "typeset": typeset, "places": _places, "signed": _signed})
    eyes = [(eye, one, _figures(one, found.verdict.limits.delta_e, str(eye))) for eye, one in found.eyes.items()]
    return environment.get_template("compare.html.j2").render(
        found=found,
        sentence=decision_sentence(found.verdict),
        reasons=[(outcome, mark, line) for outcome, mark in _MARKS.items() for line in told(found.verdict, outcome)],
        kept=kept(found.verdict),
        kept_heading=kept_heading(found.verdict),
        eyes=eyes,
        versions={name: version(name) for name in ("cyclopean", "numpy", "scipy", "opencv-python-headless")},
        settings=[(key.replace("_", " "), _plain(value)) for key, value in found.settings.items() if key != "regions"],
        steps=[(picture, [_told(step) for step in picture.steps]) for picture in (found.photo, found.rendering)],
    )


def _figures(one: EyeComparison, limit: float, eye: str) -> dict[str, Any]:
    from markupsafe import Markup

    from stimuli.comparison.region_figures import chromaticity_figure, delta_e_figure, luminance_figure

    figures = dict(one.drawn.figures) if one.drawn else {}
    for place, (_, svg) in enumerate(one.drawn.profiles if one.drawn else ()):
        figures[f"profile {place}"] = svg
    figures["luminance"] = luminance_figure(one.table, "Luminance of the photograph over that of the rendering")
    figures["chromaticity"] = chromaticity_figure(one.table, "Chromaticities, and where the rendering's lie")
    if len(one.table.rows) > 1:
        figures["bars"] = delta_e_figure(one.table, limit, "ΔE00 of each region")
    # matplotlib escapes the text that it writes.
    return {name: Markup(_own_names(svg, f"{eye}-{name.replace(' ', '-')}")) for name, svg in figures.items()}


def _own_names(svg: str, prefix: str) -> str:
    """Return a figure whose names no other figure on the page has."""
    import re

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


def _told(step: Any) -> str:
    """Return a step of reading as words."""
    parts = [f"{key.replace('_', ' ')} {_plain(value)}" for key, value in step.items() if key not in ("step", "sha256")]
    return f"{str(step.get('step', '')).replace('_', ' ')}: " + ", ".join(parts)
