"""The copy of the results that the rig asks for: the log, what was torn off it, and the files it was made with."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

from analysis.records import FILE_NAME, copy_in_mirror
from documents import Finding
from documents.files import Mirror
from runner.errors import SessionError
from runner.session.folders import Recorder


def refuse_mirror_within(results: Path, mirror: Path, rig: str) -> None:
    """Raise SessionError if results and their copies would lie in one folder."""
    inside, outside = results.resolve(), mirror.resolve()
    if inside.is_relative_to(outside) or outside.is_relative_to(inside):
        what = f"results_mirror is {mirror}, and the results are in {results}: one lies in the other"
        raise SessionError(Finding(what, rig, remedy="name a folder on another disk"))


def start_mirror(recorder: Recorder, folder: Path, configuration: Path, note: Callable[[str, str], None]) -> Mirror:
    """Have the session of ``recorder`` copied to ``folder``, with the files in ``configuration``.

    What goes wrong is noted once in the session's log, by ``note``, and never stops the session.
    """

    def beside() -> Iterator[tuple[Path, Path]]:
        for file in sorted(recorder.folder.glob("torn-*.bin")):
            yield file, copy_in_mirror(recorder.folder / FILE_NAME, folder).with_name(file.name)
        experiment = recorder.folder.parents[1]
        for file in sorted(configuration.rglob("*")):
            if file.is_file():
                yield file, folder / experiment.name / file.relative_to(experiment)

    def on_fault(words: str) -> None:
        with suppress(OSError, ValueError):  # the session is over, or its own disk is full, which it reports
            note(words, "program")

    log = recorder.folder / FILE_NAME
    mirror = Mirror(log, copy_in_mirror(log, folder), folder, beside, on_fault)
    recorder.follow_with(mirror)
    return mirror
