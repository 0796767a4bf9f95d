"""The one place where text leaves for a terminal: streams and consoles without hidden characters, and tables.

Names, notes and remarks come from files of other people. A terminal obeys control characters in them: it would clear
the screen, hide a line, or type into the shell. `clean_streams` takes them out of all that is printed, whoever prints
it; only what a console itself writes, colours and the progress bar, passes as it is.
"""

from __future__ import annotations

import io
import os
import re
import sys
from collections.abc import Iterable
from functools import cache
from typing import TYPE_CHECKING, TextIO, cast

from documents.text.words import HIDDEN, visible

if TYPE_CHECKING:
    from rich.console import Console

_HIDDEN = re.compile(f"[{HIDDEN}]|\r(?!\n)")


def clean(text: str) -> str:
    """Return ``text`` without hidden characters; its lines stay.

    Parameters
    ----------
    text
        Any text, of one line or several.

    Returns
    -------
    str
        The text without control characters and direction marks.

    Examples
    --------
    >>> clean(chr(27) + "[2Jgone" + chr(10) + "next")
    '[2Jgone\\nnext'
    """
    return text if text.isascii() and text.isprintable() else _HIDDEN.sub("", text)


class CleanStream(io.TextIOBase):
    """A stream that writes to ``own`` what is left of a text without hidden characters."""

    def __init__(self, own: TextIO) -> None:
        self.own = own

    @property
    def encoding(self) -> str:  # type: ignore[override]  # a variable in the base class
        """The encoding of the stream below."""
        return self.own.encoding

    @property
    def errors(self) -> str | None:  # type: ignore[override]  # a variable in the base class
        """What the stream below does where its encoding lacks a sign."""
        return self.own.errors

    def write(self, text: str | bytes) -> int:
        """Write ``text``, cleaned; bytes, in which click prints completions, are UTF-8."""
        if not isinstance(text, str):
            if not text:
                raise TypeError("this is a stream of text")  # as click asks, which would write past it otherwise
            text = text.decode("utf-8", "replace")
        self.own.write(clean(text))
        return len(text)

    def flush(self) -> None:
        """Write what waits."""
        self.own.flush()

    def fileno(self) -> int:
        """Return the number of the file below."""
        return self.own.fileno()

    def isatty(self) -> bool:
        """Return whether it is a terminal."""
        return self.own.isatty()

    def writable(self) -> bool:
        """Return True."""
        return True


def clean_streams() -> None:
    """Let nothing that this process prints from here on contain hidden characters, tracebacks included."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is not None and not isinstance(stream, CleanStream):
            setattr(sys, name, CleanStream(stream))


def own_stream(stream: TextIO) -> TextIO:
    """Return the stream to which a program writes its own control sequences, with text that it has cleaned itself."""
    return cast(TextIO, getattr(stream, "own", stream))


@cache
def _console_class() -> type[Console]:
    from rich.console import Console, ConsoleOptions, RenderableType
    from rich.segment import Segment
    from rich.table import Table
    from rich.text import Text

    def on_one_line(cell: RenderableType) -> RenderableType:
        if isinstance(cell, str):
            return visible(cell)
        if isinstance(cell, Text) and not cell.plain.isprintable():
            cell = cell.copy()
            cell.plain = visible(cell.plain)
        return cell

    class CleanConsole(Console):
        """A console whose texts are clean, each text that it is given on one line; its own sequences pass."""

        def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
            if isinstance(renderable, Text):
                renderable = on_one_line(renderable)
            elif isinstance(renderable, Table):  # before the widths of its columns are measured
                for column in renderable.columns:
                    column._cells[:] = map(on_one_line, column.cells)
            for segment in super().render(renderable, options):
                yield segment if segment.control else Segment(clean(segment.text), segment.style)

    return CleanConsole


def clean_console(*, errors: bool = False, width: int | None = None) -> Console:
    """Return a console for standard output, or the error stream, that prints text without hidden characters.

    Parameters
    ----------
    errors
        Whether it is the error stream.
    width
        How many columns it has; None asks the terminal.

    Returns
    -------
    rich.console.Console
        The console; numbers in texts are not coloured.

    Examples
    --------
    >>> clean_console().print("a" + chr(7) + "b")
    ab
    """
    return _console_class()(file=own_stream(sys.stderr if errors else sys.stdout), highlight=False, width=width)


def say(*parts: str | tuple[str, str], errors: bool = False) -> None:
    """Print a line of which some parts have a style, such as ``("warning:", "yellow")``.

    Parameters
    ----------
    parts
        Texts, and pairs of a text and its style. Colours are for a terminal only.
    errors
        Whether to print to the error stream.

    Examples
    --------
    >>> say(("warning:", "yellow"), " the screen is dim")
    warning: the screen is dim
    """
    stream = sys.stderr if errors else sys.stdout
    if not (stream.isatty() or "FORCE_COLOR" in os.environ):
        print(visible("".join(part if isinstance(part, str) else part[0] for part in parts)), file=stream)
        return
    from rich.text import Text

    clean_console(errors=errors).print(Text.assemble(*parts), soft_wrap=True)
