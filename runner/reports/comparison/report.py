"""The report on a comparison: the two pictures compared, the page on them, and an experiment that asks observers.

The page is one HTML file that needs nothing but itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import gettempdir
from typing import Annotated, Any, ClassVar

from documents import Finding, InputError, WorkError
from documents.files import unwritable, writing
from documents.options import Typed, option_names
from documents.pages import Block, write_page
from documents.text import JsonResult
from runner.presenter import primary_monitor
from runner.reports.comparison.experiment import checked_name, write_experiment
from runner.reports.comparison.options import ComparisonOptions
from runner.reports.comparison.page import comparison_page, told
from stimuli.comparison import Comparison, compare_pictures
from stimuli.measures import ViewingConditions

# What the record calls otherwise.
_RECORDED = {
    "picture_white_cd_m2": "picture_white",
    "full_scale_cd_m2": "full_scale",
    "illuminant_luminance_cd_m2": "illuminant_luminance",
    "white_luminance_cd_m2": "white_luminance",
    "register": "registering",
    "photo_corners_px": "photo_corners",
    "rendering_corners_px": "rendering_corners",
    "delta_e_limit": "limit",
    "page": "output",
    "experiment": "experiment_name",
}


@dataclass(frozen=True, slots=True, eq=False)
class ComparisonReport(JsonResult):
    """A ``comparison``, the ``page`` on it, and the files of an ``experiment`` if one was written."""

    comparison: Comparison
    page: Path | None
    experiment: tuple[Path, ...]
    json_keys: ClassVar = {"comparison": "*"}
    json_names: ClassVar = "comparison written"

    @property
    def exit_status(self) -> int:
        """0 if the rendering is validated, else 1."""
        return int(self.comparison.verdict.decision != "validated")

    @property
    def written(self) -> dict[str, Any]:
        """The places of the files."""
        found = {"experiment": [str(file) for file in self.experiment], "page": self.page and str(self.page)}
        return {name: files for name, files in found.items() if files}

    def told(self) -> Iterator[Block | str]:
        """Yield what the terminal shows of it, and where it was written."""
        yield from told(self.comparison)
        if self.experiment:
            yield f"Experiment: {', '.join(map(str, self.experiment))}"
        if self.page is not None:
            yield f"Page: {self.page}"


def report_comparison(
    photo: Path | str,
    rendering: Path | str,
    regions: Annotated[Path | str, Typed("--regions", "R.yaml")],
    options: ComparisonOptions | None = None,
    *,
    root: Path = Path(),
    progress: Callable[[str, int, int], None] | None = None,
    asked: Mapping[str, Any] | None = None,
) -> ComparisonReport:
    """Compare a rendering with a photograph, and report whether it is validated.

    PHOTO and RENDERING are OpenEXR or TIFF of XYZ or of camera RGB, raw photographs, spectral pictures, or, with
    --colour-space and --picture-white, pictures such as PNG and JPEG. They are brought to one grid, and compared by
    regions, pixel by pixel, as the eye resolves them at the viewing distance, and by their sparkles.

    Exit status: 0 validated, 1 not validated or undecided, 2 the input was wrong, and nothing was written.

    Parameters
    ----------
    photo, rendering, progress
        As `compare_pictures` takes them.
    regions
        File of the regions to compare (chart, plates, areas) and the limits.
    options
        How they are compared, where they are seen, and what is written: a page, whole or not at all, whose folder is
        made if need be; an experiment that shows both pictures to observers.
    root
        The folder below which the experiment, its recipe and its pictures are written.
    asked
        What was given for the options, by their names: kept in the comparison's record.

    Returns
    -------
    ComparisonReport
        The comparison, and the places of the files.

    Raises
    ------
    InputError
        If options do not go together, the pictures cannot be compared, or the page or the experiment would take the
        place of something else: nothing is then written; or if one of them cannot be written.
    WorkError
        If there is no room for temporary files, or a file cannot be read.
    """
    options = options or ComparisonOptions()
    photo, rendering, regions = map(Path, (photo, rendering, regions))
    if refused := options.refused:
        raise InputError(Finding(refused))
    if options.page is not None:
        check_page(options.page, (photo, rendering, regions))
    if options.experiment is not None:
        checked_name(options.experiment, root)
    compare = replace(options.compare, viewing=_viewing(options))
    given = {name: _plain((asked or {}).get(name)) for name in option_names(ComparisonOptions)}
    settings = {_RECORDED.get(name, name): one for name, one in given.items() if one not in (None, False, ())}
    temporary, elsewhere = Path(gettempdir()), "name another folder in the environment variable TMPDIR"
    with writing(temporary, "temporary files", WorkError, elsewhere=elsewhere):
        comparison = compare_pictures(
            photo, rendering, regions, compare, progress=progress, settings={"regions": str(regions)} | settings
        )
    files: tuple[Path, ...] = ()
    if options.experiment is not None and options.rig is not None:
        with writing(root, "experiment"):
            files = write_experiment(comparison, options.experiment, options.rig, root)
    if options.page is not None:
        with writing(options.page, "page"):
            write_page(comparison_page(comparison), options.page)
    return ComparisonReport(comparison, options.page, files)


def _viewing(options: ComparisonOptions) -> ViewingConditions | None:
    """Return where the pictures are seen; None where that is not known. Raises InputError."""
    if options.rig is not None:
        return ViewingConditions.on_rig(options.rig, options.distance_mm, primary_monitor)
    if options.display is not None and options.distance_mm is not None:
        return ViewingConditions.on_display(options.display, options.distance_mm)
    return options.compare.viewing


def _plain(value: Any) -> Any:
    """Return an option's value as it is typed."""
    if isinstance(value, tuple | list):
        return tuple(",".join(f"{one:.15g}" for one in part) if isinstance(part, tuple) else part for part in value)
    return str(value) if isinstance(value, Path) else value


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
