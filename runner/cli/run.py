"""`cyclopean run`: a session with a person, or with simulated observers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from documents.text.words import counted

if TYPE_CHECKING:
    from runner.session.run import Backend


@click.command(short_help="Run a session with an observer.")
@click.argument("experiment", type=click.Path(path_type=Path))
@click.option("--observer", required=True, help="Code of the observer: letters and digits, such as 01.")
@click.option("--resume", is_flag=True, help="Resume this observer's last session exactly where it stopped.")
@click.option(
    "--accept-changes",
    is_flag=True,
    help="With --resume or --replay: continue although experiment, stimuli or display changed.",
)
@click.option(
    "--results",
    type=click.Path(path_type=Path),
    default=Path("results"),
    show_default=True,
    help="Folder that the sessions are written to.",
)
@click.option("--mode", help="Stereo mode to use instead of the rig's.")
@click.option("--windowed", is_flag=True, help="Use a window instead of the full screen.")
@click.option(
    "--simulate",
    type=click.Path(path_type=Path),
    help="File of simulated observers who answer instead of a person, without a window.",
)
@click.option(
    "--replay",
    type=click.Path(path_type=Path),
    help="Recorded session.jsonl whose key presses are repeated, without a window.",
)
@click.option(
    "--backend",
    type=click.Choice(["window", "egl", "null"]),
    help="Where to draw: 'window' for a person, 'egl' for a simulation.",
)
@click.option(
    "--allow-uncharacterised",
    is_flag=True,
    help="Use another mode's characterisation if this mode has none; every record states it.",
)
@click.option(
    "--console/--no-console",
    default=None,
    help="Take notes and marks in this terminal during the session. Default: if a person answers.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    experiment: Path,
    observer: str,
    resume: bool,
    accept_changes: bool,
    results: Path,
    mode: str | None,
    windowed: bool,
    simulate: Path | None,
    replay: Path | None,
    backend: Backend | None,
    allow_uncharacterised: bool,
    console: bool | None,
    as_json: bool,
) -> None:
    """Run a session with an observer.

    EXPERIMENT is a file such as experiments/dynamic_range.yaml. Every answer is on disk before the next trial
    appears. The observer answers with the keys that the instructions name; Escape opens a menu: continue, repeat, note,
    stop. Meanwhile the experimenter can type notes at the terminal, and 'r' to have the last trial asked again.
    """
    import sys
    from contextlib import ExitStack

    from runner.cli.console import Console, at_a_terminal
    from runner.cli.main import WorkError
    from runner.cli.progress import progress_bar
    from runner.errors import SessionStoppedError
    from runner.session.run import SessionOptions, run_session
    from runner.session.session import Session
    from runner.session.status import SessionStatus

    if simulate and simulate.suffix == ".jsonl":
        simulate, replay = None, simulate
    if replay and (resume or simulate):
        raise click.UsageError("--replay goes neither with --resume nor with another --simulate")
    of_a_person = not (simulate or replay)
    if console is None:
        console = of_a_person and backend in (None, "window") and at_a_terminal()
    shown: Console | None = None
    with ExitStack() as terminal:
        step = terminal.enter_context(progress_bar(quiet=as_json))

        def on_begin(session: Session, status: SessionStatus) -> None:
            nonlocal shown
            if console and not replay:
                shown = terminal.enter_context(Console(session, status.line, sys.stdin, sys.stderr))

        def on_trial(status: SessionStatus) -> None:
            if shown:
                shown.refresh()
            else:
                step(f"Observer {observer}", status.answered, status.trials)

        options = SessionOptions(
            results=results,
            resume=resume,
            accept_changes=accept_changes,
            mode=mode,
            allow_uncharacterised=allow_uncharacterised,
            backend=backend,
            windowed=windowed,
            simulate=simulate,
            replay=replay,
            progress=step,
            notify=lambda line: click.echo(line, err=True),
            on_begin=on_begin,
            on_trial=on_trial,
        )
        try:
            done = run_session(experiment, observer, options)
        except SessionStoppedError as error:
            raise WorkError(str(error)) from error
    if as_json:
        click.echo(json.dumps(done.to_json()))
    elif done.ending == "completed" and done.folder:
        click.echo(
            f"{counted(done.answered, 'answer is', 'answers are')} in {done.folder}\n"
            f"Score all observers with: cyclopean report {done.folder.parents[1]}"
        )
    else:
        click.echo(
            f"Stopped ({done.ending}) after {done.answered} of {counted(done.trials, 'answer', 'answers')}, all saved. "
            "To resume the session, give --resume."
        )
