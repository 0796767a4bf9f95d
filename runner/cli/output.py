"""What a command prints: its result as JSON or in words, lines on the error stream, and a progress bar there."""

from __future__ import annotations

import functools
import inspect
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeAlias

import click

from documents.text import say as say_in_colours
from documents.work import counted_work

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from documents.pages import Block

Command = Callable[..., Any]
Step = Callable[[str, int, int], None]
Told: TypeAlias = "str | Block | tuple[str | tuple[str, str], ...]"
_KEY = "cyclopean.work"


def gives(
    *,
    indent: int | None = 2,
    work: bool = False,
    help: str = "Print the result as JSON.",
) -> Callable[[Command], Command]:
    """Return what prints the result that a command returns, in words or, with its option ``--json``, as JSON.

    A result ``told()`` gives what people read of it: sentences as they are, blocks of a page, and of sentences with
    colours their parts. Its JSON is that of its field ``json_only``, if it names one; ``apart(as_json)`` gives lines
    for the error stream. Then what it has as ``failure`` is raised, and its ``exit_status`` is that of the program. Of
    several results one after the other each is printed, those that come ``again`` in place of the one before. A
    command may return a pair of JSON and what people read as well; one that returns None has printed by itself. It is
    given of the `HANDS` those that it has parameters for.

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
            with progress_bar(quiet=as_json) as progress:
                hands = {name: _hand(name, as_json, progress) for name in HANDS if name in wanted}
                found = command(**given, **hands)
            if isinstance(found, tuple):
                facts, parts = found
                print_json(facts, indent) if as_json else tell(parts)
                return
            for one in found if isinstance(found, Iterator) else (found,):
                if one is not None:
                    show(one, as_json=as_json, indent=indent, work=work)

        return click.option("--json", "as_json", is_flag=True, help=help)(called)

    return add


# What the command line gives a function by itself, by the name of the parameter.
HANDS = ("progress", "notify", "dialogue", "ask_monitor", "asked", "as_json")


def _hand(name: str, as_json: bool, progress: Step) -> Any:
    if name == "dialogue":
        from runner.measuring import Dialogue

        return Dialogue(say, ask) if as_json else Dialogue(say, ask, say)
    if name == "ask_monitor":
        from runner.presenter import primary_monitor

        return primary_monitor
    hands = {"progress": progress, "notify": say, "as_json": as_json}
    return click.get_current_context().params if name == "asked" else hands[name]


def show(found: Any, *, as_json: bool, indent: int | None = 2, work: bool = False) -> None:
    """Print a result as JSON or in words; then raise its ``failure``, or end with its ``exit_status``."""
    if getattr(found, "again", False) and not as_json:
        click.clear()
    if as_json and not getattr(found, "words_only", False):
        from documents.text import json_value

        only = getattr(found, "json_only", "")
        facts = json_value(getattr(found, only)) if only else found.to_json() | (work_done() if work else {})
        print_json(facts, indent)
    else:
        tell(found.told())
    if hasattr(found, "apart"):
        tell(found.apart(as_json), errors=True)
    if failure := getattr(found, "failure", None):
        raise failure
    if status := getattr(found, "exit_status", 0):
        sys.exit(status)


def print_json(facts: Any, indent: int | None = 2) -> None:
    """Print plain values as JSON."""
    import json

    click.echo(json.dumps(facts, indent=indent, allow_nan=False))


def tell(parts: Iterable[Told], *, errors: bool = False) -> None:
    """Print lines as they are, lines of parts with colours, and blocks of a page."""
    for part in parts:
        if isinstance(part, str):
            click.echo(part, err=errors)
        elif isinstance(part, tuple):
            say_in_colours(*part, errors=errors)
        else:
            from documents.pages import print_blocks

            print_blocks((part,))


def say(line: str) -> None:
    """Print a line on the error stream."""
    tell((line,), errors=True)


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
