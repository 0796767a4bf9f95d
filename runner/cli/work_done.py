"""What a command did, by kind, for its JSON."""

from __future__ import annotations

import click

from documents.work import counted_work

_KEY = "cyclopean.work"


def count_from_here(context: click.Context) -> None:
    """Count what is done until the command of ``context`` ends."""
    context.meta[_KEY] = context.with_resource(counted_work())


def work_done() -> dict[str, dict[str, int]]:
    """Return ``{"work": …}``: how many sessions, trials and pictures were read, models fitted and figures drawn."""
    return {"work": dict(sorted(click.get_current_context().meta.get(_KEY, {}).items()))}
