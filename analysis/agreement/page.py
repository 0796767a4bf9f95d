"""The page on measures and observers, in the report's form; and its tables as CSV."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from analysis.agreement import words
from analysis.agreement.result import Agreement
from analysis.agreement.sections import sections_of, tables_of
from analysis.records.session_record import Header
from analysis.report.blocks import write_csv_files
from analysis.report.figures import class_colours
from analysis.report.words import chance, fixed
from documents.files import write_whole
from documents.pages import page_environment

Facts = tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class _Head:
    """What the template of the report shows above the sections."""

    kinds: tuple[str, ...]
    sentences: tuple[str, ...]
    notes: tuple[str, ...]
    failed: tuple[str, ...] = ()
    headline: str = ""


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
    write_whole(output, render(agreement, header, facts), private=True)


def render(agreement: Agreement, header: Header, facts: Facts = ()) -> str:
    """Return the page's HTML; text from people is escaped."""
    from markupsafe import Markup

    environment = page_environment("analysis.agreement", "analysis.report")
    filters: Mapping[str, Callable[..., object]] = {
        "fixed": fixed,
        "chance": chance,
        "colours": class_colours,
        # matplotlib escapes text.
        "drawn": Markup,
    }
    environment.filters.update(filters)
    head = _Head(("Measures and observers",), (words.asked(agreement),), agreement.notes)
    sections = sections_of(agreement, facts)
    return environment.get_template("agreement.html.j2").render(report=head, header=header, sections=sections)


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
