"""Commands on results: `report`, `verify`, `seal`, `watch`, `scores`, `power` and `demo`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from documents import WorkError
from documents.files import writing
from runner.cli.options import PATH, Within, takes
from runner.cli.output import Step, gives, say, show, tell

if TYPE_CHECKING:
    from runner.reports import PowerOptions, ReportOptions, ScoresOptions

_results = click.argument("results", nargs=-1, required=True, type=PATH, metavar="RESULTS...")


@click.command(name="report")
@_results
@click.option("-o", "--output", type=PATH, help="HTML page to write. Default: report.html in the first folder.")
@takes("runner.reports.ReportOptions")
@gives(work=True)
def report_command(
    results: tuple[Path, ...], output: Path | None, options: ReportOptions, as_json: bool, step: Step
) -> Any:
    """Write an HTML report on the results of one experiment.

    RESULTS are folders of sessions, from one station or many, or single session.jsonl files. No person is left
    out by default; the page lists observers who are left out by an option. Simulated observers are not counted beside
    people.
    """
    from analysis.report import report_blocks
    from runner.reports.results import report_results

    with writing(output or results[0], "report", WorkError):
        written = report_results(results, output, options, step)
    if not as_json:
        tell(report_blocks(written.report))
    return written


@click.command(name="verify")
@_results
@click.option(
    "--mirror",
    type=PATH,
    help="Folder of the copies. Default: the one that the rig of a session named, if it lies in RESULTS.",
)
@click.option(
    "--strict", is_flag=True, help="Exit status 1 also for a log that is unchained, from its first line or at all."
)
@click.option(
    "--key", type=PATH, help="Public key of who sealed the results: a seal that it signed must name each log."
)
@gives()
def verify_command(
    results: tuple[Path, ...], mirror: Path | None, strict: bool, key: Path | None, as_json: bool
) -> None:
    """Check that results are as they were recorded.

    RESULTS are folders of sessions and measurements, from one station or many, or single logs. Each line's checksum is
    computed again, each copy compared with its log, and each folder that was sealed with its seal. Every line that does
    not fit is named, and the exit status is then 1. Logs of older versions are unchained: nothing protects them.
    """
    from analysis.seals import check_results
    from documents.text import visible

    check = check_results(*results, mirror=mirror, key=key)
    show(check, as_json=as_json)
    weak = [log for log in check.logs if strict and log.chained_from != 1]
    for finding in () if as_json else check.findings:
        say(f"error: {finding}")
    for log in weak:
        say(f"error: {visible(str(log.file))}: this log is {log.checksums}")
    if check.findings or weak:
        raise SystemExit(1)


@click.command(name="seal")
@click.argument("results", type=PATH, metavar="RESULTS", required=False)
@click.option("--replace", is_flag=True, help="Seal again; the new seal names the one that it replaces.")
@click.option("--key", type=PATH, help="Private key to sign the seal with.")
@click.option("--new-key", type=PATH, help="Make a private key FILE, and FILE.pub for others.")
@gives()
def seal_command(results: Path | None, replace: bool, key: Path | None, new_key: Path | None) -> Any:
    """Write down the SHA-256 of every file of results.

    RESULTS is a folder of sessions. Its file seal.json then names every session log, the experiment, rig, display,
    recipe and pictures that the sessions were made with, and the versions of all packages. `cyclopean verify` compares
    the folder with it. With --key it is signed (seal.sig): `cyclopean verify --key FILE.pub` then tells whether it is
    yours. --new-key makes such a key, once, and seals nothing.
    """
    if new_key is not None:
        if results is not None or key is not None or replace:
            raise click.UsageError("--new-key makes a key and seals nothing: give it alone.")
        return _make_key(new_key)
    if results is None:
        raise click.UsageError("Missing argument 'RESULTS'.")
    from documents.text import counted
    from runner.session import seal_results

    with writing(results, "seal", WorkError):
        seal = seal_results(results, replace=replace, key=key)
    content = seal.content
    people = counted(content.observers, "observer", "observers")
    sessions = f"{counted(content.sessions, 'session', 'sessions')} of {people}"
    signed = [] if key is None else [f"Signed: {seal.file.with_name('seal.sig')}"]
    return seal.to_json(), (
        f"Sealed: {counted(len(content.files), 'file', 'files')}, {sessions}: {seal.file}",
        f"Cite it by its SHA-256: {seal.digest}",
        *signed,
        f"Compare the folder with it: cyclopean verify {results}{'' if key is None else f' --key {key}'}",
    )


def _make_key(file: Path) -> Any:
    from analysis.seals import new_key

    with writing(file, "key", WorkError):
        key = new_key(file)
    public = f"{file}.pub"
    return {"private_key": str(file), "public_key": public, "name": key.name}, (
        f"Private key: {file}. Keep it from others, and a copy of it: it cannot be made again.",
        f"Public key, for all who are to check what you sign: {public}, named {key.name}",
        f"Sign with it: cyclopean seal RESULTS --key {file}",
    )


@click.command(name="watch")
@click.argument("results", type=PATH)
@click.option("--once", is_flag=True, help="Look once, not again and again until Ctrl-C.")
@click.option(
    "--every",
    type=Within(0.2, 3600),
    default=2.0,
    metavar="SECONDS",
    show_default=True,
    help="How often to look again.",
)
@click.option(
    "--within",
    type=Within(0.1, 1e6),
    default=30.0,
    show_default=True,
    metavar="MINUTES",
    help="Show the sessions that were written to so lately.",
)
@gives(help="Print JSON: one line each time.")
def watch_command(results: Path, once: bool, every: float, within: float, as_json: bool) -> None:
    """Show the sessions that are running, on this station and others.

    RESULTS is a folder, which may lie on a drive that several stations share. For each session: the trial, the time
    left, the last answers, missed frames, and when its log was last written to. Only logs are read, and nothing is
    written.
    """
    import time

    from runner.session.watching import Watch, Watched

    def told(found: Watched) -> Iterator[str]:
        yield from (session.line() for session in found.sessions)
        if not found.sessions:
            yield f"no session was written to in the last {within:g} min"

    watch = Watch(results, 60 * within)
    while True:
        found = watch.look()
        if as_json:
            show(found, as_json=True, indent=None)
        else:
            if not once:
                click.clear()
            tell(told(found))
            for finding in found.findings:
                say(f"warning: {finding}")
        if once:
            return
        try:
            time.sleep(every)
        except KeyboardInterrupt:
            return


@click.command(name="scores")
@click.argument("table", metavar="TABLE.csv")
@takes("runner.reports.ScoresOptions")
@gives()
def scores_command(table: str, options: ScoresOptions, as_json: bool) -> None:
    """Fit scores and perceptual classes to a table of paired comparisons.

    TABLE.csv has the columns winner,loser and optionally count, observer, first (the item shown first), outcome (win or
    tie) or ties (how many were tied), and group, scene or content: each group then has scores of its own. Tables of
    choices, square matrices of counts (also MAT-files) and pwcmp's tables are read too. A single dash reads the table
    from standard input.
    """
    import sys

    from analysis.comparisons import read_any
    from runner.cli.output import print_json, work_done
    from runner.reports.scores import refuse_together, score_table

    refuse_together(options)  # before the table is read
    source = sys.stdin.buffer if table == "-" else table
    read = read_any(
        source, "standard input", layout=options.layout, choice_codes=options.codes, keep_na=options.keep_na
    )
    if as_json:
        for line in read.warnings:
            say(f"warning: {line}")
    else:
        tell(read.lines)
    with writing(options.observer_scores or Path("."), "table", WorkError):
        scored = score_table(read.comparisons, options)
    if as_json:
        print_json(scored.to_json() | read.to_json() | work_done())
    else:
        tell(scored.told())
    if problems := scored.problems:
        say("\n".join([f"cyclopean: {problems[0]}", *problems[1:]]))
        sys.exit(1)


@click.command(name="power")
@click.argument("experiment", type=PATH)
@takes("runner.reports.PowerOptions")
@gives()
def power_command(experiment: Path, options: PowerOptions, as_json: bool, step: Step) -> Any:
    """Find how many observers an experiment needs, by simulated studies.

    EXPERIMENT is an experiment file with a block of all pairs; its stimuli need not be built. Whole studies are
    simulated under assumed scores, and analysed as `report` does.
    """
    from runner.reports.power import study_power

    if as_json and str(options.table) == "-":
        raise click.UsageError("Both --json and --csv - would go to the terminal.")

    def progress(done: int, of: int) -> None:
        step("Simulating studies", done, of)

    return study_power(experiment, options, progress, lambda line: say(f"note: {line}"))


@click.command(short_help="Repeat the thesis's second experiment with simulated observers.")
@click.option(
    "--observers", type=click.IntRange(1, 999), default=30, show_default=True, help="Number of simulated observers."
)
@click.option("--window", is_flag=True, help="Draw in a window that you can watch.")
@click.option(
    "--results",
    type=PATH,
    default=Path("results/demo"),
    show_default=True,
    help="Folder that the sessions are written to.",
)
@gives(indent=None)
def demo_command(observers: int, window: bool, results: Path, as_json: bool, step: Step) -> Any:
    """Repeat the thesis's second experiment with simulated observers.

    Builds ten stimuli from configs/stimuli/manitoba_gray.yaml, shows all 45 pairs in stereo to every simulated
    observer, who answers by the thesis's published scores (Table 4.4), records each answer, fits Bradley-Terry
    scores and perceptual classes, and writes a report. The classes are those of the default analysis; the thesis's
    settings stand beside it.
    """
    from dataclasses import asdict

    from analysis.report import report_blocks
    from runner.reports.demo import run_demo

    demo = run_demo(observers, results, window=window, progress=step)
    if not as_json:
        tell(report_blocks(demo.report, demo.published))
    scores = demo.report.pairs
    facts = {
        "scores": scores.to_json() if scores else None,
        "thesis_settings": demo.thesis.to_json(),
        "report": str(demo.page),
        "work": asdict(demo.work),
    }
    return facts, demo.told()
