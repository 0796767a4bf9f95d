"""`cyclopean seal`: the SHA-256 of every file of results, in one file that a paper can cite."""

from __future__ import annotations

from pathlib import Path

import click


@click.command(name="seal")
@click.argument("results", type=click.Path(path_type=Path), metavar="RESULTS")
@click.option("--replace", is_flag=True, help="Seal again; the new seal names the one that it replaces.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(results: Path, replace: bool, as_json: bool) -> None:
    """Write down the SHA-256 of every file of results.

    RESULTS is a folder of sessions. Its file seal.json then names every session log, the experiment, rig, display,
    recipe and pictures that the sessions were made with, and the versions of all packages. `cyclopean verify` compares
    the folder with it.
    """
    import json

    from documents.text import counted
    from runner.cli.main import WorkError
    from runner.session import seal_results

    try:
        seal = seal_results(results, replace=replace)
    except OSError as error:
        raise WorkError(f"the seal cannot be written to {results}: {error.strerror}") from error
    if as_json:
        click.echo(json.dumps(seal.to_json(), indent=2))
        return
    content = seal.content
    people = counted(content.observers, "observer", "observers")
    sessions = f"{counted(content.sessions, 'session', 'sessions')} of {people}"
    click.echo(f"Sealed: {counted(len(content.files), 'file', 'files')}, {sessions}: {seal.file}")
    click.echo(f"Cite it by its SHA-256: {seal.digest}")
    click.echo(f"Compare the folder with it: cyclopean verify {results}")
