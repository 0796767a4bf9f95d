"""The folder of an export: it appears whole or not at all, and replaces nothing but an earlier export."""

from __future__ import annotations

import json
import os
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from analysis.bids.dataset_files import GENERATOR
from analysis.errors import ResultsError
from documents import Finding

_OURS = re.compile(
    r"dataset_description\.json|README|CHANGES|participants\.(tsv|json)|task-[^/]+_(beh|events)\.json"
    r"|sub-[^/]+/ses-[^/]+/beh/sub-[^/]+_ses-[^/]+_task-[^/]+_(beh|events)\.(tsv|json)"
    r"|sourcedata/[^/]+/sub-[^/]+/ses-[^/]+/session\.jsonl"
)
# What file managers put into folders by themselves.
_LITTER = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})


def check_replaceable(folder: Path) -> None:
    """Do nothing if ``folder`` does not exist, is empty, or holds an export and nothing else.

    Raises
    ------
    ResultsError
        Otherwise: nothing that someone else put there is overwritten.
    """
    if not folder.exists():
        return
    if not folder.is_dir():
        raise ResultsError(Finding("this is a file", str(folder), remedy="name a folder"))
    if not any(folder.iterdir()):
        return
    if not _is_export(folder):
        raise ResultsError(
            Finding("this folder holds something that is no export", str(folder), remedy="name a new or empty folder")
        )
    inside = (path for path in folder.rglob("*") if path.name not in _LITTER and (path.is_symlink() or path.is_file()))
    names_inside = sorted(path.relative_to(folder).as_posix() for path in inside)
    foreign = [name for name in names_inside if not _OURS.fullmatch(name)]
    if foreign:
        names = ", ".join(foreign[:5])
        raise ResultsError(
            Finding(
                f"this export holds something that was added to it: {names}",
                str(folder),
                remedy="take it out, or name a new folder",
            )
        )


def _is_export(folder: Path) -> bool:
    try:
        made = json.loads((folder / "dataset_description.json").read_bytes())
        return bool(made["GeneratedBy"][0]["Name"] == GENERATOR)
    except (OSError, ValueError, KeyError, IndexError, TypeError):
        return False


@contextmanager
def replacing(folder: Path) -> Iterator[Path]:
    """Yield a new folder beside ``folder`` that takes its place once all went well; otherwise nothing is left of it."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    part = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", suffix=".part", dir=folder.parent))
    try:
        yield part
        mask = os.umask(0)
        os.umask(mask)
        part.chmod(0o777 & ~mask)
        check_replaceable(folder)
        if folder.exists():
            before = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", suffix=".before", dir=folder.parent))
            os.replace(folder, before)  # onto an empty folder
            try:
                os.replace(part, folder)
            except BaseException:
                os.replace(before, folder)
                raise
            shutil.rmtree(before, ignore_errors=True)
        else:
            os.replace(part, folder)
    except BaseException:
        shutil.rmtree(part, ignore_errors=True)
        raise
