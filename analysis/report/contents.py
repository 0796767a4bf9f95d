"""The page's sections, in order."""

from __future__ import annotations

from collections.abc import Mapping

from analysis.report.blocks import Section, Table
from analysis.report.report import Report
from analysis.report.sections.belief import belief_section
from analysis.report.sections.counts import counts_section
from analysis.report.sections.factors import factors_section
from analysis.report.sections.methods import methods_section
from analysis.report.sections.observers import observers_section
from analysis.report.sections.people import people_section
from analysis.report.sections.preferences import preferences_section
from analysis.report.sections.ratings import ratings_section
from analysis.report.sections.scores import classes_section, scores_section
from analysis.report.sections.series import series_sections
from analysis.report.sections.shown import Thumbnails, clipping_section, gallery_section, timing_section
from analysis.report.sections.vision import vision_section
from analysis.scaling.terminal import Published

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
