"""Results as a BIDS dataset, with the facts that the files of their experiments give."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from analysis.records import Header
from extensions.bids.export import Export, Progress, export_dataset
from runner.reports import About, given_facts


def export_results(
    results: Sequence[Path],
    folder: Path,
    options: About | None = None,
    progress: Progress = lambda what, done, of: None,
) -> Export:
    """Write results as a BIDS dataset, as `export_dataset` does, with the facts that the experiments' files give."""

    def facts(header: Header, versions: Collection[str], log: Path) -> Mapping[str, str]:
        return given_facts(header, None, log.parents[3], versions)  # RESULTS/EXPERIMENT/OBSERVER/SESSION

    return export_dataset(results, folder, options, progress, facts=facts)
