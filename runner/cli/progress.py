"""A progress bar on the error stream, so that standard output stays clean; none where nobody watches."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from runner.protocol.experiment import Experiment
    from stimuli.build.stimulus_set import StimulusSet

Step = Callable[[str, int, int], None]


@contextmanager
def progress_bar(quiet: bool = False) -> Iterator[Step]:
    """Yield a function that takes what is being done, how much of it is done, and of how much."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    bar = Progress(*columns, console=Console(stderr=True), disable=quiet)
    tasks: dict[str, TaskID] = {}

    def step(what: str, done: int, of: int) -> None:
        bar.start()  # only now: work that fails before its first step leaves no empty line
        if what not in tasks:
            tasks[what] = bar.add_task(what, total=of)
        bar.update(tasks[what], completed=done, total=of)

    try:
        yield step
    finally:
        if tasks:
            bar.stop()


def build_stimuli(design: Experiment, step: Step) -> StimulusSet:
    """Build the experiment's stimuli, or find them built, as one line of the bar."""
    from stimuli.build.recipe_to_set import build_set
    from stimuli.recipes.build_context import DisplaySetup

    pitch_mm, setup = design.rig.display.panel.pixel_pitch_mm, DisplaySetup.of(design.rig)
    return build_set(
        design.recipe_file, pitch_mm, lambda what, done, of: step("Building stimuli", done, of), setup=setup
    )
