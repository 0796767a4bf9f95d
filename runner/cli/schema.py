"""`cyclopean schema`: the JSON Schema of each kind of file, for editors that check while you type."""

from __future__ import annotations

import json

import click

from runner.protocol.schemas import KINDS, FileKind, json_schema


@click.command(short_help="Print the JSON Schema of a file that you write.")
@click.argument("kind", type=click.Choice(KINDS), default="experiment")
def command(kind: FileKind) -> None:
    """Print the JSON Schema of a file that you write.

    Save it and name it in your editor's settings for YAML. The editor then completes keys and marks mistakes.
    """
    click.echo(json.dumps(json_schema(kind), indent=2))
