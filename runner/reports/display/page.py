"""The report on a display: each check with its verdict, its figures and its numbers."""

from __future__ import annotations

import math
import re

from devices.diagnostics import Diagnosis, Verdicts
from documents.pages import Beside, Block, Cell, Column, Figure, Mark, Page, Paragraph, Section, Shown, Table, Verbatim
from runner.reports.display.figure import draw_panel

MARKS = {
    "passed": Mark("Passed", "good"),
    "failed": Mark("Failed", "bad"),
    "no_limit": Mark("No limit"),
    "open": Mark("Not judged"),
}
_VERDICTS = (
    Column("Check", "check"),
    Column("Verdict", "verdict"),
    Column("Found", "found", "number"),
    Column("Limit", "limit", "number"),
    Column("Unit", "unit"),
)


def page_of(verdicts: Verdicts) -> Page:
    """Return what the page says."""
    rows = tuple(_row(one) for one in verdicts.diagnoses)
    return Page(
        kind="Display report",
        title=verdicts.title,
        of="display report",
        sentences=(verdicts.sentence,),
        notes=verdicts.notes,
        sections=(
            Section("verdicts", "Verdicts", (Table("verdicts", "", _VERDICTS, rows),)),
            *(_section(number, one) for number, one in enumerate(verdicts.diagnoses, start=1)),
        ),
    )


def _row(one: Diagnosis) -> tuple[Cell, ...]:
    name = f"{one.title}, {one.subject}" if one.subject else one.title
    if one.value is None:
        return name, MARKS[one.verdict], "", "", ""
    return name, MARKS[one.verdict], _shown(one.value), limit_words(one), one.unit


def limit_words(one: Diagnosis) -> str:
    """Return a check's limit, such as "at most 0.5"; nothing where there is none."""
    return "" if one.limit is None else f"{'at least' if one.at_least else 'at most'} {short(one.limit)}"


def _section(number: int, one: Diagnosis) -> Section:
    limit = f"; limit: {limit_words(one)}" if one.limit is not None else ""
    value = "" if one.value is None else f"{short(one.value)} {one.unit}{limit}"
    blocks: list[Block] = [Paragraph(value, mark=MARKS[one.verdict]), Paragraph(typeset(one.words))]
    beside = [
        Figure(f"{one.name}_{index}", draw_panel(panel, f"{one.title}: {panel.y_label} over {panel.x_label}"))
        for index, panel in enumerate(one.series, start=1)
    ]
    table = [] if one.table is None else [_table(one.name, one.table.header, one.table.rows)]
    if beside or table:
        blocks.append(Beside((*beside, *table)))
    if one.output:
        blocks += [Paragraph("For the display file, inside the mode:", small=True), Verbatim(one.output)]
    blocks.append(Paragraph(f"{'' if one.verdict == 'no_limit' else 'Limit: '}{one.source}.", small=True))
    return Section(f"check-{number}", one.title, tuple(blocks), one.subject)


def _table(name: str, header: tuple[str, ...], rows: tuple[tuple[float | str | None, ...], ...]) -> Table:
    columns = tuple(Column(head, head, "number" if place else "text") for place, head in enumerate(header))
    return Table(name, "", columns, tuple(tuple(_shown(cell) for cell in row) for row in rows))


def _shown(value: float | str | None) -> Cell:
    return typeset(value) if isinstance(value, str) else Shown(value, short(value))


def typeset(text: str) -> str:
    """Return ``text`` with real minus signs before its numbers."""
    return re.sub(r"(?<![\w@-])-(?=\d)", "−", text)


def short(value: float | None) -> str:
    """Return a number with three or four figures and a real minus sign, a dash for none."""
    if value is None or math.isnan(value):
        return "–"
    if value == 0:
        return "0"
    digits = 4 if 0.9 <= abs(value) < 1 or abs(value) >= 100 else 3
    text = f"{value:.{digits}g}"
    if "e" in text:
        text = f"{value:.0f}" if abs(value) >= 1 else f"{value:.1e}"
    return text.replace("-", "−")
