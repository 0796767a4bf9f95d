"""Measures and observers as a page, in the terminal, and as CSV."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from analysis.agreement import words
from analysis.agreement.result import Agreement
from analysis.agreement.sections import correlations_table, sections_of, tables_of
from analysis.records.session_record import Header
from documents.pages import Block, Heading, Mark, Page, Paragraph, print_blocks, write_csv_files, write_page

if TYPE_CHECKING:
    from rich.console import Console

Facts = tuple[tuple[str, str], ...]


def write_agreement_page(agreement: Agreement, header: Header, output: Path, facts: Facts = ()) -> None:
    """Write a self-contained HTML page on measures and observers, whole or not at all.

    Parameters
    ----------
    agreement
        The results, as `agree` returns them.
    header
        Header of a session: the experiment and its question.
    output
        The page. Its folder is made if it does not exist.
    facts
        Pairs of a term and its value: which pictures were measured, and how they were seen.

    Raises
    ------
    OSError
        If the page cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> from analysis.agreement import ObservedGroup, Predicted, agree
    >>> group = ObservedGroup("", "ratings", "points", tuple("abcd"), np.arange(4.0), np.eye(4) < 1, 1, None)
    >>> found = agree([group], ["photo"], [Predicted("blur", "Blur", "px", "lower", (np.arange(4.0),))])
    >>> header = Header("plates", "01", "s1", "2026-01-31T09:30:00Z", 1, "?", False, (), {}, {}, {}, {}, {})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_agreement_page(found, header, Path(folder, "agreement.html"))
    ...     "Do measures" in Path(folder, "agreement.html").read_text(encoding="utf-8")
    True
    """
    page = Page(
        kind="Measures and observers",
        title=header.experiment,
        of="measures and observers",
        question=header.question,
        sentences=(words.asked(agreement),),
        notes=agreement.notes,
        sections=sections_of(agreement, facts),
    )
    write_page(page, output, private=True)


def write_agreement_csv(agreement: Agreement, folder: Path) -> tuple[Path, ...]:
    """Write the tables of the page as CSV and return the files, each whole or not at all.

    Parameters
    ----------
    agreement
        The results, as `agree` returns them.
    folder
        Where to write; it is made if it does not exist.

    Returns
    -------
    tuple of pathlib.Path
        ``agreement.csv``, ``scores.csv``, ``pairs.csv`` and, where photographs were compared, ``limits.csv``.

    Raises
    ------
    OSError
        If a file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> from analysis.agreement import ObservedGroup, Predicted, agree
    >>> group = ObservedGroup("", "ratings", "points", tuple("abcd"), np.arange(4.0), np.eye(4) < 1, 1, None)
    >>> found = agree([group], ["photo"], [Predicted("blur", "Blur", "px", "lower", (np.arange(4.0),))])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     [file.name for file in write_agreement_csv(found, Path(folder))]
    ['agreement.csv', 'scores.csv', 'pairs.csv']
    """
    return write_csv_files(tables_of(agreement), folder)


def print_agreement(agreement: Agreement, console: Console | None = None) -> None:
    """Print a table of the measures by group, and in sentences what was found and how sure it is.

    Parameters
    ----------
    agreement
        The results, as `agree` returns them.
    console
        Where to print; standard output if None.

    Examples
    --------
    >>> from io import StringIO
    >>> import numpy as np
    >>> from rich.console import Console
    >>> from analysis.agreement import ObservedGroup, Predicted, agree
    >>> group = ObservedGroup("", "ratings", "points", tuple("abcd"), np.arange(4.0), np.eye(4) < 1, 1, None)
    >>> out = StringIO()
    >>> print_agreement(
    ...     agree([group], ["photo"], [Predicted("noise", "Noise", "", "lower", (np.arange(4.0)[::-1],))]),
    ...     Console(file=out, width=120),
    ... )
    >>> "Noise agrees with observers" in out.getvalue()
    True
    """
    blocks: list[Block] = [Paragraph(words.asked(agreement)), correlations_table(agreement)]
    for result in agreement.measures:
        one, limit = result.predicted, result.whole.calibration
        said = words.limit_words(limit, one.unit, higher=one.better == "higher") if limit else []
        blocks += [Heading(words.verdict(result, agreement)), Paragraph(words.pairs_words(result.whole.accuracy))]
        blocks += map(Paragraph, said)
    remarks = [f"{one.predicted.title}: {remark}." for one in agreement.measures for remark in one.predicted.remarks]
    notes = [Paragraph(note, mark=Mark("Note", "open")) for note in (*agreement.notes, *remarks)]
    print_blocks([*blocks, *notes], console)
