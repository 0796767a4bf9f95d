"""What the commands that show patches share: options, each group given as one value, and words for the terminal."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from documents.text import counted
from runner.cli.options import takes
from runner.measuring.options import Dialogue, InstrumentOptions, PatchOptions, ShowOptions

if TYPE_CHECKING:
    from devices.display import PanelSpec
    from runner.measuring.take_readings import Outcome, Progress

Command = Callable[..., Any]
show_options = takes(ShowOptions, "show")
patch_options = takes(PatchOptions, "patches")
_instrument = takes(InstrumentOptions, "instrument", leave_out={"instrument_options"})
_KEYS = 'Option of the instrument: noise=0.01 (simulated), measure_s=400, "spotread=-X panel.ccss".'
_ITS_OPTIONS = click.option("--instrument-option", "own", multiple=True, metavar="KEY=VALUE", help=_KEYS)
_UNATTENDED = click.option("--unattended", is_flag=True, help="Say what to move, but do not wait for a key.")


def instrument_options(command: Command) -> Command:
    """Add what reads the light, as ``instrument``, and whether nobody is there to be waited for."""

    @functools.wraps(command)
    def called(*, instrument: InstrumentOptions, own: Sequence[str], **given: Any) -> Any:
        return command(instrument=replace(instrument, instrument_options=parse_options(own)), **given)

    return _instrument(_ITS_OPTIONS(_UNATTENDED(called)))


def parse_options(options: Sequence[str]) -> dict[str, str]:
    """Return KEY=VALUE as a mapping; raise click.UsageError if one is not of that form."""
    parsed = {}
    for option in options:
        key, equals, value = option.partition("=")
        if not equals:
            raise click.UsageError(f"'{option}' is no option of an instrument: write KEY=VALUE.")
        parsed[key.strip()] = value.strip()
    return parsed


def dialogue(show: ShowOptions, *, unattended: bool, quiet: bool) -> Dialogue:
    """Return what reports each reading on the error stream, unless ``quiet``, and what waits for the person.

    In a window that is a key; elsewhere, the end of a line on the terminal.
    """

    def on_progress(progress: Progress) -> None:
        if progress.reading is None:
            what = f"not read: {progress.why}"
        else:
            what = "X {:.4g}  Y {:.4g}  Z {:.4g} cd/m²".format(*progress.reading.XYZ_cd_m2)
        left = f"{duration(progress.left_s)} left" if progress.done < progress.of else "done"
        click.echo(f"{progress.done}/{progress.of}  {progress.step.label}: {what}  ({left})", err=True)

    def note_request(request: str) -> bool:
        note(request)
        return True

    def wait_for_enter(request: str) -> bool:
        return _ask(f"{request} Then press Enter: ") is not None

    ready = note_request if unattended else None if show.backend == "window" else wait_for_enter
    always = Dialogue(ready=ready, note=note, warn=_warn, ask=_ask, correct=say)
    return always if quiet else replace(always, on_progress=on_progress, say=say)


def note(remark: str) -> None:
    """Print ``remark`` on the error stream, unless it is empty."""
    if remark:
        click.echo(f"note: {remark}", err=True)


def say(words: str) -> None:
    """Print ``words`` on the error stream."""
    click.echo(words, err=True)


def duration(seconds: float) -> str:
    """Return a duration in words: 40 s, 12 min, 2 h 5 min."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"


def raise_unless_complete(outcome: Outcome, file: Path) -> None:
    """Raise WorkError if patches are missing, saying how to resume."""
    from documents import WorkError

    safe = f"{counted(outcome.taken, 'reading is', 'readings are')} safe in {file}"
    if outcome.set_aside:
        aside = counted(len(outcome.set_aside), "reading was", "readings were")
        raise WorkError(
            f"{outcome.stopped}; {aside} set aside, and {safe}: --resume reads what is missing; if such readings are "
            "right, --accept-readings keeps them"
        )
    if outcome.stopped:
        raise WorkError(f"{outcome.stopped}; {safe}: resume with --resume")
    if outcome.failed:
        shown = ", ".join(outcome.failed[:5]) + (" ..." if len(outcome.failed) > 5 else "")
        raise WorkError(
            f"{counted(len(outcome.failed), 'patch', 'patches')} could not be read ({shown}); "
            f"try {'it' if len(outcome.failed) == 1 else 'them'} again with --resume"
        )


def _ask(prompt: str) -> str | None:
    click.echo(prompt, nl=False, err=True)
    typed = sys.stdin.readline()
    return typed.rstrip("\n") if typed else None


def _warn(remark: str) -> None:
    click.echo(f"warning: {remark}", err=True)


def panel_of(text: str) -> PanelSpec:
    """Return the panel that ``--panel`` states, such as ``1920x1080,0.2768,120,8``."""
    from devices.display import PanelSpec

    try:
        return PanelSpec.parse(text)
    except ValueError:
        raise click.UsageError(f"--panel is '{text}'; write it as 1920x1080,0.2768,120,8") from None
