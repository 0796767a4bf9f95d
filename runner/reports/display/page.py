"""The report on a display: each check with its verdict, its figures and its numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, ClassVar

from devices.diagnostics import Diagnosis, JudgeOptions, Verdicts, judge_display
from documents import WorkError
from documents.files import writing
from documents.options import Typed
from documents.pages import (
    Badge,
    Beside,
    Block,
    Cell,
    Column,
    Figure,
    Page,
    Paragraph,
    Section,
    ShownAs,
    Table,
    Verbatim,
    write_page,
)
from documents.text import JsonResult
from runner.reports.display.figure import draw_panel

MARKS = {
    "passed": Badge("Passed", "good"),
    "failed": Badge("Failed", "bad"),
    "no_limit": Badge("No limit"),
    "open": Badge("Not judged"),
}
_VERDICTS = (
    Column("Check", "check"),
    Column("Verdict", "verdict"),
    Column("Found", "found", "number"),
    Column("Limit", "limit", "number"),
    Column("Unit", "unit"),
)


@dataclass(frozen=True, slots=True)
class DisplayReport(JsonResult):
    """A display judged, and the ``page`` on it."""

    verdicts: Verdicts
    page: Path
    json_keys: ClassVar = {"verdicts": "*", "page": "report"}

    def told(self) -> Iterator[str | Block]:
        """Yield the verdicts, what is to be said of those that did not pass, the outcome, and where the page is."""
        yield _verdicts([one for one in self.verdicts.diagnoses if one.value is not None])
        for one in self.verdicts.diagnoses:
            if one.verdict != "passed":
                limit = f" The limit: {one.source}." if one.verdict == "failed" and one.source else ""
                yield f"{_name(one)}{', not judged' if one.verdict == 'open' else ''}: {one.words}{limit}"
        yield self.verdicts.sentence
        yield from (f"Note: {note}" for note in self.verdicts.notes)
        yield f"The report: {self.page}"


def report_display(
    measurements: Annotated[Sequence[Path], Typed(metavar="MEASUREMENTS...")],
    options: JudgeOptions,
    output: Annotated[Path | None, Typed("-o --output")] = None,
) -> DisplayReport:
    """Judge a display by its measurements, and write an HTML page.

    MEASUREMENTS are files of readings. Each check passes, fails, or says what would have to be read for it. Checks
    that fail do not make the command fail.

    Parameters
    ----------
    measurements
        Files of readings.
    options
        What they are judged with.
    output
        HTML page to write. Default: the first file's name with .html.

    Raises
    ------
    InputError
        As of `devices.diagnostics.judge_display`.
    WorkError
        If the page cannot be written.
    """
    verdicts = judge_display(measurements, **{one.name: getattr(options, one.name) for one in fields(options)})
    page = output or measurements[0].with_suffix(".html")
    with writing(page, "report", WorkError):
        write_page(page_of(verdicts), page)
    return DisplayReport(verdicts, page)


def page_of(verdicts: Verdicts) -> Page:
    """Return what the page says."""
    return Page(
        kind="Display report",
        title=verdicts.title,
        of="display report",
        sentences=(verdicts.sentence,),
        notes=verdicts.notes,
        sections=(
            Section("verdicts", "Verdicts", (_verdicts(verdicts.diagnoses),)),
            *(_section(number, one) for number, one in enumerate(verdicts.diagnoses, start=1)),
        ),
    )


def _verdicts(diagnoses: Sequence[Diagnosis]) -> Table:
    return Table("verdicts", "", _VERDICTS, tuple(map(_row, diagnoses)))


def _name(one: Diagnosis) -> str:
    return f"{one.title}, {one.subject}" if one.subject else one.title


def _row(one: Diagnosis) -> tuple[Cell, ...]:
    if one.value is None:
        return _name(one), MARKS[one.verdict], "", "", ""
    return _name(one), MARKS[one.verdict], _shown(one.value), limit_words(one), one.unit


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
    return typeset(value) if isinstance(value, str) else ShownAs(value, short(value))


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
