"""What the commands that show patches share: options, each group given as one value, and words for the terminal."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from documents.text import counted
from runner.cli.monitor_option import monitor_option
from runner.cli.number_types import COUNT, NOT_NEGATIVE, SEED, Within
from runner.measuring.options import Dialogue, InstrumentOptions, PatchOptions, ShowOptions

if TYPE_CHECKING:
    from devices.display import PanelSpec
    from runner.measuring.take_readings import Outcome, Progress

Command = Callable[..., Any]
# As devices.readings.INSTRUMENTS and devices.readings.BUILT_IN have them; repeated here so that help appears at once.
INSTRUMENTS = ("cs2000", "pr655", "spotread", "manual", "simulated")
SETS = (
    "Set of patches; repeat for several: table_c1, grey, cube, dark; warm-up, warm-up-places, repeatability, "
    "additivity, on-white, cable, uniformity, angles, crosstalk, glasses, ambient; all; or FILE.csv."
)


def _gathered(name: str, kind: type[Any], *options: Callable[[Command], Command]) -> Callable[[Command], Command]:
    """Return what adds ``options`` to a command, which gets them as one ``kind`` called ``name``."""

    def add(command: Command) -> Command:
        @functools.wraps(command)
        def called(**given: Any) -> Any:
            taken = {field.name: given.pop(field.name) for field in fields(kind)}
            return command(**given, **{name: kind(**taken)})

        with_options: Command = called
        for option in reversed(options):
            with_options = option(with_options)
        return with_options

    return add


show_options = _gathered(
    "show",
    ShowOptions,
    click.option(
        "--eye",
        type=click.Choice(["both", "left", "right"]),
        default="both",
        show_default=True,
        help="Eye to measure; the other eye sees black.",
    ),
    click.option("--seed", type=SEED, default=1, show_default=True, help="Random seed for the order of the patches."),
    click.option(
        "--repeat-every",
        type=COUNT,
        default=12,
        show_default=True,
        help="Number of patches after which black and white are shown again; 0: never.",
    ),
    click.option(
        "--settle",
        "settle_s",
        type=NOT_NEGATIVE,
        default=1.0,
        show_default=True,
        metavar="S",
        help="Time that a patch is shown before it is read.",
    ),
    click.option(
        "--backend",
        type=click.Choice(["window", "egl", "null"]),
        default="window",
        show_default=True,
        help="Where to draw; without a window there are no keys.",
    ),
    click.option("--windowed", is_flag=True, help="Use a window instead of the full screen."),
    monitor_option,
)
patch_options = _gathered(
    "patches",
    PatchOptions,
    click.option("--set", "set_names", multiple=True, default=("table_c1",), show_default=True, help=SETS),
    click.option(
        "--codes", "code_range", help="Range of the codes in FILE.csv, if it does not say: 0..1, 0..255 or 0..1023."
    ),
    click.option(
        "--every",
        "every_s",
        type=NOT_NEGATIVE,
        metavar="S",
        help="Time between two readings of the warm-up. Default: 60 s.",
    ),
    click.option(
        "--area",
        type=Within(0, 1, min_open=True),
        metavar="SHARE",
        help="Share of the picture that patches fill, in its middle. Default: all of it.",
    ),
    click.option(
        "--surround",
        type=Within(0, 1),
        metavar="CODE",
        help="Grey around the patches, 0 (black) to 1 (white).",
    ),
)
_instrument_options = _gathered(
    "instrument",
    InstrumentOptions,
    click.option(
        "--instrument", type=click.Choice(INSTRUMENTS), required=True, help="Instrument that reads the light."
    ),
    click.option("--port", help="Serial port of the instrument, or its number with spotread."),
    click.option(
        "--instrument-option",
        "instrument_options",
        multiple=True,
        metavar="KEY=VALUE",
        callback=lambda _, __, options: parse_options(options),
        help='Option of the instrument: noise=0.01 (simulated), measure_s=400, "spotread=-X panel.ccss".',
    ),
    click.option(
        "--accept-readings", is_flag=True, help="Keep readings that make no sense, which else stop the measurement."
    ),
)


def instrument_options(command: Command) -> Command:
    """Add what reads the light, as ``instrument``, and whether nobody is there to be waited for."""
    unattended = click.option("--unattended", is_flag=True, help="Say what to move, but do not wait for a key.")
    return _instrument_options(unattended(command))


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
    from runner.cli.main import WorkError

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
