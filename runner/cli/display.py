"""`cyclopean display`: measure a display, fit a model to it, and check both."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from devices.characterise import FileOptions
from devices.diagnostics import JudgeOptions
from devices.display import NominalOptions
from runner.cli.main import LazyGroup
from runner.cli.options import PATH, takes
from runner.cli.output import ask, gives, say, tell
from runner.measuring import Dialogue, MeasureOptions, PatchesOptions, VerifyOptions
from runner.reports.options import ConvertOptions
from stimuli.spectral import MetamerismOptions

COMMANDS = {
    "new": "Write the file of a nominal display, to begin with before it is measured.",
    "patches": "Show patches of known device codes full-screen in a stereo mode.",
    "measure": "Show patches and read each with an instrument.",
    "fit": "Fit display models to measurements and choose the one that predicts best.",
    "verify": "Show new colours, read them, and report the colour error.",
    "convert": "Convert codes to XYZ or back, or a display file to an ICC profile or .cube.",
    "metamerism": "Find how differently observers see an object beside its match on the screen.",
    "report": "Write an HTML page that judges a display by its measurements.",
}
_rig_or_display = click.argument("rig_or_display", type=PATH)


@click.group(cls=LazyGroup, name="display", package=__name__, commands_help=COMMANDS)
def display_command() -> None:
    """Measure a display, fit a model to it, and check both."""


def _dialogue(*, quiet: bool = False) -> Dialogue:
    """Return what talks with the person on the error stream and standard input; ``quiet`` of each patch."""
    return Dialogue(say, ask) if quiet else Dialogue(say, ask, say)


@click.command(name="new")
@click.option("-o", "--output", type=PATH, required=True, help="Display file to write: NAME.yaml.")
@takes(NominalOptions)
@gives(indent=None)
def new_command(output: Path, options: NominalOptions) -> Any:
    """Write the file of a nominal display, to begin with before it is measured.

    A nominal display shows colours by a standard, in every stereo mode. Every record and report of its sessions says
    "nominal, not measured". Nothing is overwritten.

    \b
    Examples:
      cyclopean display new -o monitor.yaml
      cyclopean display new -o projector.yaml --nominal bt1886 --white-cd-m2 48 --panel 1920x1080,1.2
    """
    from devices.display import write_nominal_display
    from runner.presenter import primary_monitor

    return write_nominal_display(output, options, primary_monitor)


@click.command(name="patches")
@_rig_or_display
@takes(PatchesOptions)
@gives(indent=None)
def patches_command(rig_or_display: Path, options: PatchesOptions) -> Any:
    """Show patches of known device codes full-screen in a stereo mode.

    Both eyes see them, or one while the other sees black, so that the mode stays enabled. Right and left show the next
    and the previous patch, space pauses, Escape stops. The order is shuffled by the seed; black and white come again
    throughout.
    """
    from runner.measuring import show_patches

    shown = show_patches(rig_or_display, options, _dialogue())
    return tell(shown.told()) if options.list_only else shown


@click.command(name="measure")
@_rig_or_display
@takes(MeasureOptions)
@gives(indent=None)
def measure_command(rig_or_display: Path, options: MeasureOptions, as_json: bool) -> Any:
    """Show patches and read each with an instrument.

    Readings go to NAME.jsonl one by one, and to a table at the end, for `display fit` and `display report`. Space
    pauses, Escape stops after the reading; --resume continues. Close the blinds, and let the display warm up first,
    unless the warm-up is measured. Where the instrument or the glasses must be moved, the run says so and waits.
    """
    from runner.measuring import measure_display

    return measure_display(rig_or_display, options, _dialogue(quiet=as_json))


@click.command(name="fit")
@click.argument("file", metavar="FILE")
@takes(FileOptions)
@gives()
def fit_command(file: str, options: FileOptions) -> Any:
    """Fit display models to measurements and choose the one that predicts best.

    FILE is a table of measurements: CSV, ArgyllCMS .ti3, a Psychtoolbox calibration .mat, the .jsonl of
    `display measure`, or an ICC profile. Every model is judged on readings that it was not fitted to. Where the file
    has readings of either eye, each is fitted by itself. Where patches that were read again show that the light drifted
    during the run, the readings are brought to its end. Readings beside the other eye's picture, at places of a grid
    and without glasses (@ in their names) give crosstalk, a gain map, and what the glasses take.

    Of an ICC profile without measurements inside, the table is asked for colours, which are fitted. Its matrix and
    curves are taken as they are, unless --model names another model.

    With -o the chosen model, crosstalk and gain map go into a mode of a display file. All else in the file stays, and
    what the mode has already is overwritten only with --replace. With --eye, the mode gets that eye alone.
    """
    from devices.characterise import fit_file

    return fit_file(file, options)


@click.command(name="verify")
@takes(VerifyOptions)
@gives(indent=None)
def verify_command(options: VerifyOptions, as_json: bool) -> Any:
    """Show new colours, read them, and report the colour error.

    The 24 colours of the ColorChecker are asked in XYZ, adapted and scaled into the display's gamut, and shown as a
    session shows its pictures: by the same shader, with crosstalk cancelled and the panel evened out, undithered. The
    differences are in ΔE00 against the display's white. Beside them stands what the display file alone predicts of the
    codes shown.
    """
    from runner.measuring import verify_display

    return verify_display(options, _dialogue(quiet=as_json))


@click.command(name="convert")
@click.argument("file", metavar="[FILE]", default="-")
@takes(ConvertOptions)
def convert_command(file: str, options: ConvertOptions) -> None:
    """Convert a table of device codes to XYZ, or back; or write a display as an ICC profile or a .cube table.

    With --to code or xyz: reads CSV from FILE or standard input, or the readings of an ArgyllCMS .ti3, and writes CSV
    to standard output: the columns red,green,blue, in 0..255 or up to --full, become X,Y,Z in cd/m², or the other way
    about. XYZ include the room's light where the display file has it. Codes are not rounded. Colours outside the gamut
    become the nearest codes channel by channel; their number is printed on the error stream.

    With --to icc or cube: FILE is the display file. The model of one mode and eye is written for other programs,
    without the room's light, and how well the file agrees with the model is printed.
    """
    from runner.reports.display.convert import convert_display

    warning, lines = convert_display(None if file == "-" else file, options, sys.stdin.buffer)
    if warning:
        say(f"cyclopean: {warning}")
    tell(lines)


@click.command(name="metamerism")
@click.argument("objects", type=PATH, metavar="OBJECTS.csv")
@click.argument("readings", type=PATH, metavar="READINGS")
@takes(MetamerismOptions)
@gives(help="Print the result as JSON, every observer's difference included.")
def metamerism_command(objects: Path, readings: Path, options: MetamerismOptions) -> Any:
    """Find how differently observers see an object beside its match on the screen.

    OBJECTS.csv has the columns wavelength_nm and the reflectance of each object. READINGS are readings of the screen
    with spectra, its primaries at full drive among them. Each object in the light is matched on the screen for one
    observer; the differences that others see are in ΔE00 against their own white.
    """
    from stimuli.spectral import metamerism_of_files

    return metamerism_of_files(objects, readings, options)


@click.command(name="report")
@click.argument("measurements", nargs=-1, required=True, type=PATH, metavar="MEASUREMENTS...")
@takes(JudgeOptions)
@click.option("-o", "--output", type=PATH, help="HTML page to write. Default: the first file's name with .html.")
@gives()
def report_command(measurements: tuple[Path, ...], options: JudgeOptions, output: Path | None) -> Any:
    """Judge a display by its measurements, and write an HTML page.

    MEASUREMENTS are files of readings. Each check passes, fails, or says what would have to be read for it. Checks
    that fail do not make the command fail.
    """
    from runner.reports.display.page import report_display

    return report_display(measurements, options, output)
