"""A progress bar on the error stream, so that standard output stays clean; none where nobody watches."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

Step = Callable[[str, int, int], None]


@contextmanager
def progress_bar(quiet: bool = False) -> Iterator[Step]:
    """Yield a function that takes what is being done, how much of it is done, and of how much.

    A bar is there from the first step of its work to the last, so that lines can be printed before and after. Where
    the error stream is no terminal there is none, and neither where it is to be ``quiet``.
    """
    if quiet or not sys.stderr.isatty():
        yield lambda what, done, of: None
        return
    bar: Progress | None = None
    tasks: dict[str, TaskID] = {}
    last: tuple[str, int, int] | None = None

    def step(what: str, done: int, of: int) -> None:
        nonlocal bar, last
        if bar is None and (what, done, of) == last:
            return  # reported already
        last = what, done, of
        if bar is None:
            bar = _bar()
            bar.start()
        if what not in tasks:
            tasks[what] = bar.add_task(what, total=of)
        bar.update(tasks[what], completed=done, total=of)
        if bar.finished:
            stop()

    def stop() -> None:
        nonlocal bar
        if bar is not None:
            bar.stop()
        bar = None
        tasks.clear()

    try:
        yield step
    finally:
        stop()


def _bar() -> Progress:
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from documents.text import clean_console

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    return Progress(*columns, console=clean_console(errors=True))
