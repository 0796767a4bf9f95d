"""The report on results: read them, compute the results, write the page with pictures, and print it to PDF."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

from analysis.errors import ResultsError
from analysis.observers import check_tests
from analysis.records import Header, pool, read_results
from analysis.report import Report, report_blocks, write_report
from documents import Finding, InputError, WorkError
from documents.files import read_regular_text, whole_file, writing
from documents.fonts import undrawable
from documents.options import Typed
from documents.pages import Block
from documents.text import JsonResult
from runner.errors import SessionError
from runner.reports.files import experiment_files, given_facts
from runner.reports.options import ReportOptions
from runner.reports.thumbnails import find_shown, thumbnails

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "microsoft-edge", "chrome")
OUTSIDE_PATH = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "C:/Program Files/Google/Chrome/Application/chrome.exe",
    "C:/Program Files (x86)/Microsoft/Edge/Application/msedge.exe",
)
QUIET = ("--headless", "--disable-gpu", "--no-first-run", "--disable-background-networking", "--disable-sync")
LONGEST_S = 120
_MOST_SVG_BYTES = 100_000_000


@dataclass(frozen=True, slots=True, eq=False)
class WrittenReport(JsonResult):
    """A ``report`` and where it was written: the ``page``, and its ``pdf`` where it was asked for.

    ``without_pictures`` says why the page has no pictures of the stimuli, where they were asked for. ``empty_boxes``
    are letters that no font here has: in the figures' PDF files, which bring their fonts, they are empty boxes. Tables
    and figures lie in ``csv_folder`` and ``figure_folder``, if they were asked for.
    """

    report: Report
    page: Path
    pdf: Path | None
    without_pictures: str = ""
    empty_boxes: str = ""
    csv_folder: Path | None = None
    figure_folder: Path | None = None
    json_keys: ClassVar = {
        "report": "*",
        "page": "report",
        "pdf": None,
        "without_pictures": None,
        "csv_folder": None,
        "figure_folder": None,
    }
    json_optional: ClassVar = ("empty_boxes",)

    def told(self) -> Iterator[Block | str]:
        """Yield the results, where the report, its tables and its figures were written, and what they lack."""
        yield from report_blocks(self.report)
        if self.without_pictures:
            yield self.without_pictures
        yield f"The report: {self.page}"
        files = (("As PDF", self.pdf), ("Its tables", self.csv_folder), ("Its figures", self.figure_folder))
        yield from (f"{what}: {file}" for what, file in files if file is not None)
        if self.empty_boxes:
            yield (
                f"In the PDF files of the figures these letters are empty boxes: {self.empty_boxes}. "
                "Install a font that has them, or take the SVG files."
            )


def report_results(
    results: Annotated[Sequence[Path], Typed(metavar="RESULTS...")],
    output: Annotated[Path | None, Typed("-o --output")] = None,
    options: ReportOptions | None = None,
    progress: Callable[[str, int, int], None] = lambda what, done, of: None,
) -> WrittenReport:
    """Write an HTML report on the results of one experiment.

    RESULTS are folders of sessions, from one station or many, or single session.jsonl files. No person is left
    out by default; the page lists observers who are left out by an option. Simulated observers are not counted beside
    people.

    Parameters
    ----------
    results
        Folders of sessions, from one station or many, or single session logs.
    output
        HTML page to write. Default: report.html in the first folder.
    options
        Which observers to leave out, how to test, what to write beside the page.
    progress
        Called with what is being done, how much is done, and how much there is.

    Returns
    -------
    The results, and the files that were written.

    Raises
    ------
    InputError
        If results are missing, damaged or of different experiments, an option names something unknown, or figures
        are in their folder already.
    SessionError
        If the page cannot be printed to PDF.
    WorkError
        If the page or a table cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from runner.session import simulate
    >>> experiment, observers = "experiments/dynamic_range.yaml", "configs/observers/table_4_4.yaml"
    >>> with TemporaryDirectory() as folder:
    ...     simulated = simulate(experiment, observers, 2, results=folder)
    ...     written = report_results([Path(folder)], options=ReportOptions(pictures=False))
    >>> written.report.sentences[0].split(";")[0], written.page.name
    ('2 simulated observers, 90 comparisons of 10 stimuli', 'report.html')
    """
    options = options or ReportOptions()
    if options.replace and options.figure_folder is None:
        raise InputError("replace goes with figures: name their folder")
    if options.rule.unscreened == "leave_out" and options.rule.screening is None:
        raise InputError("screened goes with passed: name the test of vision")
    sessions = read_results(*results)
    first = results[0]
    page = output or (first if first.is_dir() else first.parent) / "report.html"
    check_tests(sessions, options.rule.screening or ())
    header = pool(sessions, with_simulated=options.rule.with_simulated).sessions[0].header
    folder = page.parent if output is None else first
    pictures = stimulus_pictures(header, options.experiment, progress, folder) if options.pictures else {}
    versions = {str(digest) for session in sessions if (digest := session.header.hashes.get("experiment"))}
    with writing(page if output else first, "report", WorkError):
        report = write_report(
            sessions,
            page,
            given=given_facts(header, options.experiment, folder, versions),
            alpha=options.alpha,
            adjust=options.adjust,
            covariance=options.covariance,
            rule=options.rule,
            part=options.part,
            thumbnails=pictures,
            csv_folder=options.csv_folder,
            figure_folder=options.figure_folder,
            replace=options.replace,
        )
        pdf = page.with_suffix(".pdf") if options.pdf else None
        if pdf is not None:
            print_pdf(page, pdf)
    without = _WITHOUT if options.pictures and not pictures else ""
    boxes = _empty_boxes(options.figure_folder)
    return WrittenReport(report, page, pdf, without, boxes, options.csv_folder, options.figure_folder)


def _empty_boxes(figures: Path | None) -> str:
    """Return the letters in the figures' SVG files, whose text is text, that no font here has."""
    if figures is None:
        return ""
    files = sorted(figures.glob("*.svg"))
    return undrawable("".join(re.sub("<[^>]*>", "", read_regular_text(file, _MOST_SVG_BYTES)) for file in files))


_WITHOUT = (
    "The page has no pictures of the stimuli: no experiment file was found whose stimuli and display are those of the "
    "sessions, or the stimuli are not built. Name the file with --experiment, and build them with cyclopean preview."
)


def stimulus_pictures(
    header: Header, experiment: Path | None, progress: Callable[[str, int, int], None], results: Path
) -> dict[str, dict[str, bytes]]:
    """Return small pictures of the stimuli of a session; none if they are not in the cache.

    Without ``experiment``, its file is looked for in ``experiments``, in the folder of a study that holds ``results``,
    and in a study's folder of the experiment's name.

    Raises
    ------
    ResultsError
        If ``experiment`` is named, but its stimuli or its display are not those of the session.
    """
    for file in [experiment] if experiment else experiment_files(header, results):
        shown = find_shown(header, file) if file.is_file() else None
        if shown is not None:
            return thumbnails(*shown, lambda done, of: progress("Making small pictures", done, of))
    if experiment is not None:
        what = "these are not the stimuli and the display of the results, or the stimuli are not built"
        remedy = "name the experiment file of these sessions, or leave --experiment out"
        raise ResultsError(Finding(what, str(experiment), remedy=remedy))
    return {}


def find_browser() -> str | None:
    """Return a browser of the Chromium family; None if there is none."""
    for name in BROWSERS:
        path = shutil.which(name)
        if path:
            return path
    return next((place for place in OUTSIDE_PATH if Path(place).is_file()), None)


def print_pdf(page: Path, pdf: Path) -> None:
    """Print ``page`` to ``pdf``, which is written whole or not at all.

    Raises
    ------
    SessionError
        If there is no such browser, or it prints nothing.
    """
    browser = find_browser()
    if browser is None:
        remedy = "install Chromium or Chrome, or open the page in any browser and print it to a file"
        raise SessionError(Finding("there is no browser that could print the page", str(page), remedy=remedy))
    with tempfile.TemporaryDirectory(prefix="cyclopean-print-") as folder:
        printed = Path(folder) / "page.pdf"
        command = [browser, *QUIET, "--no-pdf-header-footer", f"--user-data-dir={folder}/profile"]
        if hasattr(os, "geteuid") and os.geteuid() == 0:
            command.append("--no-sandbox")  # the browser refuses to run as the administrator otherwise
        command += [f"--print-to-pdf={printed}", page.resolve().as_uri()]
        try:
            subprocess.run(command, capture_output=True, timeout=LONGEST_S, check=True)
        except (OSError, subprocess.SubprocessError) as error:
            raise _failed(browser, page) from error
        if not printed.is_file():
            raise _failed(browser, page)
        with whole_file(pdf, make_folder=False, private=True) as draft:
            shutil.copyfile(printed, draft)


def _failed(browser: str, page: Path) -> SessionError:
    what = f"{Path(browser).name} did not print the page"
    return SessionError(Finding(what, str(page), remedy="open the page in any browser and print it to a file"))
