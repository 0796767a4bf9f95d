"""Results as datasets of other forms, from a notebook."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from documents.options import made, taking
from runner.reports import About, export_results


@taking(About, "facts")
def export(*places: str | Path, folder: str | Path, to: str = "bids", **options: Any) -> Path:
    """Write results as a BIDS dataset, or in another form, as `cyclopean export` does and with the same options.

    Parameters
    ----------
    places
        Folders of sessions, from one station or many, or single session logs.
    folder
        Folder of the dataset; an earlier export there is replaced.
    to
        Form of the dataset: bids, or one that another package adds.
    **options
        Those of `runner.reports.About` by their names, such as ``name="Gloss"`` or ``with_simulated=True``.

    Returns
    -------
    pathlib.Path
        The folder of the dataset.

    Raises
    ------
    InputError
        If nobody offers that form, there is no session, logs are damaged or contradict each other, or ``folder`` has
        other files.
    """
    return export_results([Path(place) for place in places], Path(folder), to, made(About, options)).folder


# As it was called while BIDS was the one form.
export_bids = export
