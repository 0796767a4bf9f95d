"""What became of a log's file while it was written: how it differs from what was written, and writing it again."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from documents.files.atomic import whole_file
from documents.files.faults import system_fault
from documents.platform import rename, state_folder, sync_folder

_STEP = 1 << 20
_LAYOUT = 4  # EXPERIMENT/sub-OBSERVER/ses-LABEL/session.jsonl


class LogDisturbedError(OSError):
    """Another program removed, replaced or changed a log while it was written; as text, how, and where its lines are.

    ``saved`` is the file that has all lines, None if they could not be written; ``in_place`` says that it is the log's
    own place, ``complete`` that the log has its end line, ``taken`` that another process writes it now.
    """

    def __init__(
        self, file: Path, what: str, lines: int, rescue: RescuedLog, *, complete: bool, taken: bool = False
    ) -> None:
        self.saved, self.complete, self.taken = rescue.saved, complete, taken
        self.in_place = rescue.saved == file
        count = "its line" if lines == 1 else f"its {lines} lines"
        were, are = ("was", "is") if lines == 1 else ("were", "are")
        words = f"{what} while it was written: {file}. "
        if self.in_place:
            words += f"{count.capitalize()} {were} written there again"
        elif rescue.saved and taken:
            words += f"{count.capitalize()} {were} kept in {rescue.saved}: compare that file with the log"
        elif rescue.saved:
            words += f"{count.capitalize()} cannot be written there again ({rescue.fault}) and {are} in "
            words += f"{rescue.saved}: copy that file to its place"
        else:
            words += f"{count.capitalize()} CANNOT BE WRITTEN there again, nor in the state folder ({rescue.fault}): "
            words += "only a copy (results_mirror) has them"
        if rescue.aside:
            words += f"; what was found there is kept in {rescue.aside}"
        super().__init__(words + ". Find the program that did it, such as one that synchronises folders")


@dataclass(frozen=True, slots=True)
class RescuedLog:
    """Where a log was written again, where what was found in its place is, and why it is not in its place."""

    saved: Path | None
    aside: Path | None = None
    fault: str = ""


def difference(
    file: Path, descriptor: int | None, content: bytes | bytearray, *, exact: bool, closely: bool
) -> str | None:
    """Return how ``file`` differs from the log open as ``descriptor``, whose bytes are ``content``; None if it is it.

    ``exact`` says that nothing may follow the content. Bytes are read only if asked for ``closely``, or if the path
    names another file than is open: some network drives number a file differently each time it is looked at.
    """
    try:
        named = os.stat(file)
        held = named if descriptor is None else os.fstat(descriptor)
        other = (named.st_dev, named.st_ino) != (held.st_dev, held.st_ino)
        fits = not (other or closely) or _begins_with(file, content)
        if other and not fits:
            return "another program put another file in the place of the log"
        if named.st_size < len(content) or (exact and named.st_size > len(content)):
            return f"another program changed the log's length from {len(content)} to {named.st_size} bytes"
        return None if fits else "another program changed the log"
    except FileNotFoundError:
        return "another program removed the log"
    except OSError as error:
        return f"the log could not be read again ({system_fault(error) or error.strerror})"


def _begins_with(file: Path, content: bytes | bytearray) -> bool:
    with open(file, "rb") as stream:
        starts = range(0, len(content), _STEP)
        return all(stream.read(min(_STEP, len(content) - at)) == content[at : at + _STEP] for at in starts)


def rescue(file: Path, content: bytes | bytearray, *, elsewhere: bool = False) -> RescuedLog:
    """Write ``content`` to ``file`` again, at once; where that fails, or ``elsewhere`` is asked, to the state folder.

    What stands there and is no part of it, as another program's lines, is kept beside it.
    """
    faults: list[str] = []
    kept = state_folder().joinpath("rescued", *file.absolute().parts[-_LAYOUT:])
    for place in (kept,) if elsewhere else (file, kept):
        try:
            aside = _write_again(place, content)
        except OSError as error:
            faults.append(str(system_fault(error) or error.strerror or error))
        else:
            return RescuedLog(place, aside, "; ".join(faults))
    return RescuedLog(None, None, "; ".join(faults))


def _write_again(file: Path, content: bytes | bytearray) -> Path | None:
    aside = None
    with whole_file(file, private=True) as draft:
        with open(draft, "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        if file.is_file() and not _is_part(file, content):
            aside = _free_name(file)
            rename(file, aside)
    sync_folder(file.parent)
    return aside


def _is_part(file: Path, content: bytes | bytearray) -> bool:
    size = file.stat().st_size
    return size <= len(content) and _begins_with(file, content[:size])


def _free_name(file: Path) -> Path:
    number = 1
    while (name := file.with_name(f"{file.stem}.found-{number}.bin")).exists():
        number += 1
    return name
