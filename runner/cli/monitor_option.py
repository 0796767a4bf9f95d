"""The option `--monitor` of the commands that open a window."""

from __future__ import annotations

import click

monitor_option = click.option(
    "--monitor",
    "monitors",
    multiple=True,
    metavar="NAME|NUMBER",
    help="Monitor for the window, as `cyclopean doctor` lists them; twice for dual-window, the left eye's first. "
    "Default: the rig's, else the first of the panel's resolution.",
)
