"""Results as a BIDS dataset, with the facts that the files of their experiments give."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Annotated

from analysis.records import Header
from documents import WorkError
from documents.files import writing
from documents.options import Typed
from extensions.bids.export import Export, export_dataset
from extensions.bids.options import About
from runner.reports import given_facts


def export_results(
    results: Annotated[Sequence[Path], Typed(metavar="RESULTS...")],
    folder: Annotated[Path, Typed("-o --output")],
    options: About | None = None,
    progress: Callable[[str, int, int], None] = lambda what, done, of: None,
) -> Export:
    """Write results as a BIDS dataset.

    RESULTS are folders of sessions, from one station or many, or single session.jsonl files.

    Parameters
    ----------
    results, options, progress
        As `export_dataset` takes them, but for the facts: these are what the experiments' files give.
    folder
        Folder of the dataset.

    Raises
    ------
    InputError
        If there is no session, logs are damaged or contradict each other, or ``folder`` has other files.
    WorkError
        If the dataset cannot be written.
    """

    def facts(header: Header, versions: Collection[str], log: Path) -> Mapping[str, str]:
        return given_facts(header, None, log.parents[3], versions)  # RESULTS/EXPERIMENT/OBSERVER/SESSION

    with writing(folder, "dataset", WorkError):
        return export_dataset(results, folder, options, progress, facts=facts)
