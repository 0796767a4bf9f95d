"""`cyclopean new`: a study of one's own, from pictures or from an experiment that comes with cyclopean."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from runner.cli.options import PATH, takes
from runner.cli.output import Step, gives
from runner.studies import StudyOptions


@click.command(name="new")
@click.argument("study", required=False, type=PATH)
@click.argument("pictures", nargs=-1, type=PATH)
@takes(StudyOptions)
@click.option("--from", "shipped", metavar="NAME", help="Copy an experiment that comes with cyclopean; see --list.")
@click.option("--list", "as_list", is_flag=True, help="List the experiments that come with cyclopean.")
@gives(indent=None)
def new_command(
    study: Path | None,
    pictures: tuple[Path, ...],
    options: StudyOptions,
    shipped: str | None,
    as_list: bool,
    step: Step,
) -> Any:
    """Write a study of your own pictures, ready to run.

    STUDY is the folder to make. PICTURES are files and folders: PNG, JPEG, TIFF, WebP, MPO and JPS. Pairs are found by
    name: plate_L.jpg and plate_R.jpg, or one name in folders left/ and right/. The pictures are copied; they are shown
    pixel for pixel where they fit the screen and are of one size. Nothing is overwritten.
    """
    from documents import WorkError
    from documents.files import writing
    from runner.studies import copy_shipped, new_study, shipped_studies

    if as_list:
        titles = shipped_studies()
        return titles, (f"{name:<18}{title}" for name, title in titles.items())
    with writing(study or Path(shipped or ""), "study", WorkError):
        if shipped is not None:
            return copy_shipped(shipped, study, pictures, options)
        return new_study(study, pictures, options, progress=step)
