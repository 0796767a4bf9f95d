"""The options that the commands which show patches share, and how they talk."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from devices.instruments.open import Wiring
    from runner.measuring.station import Talk
    from runner.measuring.take_readings import Outcome
    from runner.measuring.target import Target

Command = TypeVar("Command", bound=Callable[..., Any])
# As devices.instruments.INSTRUMENTS and devices.patches.BUILT_IN have them; held here so that help appears at once.
INSTRUMENTS = ("cs2000", "pr655", "spotread", "manual", "simulated")
EYES = ("both", "left", "right")


def showing_options(command: Command) -> Command:
    """Add how patches are shown."""
    for option in (
        click.option("--windowed", is_flag=True, help="A window in place of the full screen."),
        click.option(
            "--backend",
            type=click.Choice(["window", "egl", "null"]),
            default="window",
            show_default=True,
            help="Where to draw; without a window there are no keys.",
        ),
        click.option(
            "--settle",
            "settle_s",
            type=click.FloatRange(0),
            default=1.0,
            show_default=True,
            metavar="S",
            help="How long a patch stands before it is read.",
        ),
        click.option(
            "--repeat-every",
            type=click.IntRange(0),
            default=12,
            show_default=True,
            help="Show black and white again after so many patches; 0 never does.",
        ),
        click.option("--seed", type=int, default=1, show_default=True, help="Of the order of the patches."),
    ):
        command = option(command)
    return command


def instrument_options(command: Command) -> Command:
    """Add what reads the light."""
    for option in (
        click.option(
            "--instrument-option",
            "instrument_options",
            multiple=True,
            metavar="KEY=VALUE",
            help='An option of the instrument: noise=0.01 (simulated), measure_s=400, "spotread=-X panel.ccss".',
        ),
        click.option("--port", help="The instrument's serial port, or its number with spotread."),
        click.option("--instrument", type=click.Choice(INSTRUMENTS), required=True, help="What reads the light."),
    ):
        command = option(command)
    return command


def wiring_of(target: Target, eye: str, instrument: str, port: str | None, options: Sequence[str], seed: int) -> Wiring:
    """Return what instruments may need: the port, their options, the person at the terminal, a model to simulate.

    A simulated instrument looks at the target, or at the display file that its option ``display`` names.
    """
    from devices.display_file import read_display
    from devices.instruments.open import Wiring
    from runner.measuring.station import eye_model

    parsed = parse_options(options)
    models = target.models
    if instrument == "simulated" and "display" in parsed:
        models = read_display(Path(parsed.pop("display"))).models(target.mode.name)
    model = None if models is None else eye_model(models, eye)
    return Wiring(port, parsed, _ask, _tell, model, seed)


def parse_options(options: Sequence[str]) -> dict[str, str]:
    """Return KEY=VALUE as a mapping; raise click.UsageError if one is not of that form."""
    parsed = {}
    for option in options:
        key, equals, value = option.partition("=")
        if not equals:
            raise click.UsageError(f"'{option}' is no option of an instrument: write KEY=VALUE.")
        parsed[key.strip()] = value.strip()
    return parsed


def talk(quiet: bool) -> Talk:
    """Return what tells of each reading on the error stream, unless ``quiet``."""
    from runner.measuring.station import Talk
    from runner.measuring.take_readings import Progress

    def on_progress(progress: Progress) -> None:
        if progress.reading is None:
            what = f"not read: {progress.why}"
        else:
            what = "X {:.4g}  Y {:.4g}  Z {:.4g} cd/m²".format(*progress.reading.XYZ_cd_m2)
        left = f"{duration(progress.left_s)} left" if progress.done < progress.of else "done"
        click.echo(f"{progress.done}/{progress.of}  {progress.step.label}: {what}  ({left})", err=True)

    return Talk() if quiet else Talk(on_progress, _tell)


def duration(seconds: float) -> str:
    """Return a duration in words: 40 s, 12 min, 2 h 5 min."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"


def raise_unless_complete(outcome: Outcome, file: Path) -> None:
    """Raise WorkError if patches are missing, saying how to go on."""
    from runner.cli.main import WorkError

    if outcome.stopped:
        raise WorkError(f"{outcome.stopped}; {outcome.taken} readings are safe in {file}: go on with --resume")
    if outcome.failed:
        shown = ", ".join(outcome.failed[:5]) + (" ..." if len(outcome.failed) > 5 else "")
        raise WorkError(f"{len(outcome.failed)} patches could not be read ({shown}); try them again with --resume")


def _ask(prompt: str) -> str | None:
    click.echo(prompt, nl=False, err=True)
    typed = sys.stdin.readline()
    return typed.rstrip("\n") if typed else None


def _tell(words: str) -> None:
    click.echo(words, err=True)
