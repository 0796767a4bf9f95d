"""What a command prints: its result as JSON or in words, lines on the error stream, and a progress bar there."""

from __future__ import annotations

import functools
import inspect
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from documents.work import counted_work

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from documents.pages import Block

Command = Callable[..., Any]
Step = Callable[[str, int, int], None]
_KEY = "cyclopean.work"


def gives(
    *,
    indent: int | None = 2,
    work: bool = False,
    help: str = "Print the result as JSON.",
) -> Callable[[Command], Command]:
    """Return what prints the result that a command returns, in words or, with its option ``--json``, as JSON.

    A result ``told()`` gives what people read of it: sentences as they are, and blocks of a page. Its JSON is that of
    its field ``json_only``, if it names one. What it has as ``failure`` is raised after it was printed. A command may
    return a pair of JSON and what people read as well; one that returns None has printed by itself. It is given
    ``as_json`` and ``step``, which shows progress, if it has parameters of these names.

    Parameters
    ----------
    indent
        Spaces by which JSON is indented; on one line if None.
    work
        Whether JSON says what was done, by kind.
    help
        The help of ``--json``.
    """

    def add(command: Command) -> Command:
        wanted = inspect.signature(command).parameters

        @functools.wraps(command)
        def called(as_json: bool, **given: Any) -> Any:
            if "as_json" in wanted:
                given["as_json"] = as_json
            if "step" in wanted:
                with progress_bar(quiet=as_json) as step:
                    found = command(step=step, **given)
            else:
                found = command(**given)
            if isinstance(found, tuple):
                facts, parts = found
                print_json(facts, indent) if as_json else tell(parts)
            elif found is not None:
                show(found, as_json=as_json, indent=indent, work=work)

        return click.option("--json", "as_json", is_flag=True, help=help)(called)

    return add


def show(found: Any, *, as_json: bool, indent: int | None = 2, work: bool = False) -> None:
    """Print a result as JSON or in words; then raise its ``failure``, if it names one."""
    if as_json:
        from documents.text import json_value

        only = getattr(found, "json_only", "")
        facts = json_value(getattr(found, only)) if only else found.to_json() | (work_done() if work else {})
        print_json(facts, indent)
    else:
        tell(found.told())
    if failure := getattr(found, "failure", None):
        raise failure


def print_json(facts: Any, indent: int | None = 2) -> None:
    """Print plain values as JSON."""
    import json

    click.echo(json.dumps(facts, indent=indent, allow_nan=False))


def tell(parts: Iterable[str | Block]) -> None:
    """Print lines as they are, and blocks of a page."""
    for part in parts:
        if isinstance(part, str):
            click.echo(part)
        else:
            from documents.pages import print_blocks

            print_blocks((part,))


def say(words: str) -> None:
    """Print a line on the error stream."""
    click.echo(words, err=True)


def ask(prompt: str) -> str | None:
    """Print a prompt on the error stream, and return the line that is typed; None at the end of input."""
    click.echo(prompt, nl=False, err=True)
    return typed.rstrip("\n") if (typed := sys.stdin.readline()) else None


def count_from_here(context: click.Context) -> None:
    """Count what is done until the command of ``context`` ends."""
    context.meta[_KEY] = context.with_resource(counted_work())


def work_done() -> dict[str, dict[str, int]]:
    """Return ``{"work": …}``: how many sessions, trials and pictures were read, models fitted and figures drawn."""
    return {"work": dict(sorted(click.get_current_context().meta.get(_KEY, {}).items()))}


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
