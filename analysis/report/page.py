"""The report: one HTML page that needs nothing but itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from analysis.classes.multiplicity import Adjust
from analysis.observers.filters import Filter
from analysis.records.session_record import SessionLog
from analysis.report.blocks import Section, Table, write_csv_files
from analysis.report.estimate import CovarianceWish
from analysis.report.figures import class_colours
from analysis.report.report import Report, describe
from analysis.report.sections.factors import factors_section
from analysis.report.sections.methods import methods_section
from analysis.report.sections.observers import observers_section, people_section, vision_section
from analysis.report.sections.ratings import preferences_section, ratings_section
from analysis.report.sections.scores import belief_section, classes_section, counts_section, scores_section
from analysis.report.sections.series import series_sections
from analysis.report.sections.shown import Thumbnails, clipping_section, gallery_section, timing_section
from analysis.report.words import chance, fixed
from analysis.scaling.terminal import Published
from documents.files.whole_file import write_whole
from documents.pages.environment import page_environment


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


ADJUSTMENT_NAMES: Mapping[str, str] = {
    "none": "no correction for the number of pairs",
    "holm": "Holm's correction",
    "bh": "Benjamini and Hochberg's correction",
    "maxz": "the single-step maximum of z",
}


def sections_of(report: Report, published: Published, thumbnails: Thumbnails) -> tuple[Section, ...]:
    """Return the sections for which there are records."""
    pairs = report.pairs
    names = [item.name for item in pairs.scores.items] if pairs else []
    names += [str(one["name"]) for one in report.header.stimuli if str(one["name"]) not in names]
    adjustment = ADJUSTMENT_NAMES[pairs.adjust] if pairs else ""
    found: list[Section | None] = []
    if pairs is not None:
        agreement = report.observers.concordance if report.observers else None
        found += [
            scores_section(pairs, published),
            classes_section(pairs, adjustment),
            counts_section(pairs),
            belief_section(pairs, agreement),
            factors_section(report.factors) if report.factors else None,
        ]
    if report.series is not None:
        found += series_sections(report.series)
    if report.preferences is not None and report.preferences.by_observer:
        found.append(preferences_section(report.sessions, report.preferences))
    if report.ratings is not None:
        found.append(ratings_section(report.ratings))
    if report.observers is not None:
        found.append(observers_section(report.observers, report.kept))
    found += [
        vision_section(report.sessions),
        gallery_section(names, thumbnails),
        clipping_section(report.header, names),
        timing_section(report.sessions),
        people_section(report.sessions),
        methods_section(
            report.sessions,
            report.kept,
            pairs,
            adjustment,
            series=report.series is not None,
            ratings=report.ratings is not None,
            preferences=report.preferences is not None,
            factors=report.factors is not None,
            observers=report.observers is not None,
        ),
    ]
    return tuple(section for section in found if section is not None)


def tables_of(sections: tuple[Section, ...]) -> tuple[Table, ...]:
    """Return every table of the page."""
    return tuple(table for section in sections for table in section.tables())
