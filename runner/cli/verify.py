"""`cyclopean verify`: whether results are as they were recorded."""

from __future__ import annotations

from pathlib import Path

import click


@click.command(name="verify")
@click.argument("results", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="RESULTS...")
@click.option(
    "--mirror",
    type=click.Path(path_type=Path),
    help="Folder of the copies. Default: the one that the rig of a session named, if it lies in RESULTS.",
)
@click.option(
    "--strict", is_flag=True, help="Exit status 1 also for a log that is unchained, from its first line or at all."
)
@click.option(
    "--key",
    type=click.Path(path_type=Path),
    help="Public key of who sealed the results: a seal that it signed must name each log.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(results: tuple[Path, ...], mirror: Path | None, strict: bool, key: Path | None, as_json: bool) -> None:
    """Check that results are as they were recorded.

    RESULTS are folders of sessions and measurements, from one station or many, or single logs. Each line's checksum is
    computed again, each copy compared with its log, and each folder that was sealed with its seal. Every line that does
    not fit is named, and the exit status is then 1. Logs of older versions are unchained: nothing protects them.
    """
    import json

    from analysis.records import check_results
    from documents.files import unprotected
    from documents.text import counted, visible

    check = check_results(*results, mirror=mirror, key=key)
    if as_json:
        click.echo(json.dumps(check.to_json(), indent=2))
    else:
        for log in check.logs:
            copy = f", copy: {visible(log.mirror)}" if log.mirror else ""
            lines = counted(log.lines, "line", "lines")
            click.echo(f"{visible(str(log.file))}: {lines}, {log.checksums}, {log.ending}{copy}, digest {log.digest}")
        for seal in check.seals:
            words = counted(len(seal.findings), "difference", "differences") if seal.findings else "as sealed"
            file, utc = visible(str(seal.seal.file)), visible(seal.seal.content.sealed_utc)
            click.echo(f"{file}: sealed {utc}, {words}, {seal.signature}, SHA-256 {seal.seal.digest}")
        for finding in check.findings:
            click.echo(f"error: {finding}", err=True)
    weak = [log for log in check.logs if log.chained_from != 1]
    if strict:
        for log in weak:
            click.echo(f"error: {visible(str(log.file))}: this log is {log.checksums}", err=True)
    if check.findings or (strict and weak):
        raise SystemExit(1)
    if not as_json:
        if chained := sum(log.chained_from is not None for log in check.logs):
            click.echo(f"{counted(chained, 'log', 'logs')}: every checksum fits")
        for sentence in unprotected(log.chained_from for log in check.logs):
            click.echo(f"note: {sentence}")
