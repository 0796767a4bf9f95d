"""The report: one HTML page that needs nothing but itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from analysis.multiplicity import Adjust
from analysis.records import SessionLog
from analysis.report.clipping import clipping_rows
from analysis.report.figure import scores_svg
from analysis.report.matrix import matrix_rows
from analysis.report.palette import class_colours
from analysis.report.summary import Summary, summarise
from analysis.terminal import Published

WIDE_IN, NARROW_IN = 7.6, 4.2
ADJUSTMENT_NAMES: Mapping[str, str] = {
    "none": "no correction for the number of pairs",
    "holm": "Holm's correction",
    "bh": "Benjamini and Hochberg's correction",
    "maxz": "the single-step maximum of z",
}
UNITS: Mapping[str, str] = {"_cd_m2": "cd/m²", "_mm": "mm", "_px": "pixels", "_hz": "Hz", "_s": "s"}


def write_report(
    sessions: Sequence[SessionLog],
    output: Path,
    *,
    alpha: float | None = None,
    adjust: Adjust | None = None,
    published: Published | None = None,
) -> Summary:
    """Write a self-contained HTML page on one experiment's sessions, and return what it is drawn from.

    Parameters
    ----------
    sessions
        Sessions of one experiment.
    output
        The page; written whole or not at all. Its folder is made if need be.
    alpha, adjust
        Level and correction of the classes; those of the first session's header where None.
    published
        For each stimulus, where there is one, a score and class published before, to stand beside.

    Raises
    ------
    ResultsError
        As `summarise`.
    OSError
        If the page cannot be written.
    """
    summary = summarise(sessions, alpha, adjust)
    page = render(summary, published or {})
    output.parent.mkdir(parents=True, exist_ok=True)
    draft = output.with_name(output.name + ".part")
    draft.write_text(page, encoding="utf-8")
    draft.replace(output)
    return summary


def render(summary: Summary, published: Published) -> str:
    """Return the page's HTML; text from people is escaped."""
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=PackageLoader("analysis.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["fixed"] = _fixed
    environment.filters["key"] = key_words
    environment.filters["plain"] = plain
    environment.filters["colours"] = class_colours
    values: dict[str, Any] = {
        "summary": summary,
        "header": summary.header,
        "items": list(zip(summary.scores.items, summary.log10_interval.tolist(), strict=True)),
        "fit": summary.scores.fit,
        "published": published,
        "adjustment": ADJUSTMENT_NAMES[summary.adjust],
        "clipping": clipping_rows(summary.header, [item.name for item in summary.scores.items]),
        "matrix": matrix_rows(summary.scores),
        # matplotlib escapes the text that it writes.
        "wide_figure": Markup(scores_svg(summary, WIDE_IN)),
        "narrow_figure": Markup(scores_svg(summary, NARROW_IN)),
        "first_position": _first_position(summary),
    }
    return environment.get_template("report.html.j2").render(values)


def _fixed(value: float | None, digits: int = 4) -> str:
    """Return a number with fixed digits and a real minus sign; a dash for none."""
    if value is None or value != value:
        return "–"
    return f"{value:.{digits}f}".replace("-", "−")


def key_words(key: object) -> str:
    """Return a key of a header as words, its unit in brackets."""
    words = str(key)
    for suffix, unit in UNITS.items():
        if words.endswith(suffix):
            words = f"{words.removesuffix(suffix)} ({unit})"
    return words.replace("_", " ")


def plain(value: object) -> str:
    """Return a value of a header as words: mappings as "key: value", lists with commas, none as a dash."""
    if value is None or value == "" or value == () or value == []:
        return "–"
    if isinstance(value, Mapping):
        return "; ".join(f"{key_words(key)}: {plain(inner)}" for key, inner in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(plain(inner) for inner in value)
    if isinstance(value, bool):
        return "yes" if value else "no"
    return str(value)


def _first_position(summary: Summary) -> str:
    for session in summary.sessions:
        for trial in session.trials:
            if "first_position" in trial.data:
                return str(trial.data["first_position"])
    return "first"
