"""The report on a comparison: the two pictures compared, the page on them, and an experiment that asks observers.

The page is one HTML file that needs nothing but itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from documents import Finding, InputError
from documents.files import unwritable, writing
from documents.pages import write_page
from documents.text import JsonResult
from runner.reports.comparison.experiment import checked_name, write_experiment
from runner.reports.comparison.page import comparison_page
from stimuli.comparison import CompareOptions, Comparison, compare_pictures


@dataclass(frozen=True, slots=True, eq=False)
class ComparisonReport(JsonResult):
    """A ``comparison``, the ``page`` on it, and the files of an ``experiment`` if one was written."""

    comparison: Comparison
    page: Path | None
    experiment: tuple[Path, ...]
    json_keys: ClassVar = {"comparison": "*"}
    json_names: ClassVar = "comparison written"

    @property
    def validated(self) -> bool:
        """Whether the rendering is validated."""
        return self.comparison.verdict.decision == "validated"

    @property
    def written(self) -> dict[str, Any]:
        """The places of the files."""
        found = {"experiment": [str(file) for file in self.experiment], "page": self.page and str(self.page)}
        return {name: files for name, files in found.items() if files}

    def lines(self) -> list[str]:
        """Return the lines that a terminal shows."""
        lines = self.comparison.lines()
        if self.experiment:
            lines.append(f"Experiment: {', '.join(map(str, self.experiment))}")
        if self.page is not None:
            lines.append(f"Page: {self.page}")
        return lines


def report_comparison(
    photo: Path,
    rendering: Path,
    regions: Path,
    options: CompareOptions | None = None,
    *,
    page: Path | None = None,
    experiment: str | None = None,
    rig: Path | None = None,
    root: Path = Path(),
    progress: Callable[[str, int, int], None] | None = None,
    settings: Mapping[str, Any] | None = None,
) -> ComparisonReport:
    """Compare a photograph with its rendering, and write a page and an experiment where they are asked for.

    Parameters
    ----------
    photo, rendering, regions, options, progress, settings
        As `compare_pictures` takes them.
    page
        The HTML page to write, whole or not at all; its folder is made if need be.
    experiment
        The name of an experiment that shows both pictures to observers on the ``rig``.
    rig
        The rig of the experiment.
    root
        The folder below which the experiment, its recipe and its pictures are written.

    Returns
    -------
    ComparisonReport
        The comparison, and the places of the files.

    Raises
    ------
    InputError
        If the pictures cannot be compared, or the page or the experiment would take the place of something else:
        nothing is then written; or if one of them cannot be written.
    OSError
        If there is no room for temporary files, or a file cannot be read.
    ValueError
        If there is an ``experiment`` and no ``rig``.
    """
    if experiment is not None and rig is None:
        raise ValueError("an experiment needs a rig")
    if page is not None:
        check_page(page, (photo, rendering, regions))
    if experiment is not None:
        checked_name(experiment, root)
    comparison = compare_pictures(photo, rendering, regions, options, progress=progress, settings=settings)
    files: tuple[Path, ...] = ()
    if experiment is not None and rig is not None:
        with writing(root, "experiment"):
            files = write_experiment(comparison, experiment, rig, root)
    if page is not None:
        with writing(page, "page"):
            write_page(comparison_page(comparison), page)
    return ComparisonReport(comparison, page, files)


def check_page(page: Path, inputs: Sequence[Path]) -> None:
    """Refuse a page that would take the place of something else, or cannot be written there. Raises InputError."""
    if page.suffix.lower() not in (".html", ".htm"):
        raise InputError(Finding("the page is no .html file", str(page), remedy="name one"))
    try:
        is_folder = page.is_dir()
        above = next(folder for folder in page.absolute().parents if folder.exists())
    except OSError as error:
        raise InputError(unwritable(error, page, "page")) from error
    if is_folder:
        raise InputError(Finding("the page would take a folder's place", str(page), remedy="name a file"))
    if not above.is_dir():
        raise InputError(Finding(f"{above} is no folder", str(page), remedy="name another place"))
    if page.exists() and any(file.exists() and page.samefile(file) for file in inputs):
        raise InputError(Finding("an input would be written over", str(page), remedy="name another output"))
