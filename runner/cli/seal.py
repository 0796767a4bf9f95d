"""`cyclopean seal`: the SHA-256 of every file of results, in one file that a paper can cite."""

from __future__ import annotations

from pathlib import Path

import click


@click.command(name="seal")
@click.argument("results", type=click.Path(path_type=Path), metavar="RESULTS", required=False)
@click.option("--replace", is_flag=True, help="Seal again; the new seal names the one that it replaces.")
@click.option("--key", type=click.Path(path_type=Path), help="Private key to sign the seal with.")
@click.option("--new-key", type=click.Path(path_type=Path), help="Make a private key FILE, and FILE.pub for others.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(results: Path | None, replace: bool, key: Path | None, new_key: Path | None, as_json: bool) -> None:
    """Write down the SHA-256 of every file of results.

    RESULTS is a folder of sessions. Its file seal.json then names every session log, the experiment, rig, display,
    recipe and pictures that the sessions were made with, and the versions of all packages. `cyclopean verify` compares
    the folder with it. With --key it is signed (seal.sig): `cyclopean verify --key FILE.pub` then tells whether it is
    yours. --new-key makes such a key, once, and seals nothing.
    """
    if new_key is not None:
        if results is not None or key is not None or replace:
            raise click.UsageError("--new-key makes a key and seals nothing: give it alone.")
        _make_key(new_key, as_json)
        return
    if results is None:
        raise click.UsageError("Missing argument 'RESULTS'.")
    import json

    from documents import WorkError
    from documents.files import writing
    from documents.text import counted
    from runner.session import seal_results

    with writing(results, "seal", WorkError):
        seal = seal_results(results, replace=replace, key=key)
    if as_json:
        click.echo(json.dumps(seal.to_json(), indent=2))
        return
    content = seal.content
    people = counted(content.observers, "observer", "observers")
    sessions = f"{counted(content.sessions, 'session', 'sessions')} of {people}"
    click.echo(f"Sealed: {counted(len(content.files), 'file', 'files')}, {sessions}: {seal.file}")
    click.echo(f"Cite it by its SHA-256: {seal.digest}")
    if key is not None:
        click.echo(f"Signed: {seal.file.with_name('seal.sig')}")
    click.echo(f"Compare the folder with it: cyclopean verify {results}{'' if key is None else f' --key {key}'}")


def _make_key(file: Path, as_json: bool) -> None:
    import json

    from analysis.records import new_key
    from documents import WorkError
    from documents.files import writing

    with writing(file, "key", WorkError):
        key = new_key(file)
    public = f"{file}.pub"
    if as_json:
        click.echo(json.dumps({"private_key": str(file), "public_key": public, "name": key.name}, indent=2))
        return
    click.echo(f"Private key: {file}. Keep it from others, and a copy of it: it cannot be made again.")
    click.echo(f"Public key, for all who are to check what you sign: {public}, named {key.name}")
    click.echo(f"Sign with it: cyclopean seal RESULTS --key {file}")
