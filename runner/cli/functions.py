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
from runner.commands import COMMANDS, GROUPS


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
        "export": partial(command_of, "runner.reports.export.export_results", leave_out={"facts"}),
        "verify": partial(command_of, "analysis.seals.check.check_results"),
        "seal": partial(command_of, "runner.session.sealing.seal"),
        "watch": partial(
            command_of, "runner.session.watching.watch", indent=None, help="Print JSON: one line each time."
        ),
        "demo": partial(command_of, "runner.reports.demo.run_demo", indent=None),
        "preview": partial(command_of, "runner.reports.screens.preview", lines=_pictures, indent=None),
        "doctor": partial(command_of, "runner.check.doctor.examine_machine"),
        "stimuli build": partial(command_of, "stimuli.build.report.build_report", threads, indent=1),
        "display patches": partial(command_of, "runner.measuring.show_patches.show_patches", indent=None),
        "display new": partial(command_of, "devices.display.nominal.write_nominal_display", indent=None),
        "display measure": partial(command_of, "runner.measuring.station.measure_display", indent=None),
        "display fit": partial(command_of, "devices.characterise.display_fit.fit_file"),
        "display verify": partial(command_of, "runner.measuring.verification.verify_display", indent=None),
        "display report": partial(command_of, "runner.reports.display.page.report_display"),
        "camera develop": partial(command_of, "stimuli.develop.photograph.develop_photographs", threads),
        "camera geometry": partial(command_of, "devices.camera.geometry.plan_geometry"),
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
