"""`cyclopean`: the group of commands, loaded one at a time so that the help text appears at once."""

from __future__ import annotations

import codecs
import gc
import importlib
import io
import os
import sys
from collections.abc import Mapping
from typing import Any

import click
from click.shell_completion import CompletionItem

from documents.blas_threads import prefer_one_blas_thread
from runner.cli.examples import EXAMPLES
from runner.cli.options import completed
from runner.cli.output import count_from_here, say, tell
from runner.commands import COMMANDS, OURS, commands


class LazyGroup(click.Group):
    """Commands by name, of `runner.commands`: all, or those of a group within.

    ``commands_help`` gives each command's line in the help.
    """

    def __init__(self, *args: Any, commands_help: Mapping[str, str], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._commands_help = commands_help

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the commands' names in the order of the help."""
        return list(self._commands_help)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Load a command, or return None if there is no such one."""
        if "." in cmd_name:
            return None  # it is how packages name a command of a group, and nothing to type
        return _named(cmd_name if self._commands_help is COMMANDS else f"{self.name} {cmd_name}")

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Return the commands that begin so, without loading them."""
        if incomplete.startswith("-"):
            return super().shell_complete(ctx, incomplete)
        found = [(name, line) for name, line in self._commands_help.items() if name.startswith(incomplete)]
        return [CompletionItem(name, help=line) for name, line in found]

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command that ``args`` begins with; a misspelt one is refused with the nearest spelling."""
        name = click.utils.make_str(args[0])
        if not (name in self._commands_help or name.startswith("-")) and self.get_command(ctx, name) is None:
            from documents.text import nearest  # only now: it brings pydantic

            near = nearest(name, self._commands_help)
            hint = f" Did you mean '{near}'?" if near else ""
            within = f"{self.name} " if ctx.parent else ""
            raise click.UsageError(f"There is no command '{within}{name}'.{hint}", ctx)
        called, command, rest = super().resolve_command(ctx, args)
        if command and not isinstance(command, click.Group):
            _refuse_given_twice(command, click.Context(command, info_name=called, parent=ctx), rest)
        return called, command, rest

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; what it is refused for is one line, whatever the names in it."""
        try:
            return super().invoke(ctx)
        except click.UsageError as error:
            from documents.text import visible

            raise click.UsageError(visible(error.format_message()), error.ctx) from None

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands' lines without loading them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(self._commands_help.items()))


def _named(called: str) -> click.Command | None:
    """Return the command that is called so, ours or an extension's; None where nobody offers it."""
    name = called.replace(" ", ".")
    if target := OURS.get(name):
        module, _, attribute = target.partition(":")
        command: click.Command | None = getattr(importlib.import_module(module), attribute)
    else:
        command = commands().get(name)
    if command is None:
        return None
    if (examples := EXAMPLES.get(called)) and not command.epilog:
        command.epilog = "\b\nExamples:\n" + "\n".join(f"  {line}" for line in examples)
    return completed(command)


def _refuse_given_twice(command: click.Command, ctx: click.Context, args: list[str]) -> None:
    """Refuse an option with one value that is given twice: of two values, one would be left out without a word."""
    _, _, given = command.make_parser(ctx).parse_args(list(args))
    single = [each for each in given if isinstance(each, click.Option) and not (each.multiple or each.is_flag)]
    for option in single:
        if single.count(option) > 1:
            raise click.UsageError(f"{max(option.opts, key=len)} is given twice, and takes one value.", ctx)


def _say_version(context: click.Context, option: click.Parameter, asked: bool) -> None:
    """Say which version this is, and which packages add to it."""
    if not asked:
        return
    from importlib.metadata import version

    from documents.extensions import installed

    tell(["\n  with ".join([f"cyclopean, version {version('cyclopean')}", *dict.fromkeys(map(str, installed()))])])
    context.exit()


@click.group(
    cls=LazyGroup,
    commands_help=COMMANDS,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_say_version,
    help="Show the version and exit.",
)
@click.pass_context
def group(context: click.Context) -> None:
    """Show colorimetrically exact stereo pictures to observers, and score what they answer.

    Start with `cyclopean demo`. Then make a study of your own: `cyclopean new my_study photos/`.

    Exit status: 0 done, 1 the work failed, 2 the input was wrong.
    """
    count_from_here(context)


# What is written for signs that the encoding of a console or a pipe lacks, as those of Windows lack many.
_SPELT = {
    **{
        "Δ": "d",
        "λ": "lambda",
        "→": "->",
        "←": "<-",
        "≤": "<=",
        "≥": ">=",
        "≠": "!=",
        "≈": "~",
        "×": "x",
        "±": "+/-",
        "°": " deg",
    },
    **{"−": "-", "–": "-", "—": "-", "·": "|", "…": "...", "•": "*", "“": '"', "”": '"', "‘": "'", "’": "'"},
    **dict.fromkeys("━╸╺─", "-"),
}


def _spell(error: UnicodeError) -> tuple[str, int]:
    """Return letters in place of what cannot be encoded, and where to continue."""
    import unicodedata

    if not isinstance(error, UnicodeEncodeError):
        raise error
    letters = []
    for sign in error.object[error.start : error.end]:
        plain = _SPELT.get(sign) or unicodedata.normalize("NFKD", sign).encode("ascii", "ignore").decode()
        name = unicodedata.name(sign, "")
        greek = name.split()[-1].lower() if name.startswith("GREEK") else "?"
        letters.append(plain or ("" if unicodedata.combining(sign) else greek))
    return "".join(letters), error.end


def _ready_streams() -> None:
    """Let all text be written, whatever the encoding of the console, and without what a terminal would obey."""
    from documents.text import clean_streams

    codecs.register_error("cyclopean-spell", _spell)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="cyclopean-spell")
    clean_streams()


def _start_soon() -> None:
    """Spare each command what its start would only waste.

    Classes, records and figures are made by the thousand and stay: to search them for cycles again and again takes a
    tenth of the time. To look for plugins, pydantic would read what every installed package says of itself.
    """
    gc.set_threshold(10_000, 20, 50)
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")


def main() -> None:
    """Run the command line; what goes wrong ends with a line each and exit status 2, or 1 if it was not the input."""
    _ready_streams()
    _start_soon()
    prefer_one_blas_thread()
    try:
        group(prog_name="cyclopean")
    except Exception as error:
        # Only now: these bring pydantic, which the help text must not wait for.
        from documents import InputError, WorkError
        from documents.files import system_fault
        from documents.text import visible

        if isinstance(error, InputError):
            for finding in error.findings:
                say(f"error: {finding}")
            sys.exit(2)
        if isinstance(error, WorkError):
            say(f"cyclopean: {visible(str(error))}")
            sys.exit(1)
        if fault := system_fault(error):
            name = getattr(error, "filename", None)
            say(f"cyclopean: {visible(f'{name}: ' if name else '')}{fault} ({fault.remedy})")
            sys.exit(1)
        if isinstance(error, PermissionError) and error.filename:
            say(f"error: {visible(str(error.filename))}: you may not open this (ask for the right)")
            sys.exit(2)
        raise
