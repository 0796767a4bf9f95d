"""Which commands are functions: their parameters are arguments and options, their docstring is the help."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType

import click

from documents.text import counted
from runner.cli.main import LazyGroup
from runner.cli.options import command_of, threads
from runner.commands import COMMANDS

# The text is a command's line in the group's help.
GROUPS: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "display": {
            "new": "Write the file of a nominal display, to begin with before it is measured.",
            "patches": "Show patches of known device codes full-screen in a stereo mode.",
            "measure": "Show patches and read each with an instrument.",
            "fit": "Fit display models to measurements and choose the one that predicts best.",
            "verify": "Show new colours, read them, and report the colour error.",
            "convert": "Convert codes to XYZ or back, or a display file to an ICC profile or .cube.",
            "metamerism": "Find how differently observers see an object beside its match on the screen.",
            "report": "Write an HTML page that judges a display by its measurements.",
        },
        "camera": {
            "fit": "Fit a camera model to a photographed colour chart.",
            "develop": "Turn photographs into pictures of linear light.",
            "geometry": "Pixels per millimetre from sensor, lens and distance, and back.",
            "bracket": "Merge exposures of one scene into one picture of linear light.",
            "spectral": "Turn a spectral picture into XYZ, or into what a camera records.",
        },
        "stimuli": {
            "build": "Build the pictures of a recipe, or take them from the cache.",
            "contrast": "Contrast of sparkles over the exposure of their photographs.",
            "list": "List the stimulus sets in the cache.",
            "clean": "Remove leftovers of killed builds from the cache.",
        },
    }
)


def _pictures(files: Sequence[Path]) -> list[str]:
    return [f"{counted(len(files), 'picture is', 'pictures are')} in {files[0].parent}"]


FUNCTIONS: Mapping[str, Callable[[], click.Command]] = MappingProxyType(
    {
        "report": partial(command_of, "runner.reports.results.report_results", work=True),
        "compare": partial(
            command_of,
            "runner.reports.comparison.report.report_comparison",
            threads,
            leave_out={"root", "viewing"},
            work=True,
        ),
        "verify": partial(command_of, "analysis.seals.check.check_results"),
        "seal": partial(command_of, "runner.session.sealing.seal"),
        "watch": partial(
            command_of, "runner.session.watching.watch", indent=None, help="Print JSON: one line each time."
        ),
        "demo": partial(command_of, "runner.reports.demo.run_demo", indent=None),
        "preview": partial(command_of, "runner.reports.screens.preview", lines=_pictures, indent=None),
        "doctor": partial(command_of, "runner.check.doctor.examine_machine"),
        "stimuli build": partial(command_of, "stimuli.build.report.build_report", threads, indent=1),
        "stimuli contrast": partial(command_of, "runner.reports.contrast.contrast"),
        "display patches": partial(command_of, "runner.measuring.show_patches.show_patches", indent=None),
        "display new": partial(command_of, "devices.display.nominal.write_nominal_display", indent=None),
        "display measure": partial(command_of, "runner.measuring.station.measure_display", indent=None),
        "display fit": partial(command_of, "devices.characterise.display_fit.fit_file"),
        "display verify": partial(command_of, "runner.measuring.verification.verify_display", indent=None),
        "display metamerism": partial(
            command_of,
            "stimuli.spectral.metamerism.metamerism_of_files",
            help="Print the result as JSON, every observer's difference included.",
        ),
        "display report": partial(command_of, "runner.reports.display.page.report_display"),
        "camera fit": partial(command_of, "runner.reports.camera.characterise_camera"),
        "camera develop": partial(command_of, "stimuli.develop.photograph.develop_photographs", threads),
        "camera geometry": partial(command_of, "devices.camera.geometry.plan_geometry"),
        "camera bracket": partial(command_of, "stimuli.bracket.bracket.bracket_photographs", leave_out={"exposure"}),
        "camera spectral": partial(command_of, "stimuli.spectral.convert.convert_spectral"),
    }
)


def __getattr__(name: str) -> click.Command:
    """Return a command or a group of ours, such as ``report_command`` or ``display_fit_command``."""
    called = name.removesuffix("_command").replace("_", " ")
    if called in GROUPS:
        return LazyGroup(called, commands_help=GROUPS[called], help=COMMANDS[called])
    if called in FUNCTIONS:
        command = FUNCTIONS[called]()
        command.name = called.split()[-1]
        return command
    found: click.Command = getattr(importlib.import_module("runner.cli.commands"), name)
    return found
