"""Results as datasets of other forms, from a notebook."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from documents.options import made, taking
from extensions.bids import About, export_results


@taking(About, "facts")
def export_bids(*places: str | Path, folder: str | Path, **options: Any) -> Path:
    """Write results as a BIDS dataset, as `cyclopean export` does and with the same options.

    Parameters
    ----------
    places
        Folders of sessions, from one station or many, or single session logs.
    folder
        Folder of the dataset; an earlier export there is replaced.
    **options
        Those of `extensions.bids.About` by their names, such as ``name="Gloss"`` or ``with_simulated=True``.

    Returns
    -------
    pathlib.Path
        The folder of the dataset.

    Raises
    ------
    InputError
        If there is no session, logs are damaged or contradict each other, or ``folder`` has other files.
    """
    return export_results([Path(place) for place in places], Path(folder), made(About, options)).folder
