"""The promises of every form of export, tried on one: nothing is lost, in the dataset or beside it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cyclopean.testing.blocks import Study
from cyclopean.testing.promises import kept
from documents import InputError, WorkError
from documents.files import read_regular
from runner.reports import EXPORTERS, About, export_results

_MOST_BYTES = 100_000_000


def prove_exporter(name: str, folder: str | Path, *, exporter: Callable[..., Any] | None = None) -> tuple[str, ...]:
    """Prove that a form of export keeps what the program promises of every one.

    Simulated observers answer a small study. Their sessions are exported as they are, without the last answer, without
    a session, and with a log that is damaged; into no folder, one with an export, and one with another file.

    Parameters
    ----------
    name
        What is typed after ``--to``.
    folder
        An empty folder to work in.
    exporter
        The function, where its package is not installed.

    Returns
    -------
    tuple of str
        The promises that it kept.

    Raises
    ------
    BrokenPromiseError
        If a promise is not kept.
    InputError
        If the results cannot be exported.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     "each answer is in the dataset" in prove_exporter("bids", folder)
    True
    """
    with EXPORTERS.trying(name, exporter):
        tried = _Tried(name, Path(folder))
        return kept(
            {
                "it says what it wrote": tried.said,
                "the results stay as they are": tried.harmless,
                "each answer is in the dataset": tried.answers,
                "each session is in the dataset": tried.sessions,
                "a damaged log is an error, and the dataset stays": tried.damaged,
                "files that are not its own stay": tried.others,
            }
        )


class _Tried:
    """Two sessions of a study, and datasets of them; each attempt returns what broke."""

    def __init__(self, name: str, folder: Path) -> None:
        self._name, self._folder = name, folder
        study = Study(folder, "kind: all_pairs, stimuli: [a, b, c]")
        self._logs = [study.run("results").file, study.run("others").file]
        self._results = [folder / "results", folder / "others"]
        self._whole = [read_regular(log, _MOST_BYTES) for log in self._logs]
        self._dataset = folder / "dataset"

    def _export(self, results: list[Path], to: Path) -> Any:
        return export_results(results, to, self._name, About("Proof", with_simulated=True))

    def _without_end(self, kept: bytes, name: str) -> dict[str, bytes]:
        """Export the sessions, of the first what was ``kept`` of its log."""
        self._logs[0].write_bytes(kept)
        try:
            return files_of(self._export(self._results, self._folder / name).folder)
        finally:
            self._logs[0].write_bytes(self._whole[0])

    def said(self) -> str | None:
        exported = self._export(self._results, self._dataset)
        told = " ".join(map(str, exported.told()))
        json.dumps(exported.to_json(), allow_nan=False)
        if exported.folder != self._dataset.resolve() or not files_of(exported.folder):
            return f"nothing is in {exported.folder}"
        return None if exported.sessions == len(self._logs) and told else f"{exported.sessions} sessions: '{told}'"

    def harmless(self) -> str | None:
        logs = zip(self._logs, self._whole, strict=True)
        changed = [log for log, whole in logs if read_regular(log, _MOST_BYTES) != whole]
        return f"{changed[0]} was written to" if changed else None

    def answers(self) -> str | None:
        whole = self._whole[0]
        begins = whole.rindex(b"\n", 0, whole.rindex(b'"chosen"')) + 1
        ends = whole.index(b"\n", begins) + 1
        same = self._without_end(whole[:begins], "without") == self._without_end(whole[:ends], "with")
        return "with an answer more it is the same" if same else None

    def sessions(self) -> str | None:
        self._export(self._results[:1], self._folder / "one")
        one, both = files_of(self._folder / "one"), files_of(self._dataset)
        return "without the second session it is the same" if one == both else None

    def damaged(self) -> str | None:
        before, middle = files_of(self._dataset), len(self._whole[0]) // 2
        self._logs[0].write_bytes(self._whole[0][:middle] + b"\0" * 9 + self._whole[0][middle:])
        try:
            self._export(self._results, self._dataset)
            return "it was exported"
        except (InputError, WorkError):
            return None if files_of(self._dataset) == before else "the dataset is another"
        finally:
            self._logs[0].write_bytes(self._whole[0])

    def others(self) -> str | None:
        own = self._folder / "own"
        own.mkdir()
        (own / "thesis.txt").write_text("mine", encoding="utf-8")
        try:
            self._export(self._results, own)
            return "a folder with another file was taken"
        except (InputError, WorkError):
            return None if files_of(own) == {"thesis.txt": b"mine"} else "another file was touched"


def files_of(folder: Path) -> dict[str, bytes]:
    """Return what the files of a folder hold, by their names."""
    files = (file for file in folder.rglob("*") if file.is_file())
    return {file.relative_to(folder).as_posix(): read_regular(file, _MOST_BYTES) for file in files}
