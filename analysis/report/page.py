"""The report: one HTML page that needs nothing but itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from analysis.classes.multiplicity import Adjust
from analysis.observers.filters import Filter
from analysis.records.session_record import SessionLog
from analysis.report.blocks import Section
from analysis.report.contents import ADJUSTMENT_NAMES, sections_of, tables_of
from analysis.report.csv_files import write_csv_files
from analysis.report.estimate import CovarianceWish
from analysis.report.palette import class_colours
from analysis.report.report import Report, describe
from analysis.report.sections.shown import Thumbnails
from analysis.report.words import chance, fixed
from analysis.scaling.terminal import Published
from documents.files.whole_file import write_whole
from documents.pages.environment import page_environment

__all__ = ["ADJUSTMENT_NAMES", "render", "write_report"]


def write_report(
    sessions: Sequence[SessionLog],
    output: Path,
    *,
    alpha: float | None = None,
    adjust: Adjust | None = None,
    covariance: CovarianceWish | None = None,
    rule: Filter | None = None,
    published: Published | None = None,
    thumbnails: Thumbnails | None = None,
    csv_folder: Path | None = None,
) -> Report:
    """Write a self-contained HTML page on one experiment's sessions, and return what it is drawn from.

    Parameters
    ----------
    sessions
        Sessions of one experiment.
    output
        The page; written whole or not at all. Its folder is made if need be.
    alpha, adjust, covariance
        Level, correction and standard errors of the classes; those of the first session's header where None.
    rule
        Whom to leave out; nobody if None. The page says it.
    published
        For each stimulus, where there is one, a score and class published before, to stand beside.
    thumbnails
        For each stimulus, where there is one, a small PNG by eye: ``left`` and ``right``, or ``both``.
    csv_folder
        Where to write each table as CSV; nowhere if None.

    Raises
    ------
    ResultsError
        As `analysis.report.report.describe`.
    OSError
        If the page or a table cannot be written.
    """
    report = describe(sessions, alpha, adjust, covariance, rule)
    sections = sections_of(report, published or {}, thumbnails or {})
    page = _page(report, sections)
    write_whole(output, page)
    if csv_folder is not None:
        write_csv_files(tables_of(sections), csv_folder)
    return report


def render(report: Report, published: Published | None = None, thumbnails: Thumbnails | None = None) -> str:
    """Return the page's HTML; text from people is escaped."""
    return _page(report, sections_of(report, published or {}, thumbnails or {}))


def _page(report: Report, sections: tuple[Section, ...]) -> str:
    from markupsafe import Markup

    environment = page_environment("analysis.report")
    filters: Mapping[str, Callable[..., object]] = {
        "fixed": fixed,
        "chance": chance,
        "colours": class_colours,
        # matplotlib escapes the text that it writes.
        "drawn": Markup,
    }
    environment.filters.update(filters)
    return environment.get_template("report.html.j2").render(report=report, header=report.header, sections=sections)
