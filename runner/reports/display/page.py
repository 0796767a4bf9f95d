"""The report on a display: one HTML page that needs nothing but itself."""

from __future__ import annotations

import math
import re
from pathlib import Path

from devices.diagnostics import Verdicts
from documents.files import write_whole
from documents.pages import page_environment

_SECTIONS = (
    ("passed", "Passed"),
    ("failed", "Failed"),
    ("no_limit", "No limit"),
    ("open", "Not judged"),
)


def write_page(verdicts: Verdicts, output: Path) -> None:
    """Write the page to ``output``, whole or not at all; its folder is made if need be. Raises OSError if it cannot."""
    page = render(verdicts)
    write_whole(output, page)


def render(verdicts: Verdicts) -> str:
    """Return the page's HTML; text from people is escaped."""
    from markupsafe import Markup

    from runner.reports.display.figure import panel_svg

    environment = page_environment("runner.reports.display")
    environment.filters["short"] = short
    environment.filters["typeset"] = typeset
    sections = []
    for number, diagnosis in enumerate(verdicts.diagnoses, start=1):
        pictures = [
            # matplotlib escapes the text that it writes.
            Markup(panel_svg(panel, f"f{number}p{index}", f"{diagnosis.title}: {panel.y_label} over {panel.x_label}"))
            for index, panel in enumerate(diagnosis.series, start=1)
        ]
        sections.append((number, diagnosis, pictures))
    return environment.get_template("page.html.j2").render(verdicts=verdicts, sections=sections, names=dict(_SECTIONS))


def typeset(text: str) -> str:
    """Return ``text`` with real minus signs before its numbers."""
    return re.sub(r"(?<![\w@-])-(?=\d)", "−", text)


def short(value: float | str | None) -> str:
    """Return a number with three or four figures and a real minus sign, text as it is, a dash for none."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "–"
    if isinstance(value, str):
        return typeset(value)
    if value == 0:
        return "0"
    digits = 4 if 0.9 <= abs(value) < 1 or abs(value) >= 100 else 3
    text = f"{value:.{digits}g}"
    if "e" in text:
        text = f"{value:.0f}" if abs(value) >= 1 else f"{value:.1e}"
    return text.replace("-", "−")
