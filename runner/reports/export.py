"""Results in the form of other programs, such as BIDS: what writes each is found by name (`docs/extend.md`)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, TypeAlias

from documents import WorkError
from documents.extensions import Registry
from documents.files import writing
from documents.options import Typed
from documents.text import JsonResult, counted
from runner.reports.options import About

Progress: TypeAlias = Callable[[str, int, int], None]


@dataclass(frozen=True, slots=True)
class Exported(JsonResult):
    """What was exported: the dataset's ``folder``, and how many sessions and trials are in it."""

    folder: Path
    sessions: int
    trials: int

    def told(self) -> Iterable[str]:
        """Yield what is in the dataset, in words."""
        sessions, trials = counted(self.sessions, "session", "sessions"), counted(self.trials, "trial", "trials")
        yield f"{sessions}, {trials}: {self.folder}"


# Each takes results and folder as `export_results`, what the dataset says of itself, and what hears of the progress.
EXPORTERS: Registry[Callable[[Sequence[Path], Path, About, Progress], Exported]] = Registry(
    "cyclopean.exporters", {}, lambda name, kind: None if callable(kind) else "is no function that exports results"
)


def export_results(
    results: Annotated[Sequence[Path], Typed(metavar="RESULTS...")],
    folder: Annotated[Path, Typed("-o --output")],
    to: Annotated[str, Typed(metavar="FORM")] = "bids",
    options: About | None = None,
    progress: Progress = lambda what, done, of: None,
) -> Exported:
    """Write results as a BIDS dataset, or in another form.

    RESULTS are folders of sessions, from one station or many, or single session.jsonl files.

    Parameters
    ----------
    results
        Folders of sessions, or single session logs.
    folder
        Folder of the dataset.
    to
        Form of the dataset: bids, or one that another package adds.
    options
        What the dataset says of itself, and whose sessions are in it.
    progress
        Called with what is done, how many sessions are done, and how many there are.

    Raises
    ------
    InputError
        If nobody offers that form, there is no session, logs are damaged or contradict each other, or ``folder`` has
        other files.
    WorkError
        If the dataset cannot be written.
    """
    exporter = EXPORTERS.wanted(to, "form of export")
    with EXPORTERS.blamed(to), writing(folder, "dataset", WorkError):
        exported = exporter(results, folder, options or About(), progress)
        if not isinstance(exported, Exported):
            raise TypeError(f"{type(exported).__name__} in place of Exported")
    return exported
