"""The promises of every part of the report, tried on one: it says what each session holds, and breaks no page."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from analysis.records import SessionLog, read_session
from analysis.report import PARTS, Part, parts_of
from cyclopean.answers import report
from cyclopean.testing.blocks import Study
from cyclopean.testing.promises import BrokenPromiseError, kept
from documents.files import read_regular
from documents.pages import Section
from documents.text import json_value

Made = Callable[[Sequence[SessionLog]], Part | None]


def prove_report_part(name: str, entry: str, folder: str | Path, *, part: Made | None = None) -> tuple[str, ...]:
    """Prove that a part of the report keeps what the program promises of every part.

    Two simulated observers answer a small study around a block whose records name the part. It is made of both
    sessions, of one, of one that was not finished, and of sessions without such a block.

    Parameters
    ----------
    name
        The part, as records name it.
    entry
        The block as it stands under ``blocks:``; its stimuli are `NAMES`.
    folder
        An empty folder to work in.
    part
        The function, in place of the one that is found by the name.

    Returns
    -------
    tuple of str
        The promises that it kept.

    Raises
    ------
    BrokenPromiseError
        If a promise is not kept.
    InputError
        If the entry is wrong, or no record of its names the part.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> entry = "kind: rating, ratings: [{name: like, question: How good, lowest: 1, highest: 5}]"
    >>> with TemporaryDirectory() as folder:
    ...     "every session counts" in prove_report_part("ratings", entry, folder)
    True
    """
    with PARTS.trying(name, part):
        tried = _Tried(name, entry, Path(folder))
        return kept(
            {
                "it is made of its records": tried.made,
                "every session counts": tried.each,
                "the order of sessions changes nothing": tried.any_order,
                "a session that was not finished is reported": tried.unfinished,
                "there is none without its records": tried.none,
                "its page shows it": tried.shown,
            }
        )


class _Tried:
    """Sessions of two observers; each attempt returns what broke."""

    def __init__(self, name: str, entry: str, folder: Path) -> None:
        self._name, self._folder = name, folder
        self._study = Study(folder, entry)
        self._logs = [self._study.run(f"results-{observer}", observer) for observer in ("01", "02")]

    def _part(self, logs: Sequence[SessionLog]) -> Part:
        parts, failed = parts_of(logs, only=self._name)
        if failed or not parts:
            raise BrokenPromiseError(failed[0].reason if failed else "there is none")
        return parts[0]

    def _said(self, *logs: SessionLog) -> str:
        """Return its sentences, the rows of its tables, and its result, as a text."""
        part = self._part(logs)
        tables = [table for one in (*part.sections({}), *part.observers()) for table in one.tables()]
        said = [
            list(part.sentences),
            [sorted(map(str, table.rows)) for table in tables],
            _sorted(json_value(part.result)),
        ]
        return json.dumps(said, allow_nan=False, sort_keys=True)

    def made(self) -> str | None:
        self._said(*self._logs)
        part = self._part(self._logs)
        return None if all(isinstance(one, Section) for one in part.sections({})) else "its sections are none"

    def each(self) -> str | None:
        same = self._said(*self._logs) == self._said(self._logs[0])
        return "with a second observer it is the same" if same else None

    def any_order(self) -> str | None:
        return None if self._said(*self._logs) == self._said(*self._logs[::-1]) else "it is another"

    def unfinished(self) -> str | None:
        log = self._logs[0]
        kind = next(trial.kind for trial in log.trials if trial.report_part == self._name)
        lines = read_regular(log.file, 100_000_000).splitlines(keepends=True)
        own = [at for at, line in enumerate(lines) if at and f'"{kind}"'.encode() in line]
        cut = self._folder / "cut.jsonl"
        cut.write_bytes(b"".join(lines[: own[max(0, len(own) - 2)] + 1]))
        self._said(read_session(cut))
        return None

    def none(self) -> str | None:
        (self._folder / "plain").mkdir()
        other = Study(self._folder / "plain", "kind: all_pairs, stimuli: [a, b, c]").run("results")
        return None if PARTS[self._name]([other]) is None else "it is made of pairs that were compared"

    def shown(self) -> str | None:
        places = (self._folder / f"results-{observer}" for observer in ("01", "02"))
        page = report(*places, output=self._folder / "page.html", part=self._name, with_simulated=True)
        text = read_regular(page, 100_000_000).decode()
        lacking = [one.title for one in self._part(self._logs).sections({}) if f'id="{one.key}"' not in text]
        return f"its section '{lacking[0]}' is not there" if lacking else None


def _sorted(value: Any) -> Any:
    """Return plain values with their lists sorted, as these may follow the sessions."""
    if isinstance(value, dict):
        return {key: _sorted(inner) for key, inner in value.items()}
    return sorted(map(_sorted, value), key=str) if isinstance(value, list) else value
