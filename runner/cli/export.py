"""`cyclopean export`: results as a BIDS dataset."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from documents.text import counted

if TYPE_CHECKING:
    from analysis.bids import Export
    from analysis.records import Header


@click.command(name="export")
@click.argument("results", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="RESULTS...")
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="Folder of the dataset.")
@click.option("--name", help="Name of the dataset. Default: the experiments' names.")
@click.option("--author", "authors", multiple=True, help="Author of the dataset; repeat for each.")
@click.option("--license", "license_", help="Licence of the dataset, such as CC0 or CC-BY-4.0.")
@click.option(
    "--with-simulated",
    is_flag=True,
    help="Export simulated observers beside people; without it they are exported only where nobody else answered.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    results: tuple[Path, ...],
    output: Path,
    name: str | None,
    authors: tuple[str, ...],
    license_: str | None,
    with_simulated: bool,
    as_json: bool,
) -> None:
    """Write results as a BIDS dataset.

    RESULTS are folders of sessions, from one station or many, or single session.jsonl files.
    """
    import json

    from analysis.bids import About, export_dataset
    from documents import WorkError
    from documents.files import writing
    from runner.cli.output import progress_bar
    from runner.reports import given_facts

    def facts(header: Header, versions: Collection[str], log: Path) -> Mapping[str, str]:
        return given_facts(
            header, None, log.parent.parent.parent.parent, versions
        )  # RESULTS/EXPERIMENT/OBSERVER/SESSION

    with writing(output, "dataset", WorkError), progress_bar(quiet=as_json) as step:
        about = About(name, authors, license_)
        done = export_dataset(results, output, about, step, with_simulated=with_simulated, facts=facts)
    if as_json:
        click.echo(json.dumps(done.to_json(), indent=2))
        return
    for kept, copy in done.copies:
        click.echo(f"note: {copy} is a copy of {kept} and is exported once")
    for doubt in done.doubts:
        click.echo(f"note: {doubt}")
    for sentence in _who(done):
        click.echo(f"note: {sentence}")
    if done.notes:
        click.echo(
            f"note: {counted(done.notes, 'note in free text is', 'notes in free text are')} in the dataset; "
            f"read {'it' if done.notes == 1 else 'them'} before you share it"
        )
    click.echo(
        f"{counted(done.sessions, 'session', 'sessions')} of "
        f"{counted(done.participants, 'participant', 'participants')}, {counted(done.trials, 'trial', 'trials')}, as "
        f"{', '.join(f'task-{label}' for label in done.tasks)}: {done.folder}"
    )


def _who(done: Export) -> Iterator[str]:
    """Yield what a reader must know of simulated observers."""
    if done.left_out:
        are = "session of a simulated observer is" if done.left_out == 1 else "sessions of simulated observers are"
        yield f"{done.left_out} {are} left out, beside those of people; --with-simulated exports them too"
    if done.who.all_simulated:
        yield "all sessions are of simulated observers"
    elif done.who.are_mixed:
        shared = done.who.shared
        same = f"; a person and a simulated observer share the code {', '.join(shared)}" if shared else ""
        are = "is" if done.simulated == 1 else "are"
        yield f"{done.simulated} of {done.sessions} sessions {are} simulated, by the column simulated{same}"
