"""The report on a display: one HTML page that needs nothing but itself."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from devices.diagnostics.diagnosis import Diagnosis
from documents.files.whole_file import write_whole
from documents.pages.environment import page_environment

_SECTIONS = (
    ("passed", "Passed"),
    ("failed", "Failed"),
    ("told", "No limit"),
    ("open", "Not judged"),
)


@dataclass(frozen=True, slots=True)
class Verdicts:
    """What is reported: the title, the checks, and what readers of the files took for granted."""

    title: str
    diagnoses: tuple[Diagnosis, ...]
    notes: tuple[str, ...] = ()

    @property
    def passed(self) -> int:
        """How many checks passed."""
        return sum(one.passed is True for one in self.diagnoses)

    @property
    def failed(self) -> int:
        """How many checks failed."""
        return sum(one.passed is False for one in self.diagnoses)

    @property
    def sentence(self) -> str:
        """The outcome, in a sentence."""
        judged = self.passed + self.failed
        if not judged:
            return "Nothing could be judged by these readings."
        open_ = sum(verdict(one) == "open" for one in self.diagnoses)
        rest = f" {open_} could not be judged." if open_ else ""
        if not self.failed:
            return f"All {judged} checks that could be made passed.{rest}"
        return f"{self.failed} of {judged} checks failed.{rest}"

    def to_json(self) -> dict[str, Any]:
        """Return everything as JSON values."""
        return {
            "title": self.title,
            "passed": self.passed,
            "failed": self.failed,
            "notes": list(self.notes),
            "diagnoses": [one.to_json() for one in self.diagnoses],
        }


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
    environment.filters["verdict"] = verdict
    sections = []
    for number, one in enumerate(verdicts.diagnoses, start=1):
        pictures = [
            # matplotlib escapes the text that it writes.
            Markup(panel_svg(panel, f"f{number}p{index}", f"{one.title}: {panel.y_label} over {panel.x_label}"))
            for index, panel in enumerate(one.series, start=1)
        ]
        sections.append((number, one, pictures))
    return environment.get_template("page.html.j2").render(verdicts=verdicts, sections=sections, names=dict(_SECTIONS))


def verdict(diagnosis: Diagnosis) -> str:
    """Return ``passed``, ``failed``, ``told`` (a number without a limit) or ``open`` (not judged)."""
    if diagnosis.passed is not None:
        return "passed" if diagnosis.passed else "failed"
    return "told" if diagnosis.value is not None else "open"


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
