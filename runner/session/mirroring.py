"""The copy of the results that the rig asks for: the log, what was torn off it, and the files it was made with."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

from analysis.records import FILE_NAME
from documents import Finding
from documents.files import Mirror
from runner.errors import SessionError
from runner.session.folders import Recorder, is_running


def refuse_mirror_within(results: Path, mirror: Path, rig: str) -> None:
    """Raise SessionError if results and their copies would lie in one folder."""
    inside, outside = results.resolve(), mirror.resolve()
    if inside.is_relative_to(outside) or outside.is_relative_to(inside):
        what = f"results_mirror is {mirror}, and the results are in {results}: one lies in the other"
        raise SessionError(Finding(what, rig, remedy="name a folder on another disk"))


_TORN = re.compile(r"sub-[^/]+/ses-[^/]+/torn-[^/]+\.bin")


def start_mirror(recorder: Recorder, folder: Path, note: Callable[[str, str], None]) -> Mirror:
    """Have the session of ``recorder`` copied to ``folder``, and what that lacks of the experiment's other sessions.

    What goes wrong is noted once in the session's log, by ``note``, and never stops the session.
    """

    from analysis.records import copy_in_mirror

    def beside() -> Iterator[tuple[Path, Path]]:
        experiment = recorder.folder.absolute().parents[1]
        for file in sorted(experiment.rglob("*")):
            copy = folder / experiment.name / file.relative_to(experiment)
            name = file.relative_to(experiment).as_posix()
            wanted = name.startswith("configuration/") or _TORN.fullmatch(name) or _lacks(file, copy, recorder.folder)
            if wanted and file.is_file():
                yield file, copy

    def on_fault(words: str) -> None:
        with suppress(OSError, ValueError):  # the session is over, or its own disk is full, which it reports
            note(words, "program")

    copy = copy_in_mirror(recorder.folder.absolute() / FILE_NAME, folder)
    mirror = Mirror(recorder.log, copy, folder, beside, on_fault)
    recorder.follow_with(mirror)
    return mirror


def _lacks(file: Path, copy: Path, own: Path) -> bool:
    """Return whether ``file`` is another session's log that nobody writes now, and ``copy`` is not all of it."""
    if file.name != FILE_NAME or file.parent.name == own.name:
        return False
    return not (copy.exists() and copy.stat().st_size == file.stat().st_size) and not is_running(file.parent)
