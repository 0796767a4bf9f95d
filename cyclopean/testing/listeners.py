"""The promises of every listener, tried on one: it hears a session and costs it nothing."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from pathlib import Path

from cyclopean.testing.blocks import Study, answers_of
from cyclopean.testing.promises import kept
from documents.files import read_regular
from runner.session import Event, Listener

QUICK_S = 0.004
"""How long a listener may take for an event, in s: a quarter of what a screen of 60 Hz shows a frame for."""


def prove_listener(listener: Callable[[], Listener], folder: str | Path) -> tuple[str, ...]:
    """Prove that a listener costs a session nothing.

    A small study is run by simulated observers without it, with it, and with it from the middle of a session on.

    Parameters
    ----------
    listener
        The listener's class.
    folder
        An empty folder to work in.

    Returns
    -------
    tuple of str
        The promises that it kept.

    Raises
    ------
    BrokenPromiseError
        If a promise is not kept.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from runner.session import SessionStatus
    >>> with TemporaryDirectory() as folder:
    ...     "it takes no time" in prove_listener(SessionStatus, folder)
    True
    """
    tried = _Tried(listener, Path(folder))
    return kept(
        {
            "it raises nothing": tried.quiet,
            "it costs no answer": tried.harmless,
            "it takes no time": tried.quick,
            "so it does in a session that goes on": tried.resumed,
        }
    )


class _Tried:
    """A study, and a listener that hears sessions of it, of which it is known what it raised and how long it took."""

    def __init__(self, listener: Callable[[], Listener], folder: Path) -> None:
        self._study, self._listener = Study(folder, "kind: all_pairs, stimuli: [a, b, c, d]"), listener
        self._alone = answers_of(self._study.run("alone"))
        self._heard = _Heard(listener())
        self._log = self._study.run("heard", listeners=(self._heard,))

    def quiet(self) -> str | None:
        return self._heard.raised

    def harmless(self) -> str | None:
        return None if answers_of(self._log) == self._alone else "the answers are others with it"

    def quick(self) -> str | None:
        took = statistics.median(self._heard.took_s)
        return None if took <= QUICK_S else f"{1000 * took:.1f} ms for an event"

    def resumed(self) -> str | None:
        whole = read_regular(self._log.file, 100_000_000)
        heard = _Heard(self._listener())
        log = self._study.resumed(self._log, whole[: len(whole) // 2], listeners=(heard,))
        return heard.raised or ("some trials were not asked" if log.pending else None)


class _Heard:
    """Passes events to a listener."""

    def __init__(self, listener: Listener) -> None:
        self._listener = listener
        self.raised: str | None = None
        self.took_s: list[float] = []

    def hear(self, event: Event) -> None:
        begun = time.perf_counter()
        try:
            self._listener.hear(event)
        except Exception as error:
            self.raised = self.raised or f"of {type(event).__name__}: {type(error).__name__}: {error}"
        self.took_s.append(time.perf_counter() - begun)
