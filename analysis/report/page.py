"""The report: a self-contained HTML page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from analysis.choices import Adjust, CovarianceChoice
from analysis.classes.multiplicity import ADJUSTMENT_NAMES
from analysis.observers.filters import Filter
from analysis.records.session_record import SessionLog
from analysis.report.conclusions import conclusions_section
from analysis.report.described import describe
from analysis.report.groups import group_sections
from analysis.report.methods import methods_section
from analysis.report.observers import observers_section, people_section
from analysis.report.report import Report
from analysis.report.reviewers import reviewers_section, warning_of
from analysis.report.scores import belief_section, classes_section, counts_section, scores_section
from analysis.report.seen import caption, seen_section
from analysis.report.shown import (
    Thumbnails,
    beside,
    clipping_section,
    gallery_section,
    readable,
    timing_section,
    unreported_section,
)
from analysis.scaling.shown import Published
from documents.files import write_whole
from documents.pages import Page, Section, Table, page_html, write_csv_files, write_figure_files


def write_report(
    sessions: Sequence[SessionLog],
    output: Path,
    *,
    alpha: float | None = None,
    adjust: Adjust | None = None,
    covariance: CovarianceChoice | None = None,
    rule: Filter | None = None,
    given: Mapping[str, str] | None = None,
    part: str | None = None,
    published: Published | None = None,
    thumbnails: Thumbnails | None = None,
    csv_folder: Path | None = None,
    figure_folder: Path | None = None,
    replace: bool = False,
) -> Report:
    """Write a self-contained HTML page on the sessions of an experiment.

    Parameters
    ----------
    sessions, alpha, adjust, covariance, rule, given, part
        As `analysis.report.describe`.
    output
        The page. Its folder is made if it does not exist.
    published
        Published score and class by stimulus, to show beside the computed ones.
    thumbnails
        By stimulus, a small PNG for each eye: ``left`` and ``right``, or ``both``. Those that cannot be decoded are
        left out.
    csv_folder
        Folder for each table as CSV; None writes none.
    figure_folder
        Folder for each figure as SVG and as PDF; None writes none.
    replace
        Whether figures that are in the folder already may be replaced.

    Returns
    -------
    Report
        The results on the page.

    Raises
    ------
    ResultsError
        As `analysis.report.describe`.
    InputError
        If a figure is in the folder already.
    OSError
        If the page or a table cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from runner.session import simulate
    >>> from analysis.records import read_results
    >>> experiment, observers = "experiments/dynamic_range.yaml", "configs/observers/table_4_4.yaml"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     simulated = simulate(experiment, observers, 1, results=folder)
    ...     report = write_report(read_results(folder), Path(folder, "report.html"))
    >>> report.kinds
    ('Paired comparisons',)
    """
    report = describe(sessions, alpha, adjust, covariance, rule, given, part)
    page = page_of(report, published, thumbnails)
    html, sections = page_html(page), page.sections
    if figure_folder is not None:
        write_figure_files(
            [figure for section in sections for figure in section.figures()], figure_folder, replace=replace
        )
    write_whole(output, html, private=True)
    if csv_folder is not None:
        write_csv_files(tables_of(sections), csv_folder)
    return report


def render(report: Report, published: Published | None = None, thumbnails: Thumbnails | None = None) -> str:
    """Return the page's HTML; text from people is escaped."""
    return page_html(page_of(report, published, thumbnails))


def page_of(report: Report, published: Published | None = None, thumbnails: Thumbnails | None = None) -> Page:
    """Return what the page says."""
    return Page(
        kind=" · ".join(report.kinds),
        title=report.header.experiment,
        of="report",
        question=report.header.question,
        sentences=tuple(filter(None, (report.headline, *report.sentences))),
        notes=report.notes,
        failed=tuple((check.check, check.reason, check.remedy) for check in report.failed),
        sections=sections_of(report, published or {}, thumbnails or {}),
    )


def sections_of(report: Report, published: Published, thumbnails: Thumbnails) -> tuple[Section, ...]:
    """Return the sections that have records."""
    thumbnails = readable(thumbnails)
    pictures = beside(thumbnails)
    if report.part:
        concluded = conclusions_section(report.conclusions, ())
        shown = (*(one.sections(pictures) for one in report.parts), *(one.observers() for one in report.parts))
        return (*filter(None, (concluded,)), *(section for sections in shown for section in sections))
    pairs, grouped = report.pairs, report.groups
    compared = pairs or grouped
    in_groups = {name: [item.name for item in part.scores.items] for name, part in (grouped.groups if grouped else ())}
    names = (
        [item.name for item in pairs.scores.items] if pairs else [name for own in in_groups.values() for name in own]
    )
    rest = [name for name in report.header.stimulus_names if name not in set(names)]
    names += rest
    adjustment = ADJUSTMENT_NAMES[compared.adjust] if compared else ""
    agreement = report.observers.concordance if report.observers else None
    sections: list[Section | None] = [conclusions_section(report.conclusions, report.cautions)]
    if pairs is not None:
        sections += [
            scores_section(pairs, published, pictures),
            classes_section(pairs, adjustment, warning_of(report.review)),
            counts_section(pairs),
            belief_section(pairs, agreement),
            reviewers_section([("", pairs, report.review)]),
        ]
    if grouped is not None:
        sections += group_sections(grouped, published, adjustment, agreement, pictures)
        scales = [(name, part, report.group_reviews.get(name, {})) for name, part in grouped.scales]
        sections.append(reviewers_section(scales))
    for part in report.all_parts:
        sections += part.sections(pictures)
    if report.observers is not None:
        sections.append(observers_section(report.observers, report.kept))
    for part in report.all_parts:
        sections += part.observers()
    sections += [
        gallery_section(
            {**in_groups, "Others": rest} if in_groups else {"": names}, thumbnails, caption(report.sessions)
        ),
        seen_section(report.sessions),
        clipping_section(report.header, names),
        timing_section(report.sessions),
        people_section(report.sessions),
        unreported_section(report.sessions),
        methods_section(report.methods, report.header),
    ]
    return tuple(section for section in sections if section is not None)


def tables_of(sections: tuple[Section, ...]) -> tuple[Table, ...]:
    """Return every table of the page."""
    return tuple(table for section in sections for table in section.tables())
