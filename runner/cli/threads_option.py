"""The option `--threads` of the commands that compute over pixels."""

from __future__ import annotations

import click

from documents.threads import at_most_threads


def _limit(context: click.Context, _: click.Parameter, number: int | None) -> None:
    context.with_resource(at_most_threads(number))


threads_option = click.option(
    "--threads",
    type=click.IntRange(1, 256),
    metavar="N",
    expose_value=False,
    callback=_limit,
    help="Number of threads to compute with. Default: one for each processor core. Results do not depend on it.",
)
