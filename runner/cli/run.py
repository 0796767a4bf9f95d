"""`cyclopean run`: a session with a person, or with simulated observers."""

from __future__ import annotations

import json
import sys
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from documents.text import counted, own_stream, say
from runner.cli.console import Console, at_a_terminal
from runner.cli.options import takes
from runner.session.options import SessionOptions

if TYPE_CHECKING:
    from runner.session.events import Event
    from runner.session.options import SessionResult
    from runner.session.picture_source import Progress
    from runner.session.status import SessionStatus


@click.command(short_help="Run a session with an observer.")
@click.argument("experiment", type=click.Path(path_type=Path))
@click.option("--observer", required=True, help="Code of the observer: letters and digits, such as 01.")
@takes(SessionOptions, leave_out={"progress", "notify", "listeners"})
@click.option(
    "--console/--no-console",
    default=None,
    help="Take notes and marks in this terminal during the session. Default: if a person answers.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(
    experiment: Path,
    observer: str,
    console: bool | None,
    as_json: bool,
    options: SessionOptions,
) -> None:
    """Run a session with an observer.

    EXPERIMENT is a file such as experiments/dynamic_range.yaml. Every answer is on disk before the next trial
    appears. The observer answers with the keys that the instructions name; Escape opens a menu: continue, repeat, note,
    stop. Meanwhile the experimenter can type notes at the terminal, and 'r' to have the last trial asked again.

    Exit status: 0 if the session is complete, also where a failed vision test ended it; 1 if it was stopped, closed,
    interrupted or failed, with the command that continues it; 2 if the input was wrong.
    """
    from runner.cli.output import progress_bar
    from runner.errors import UsedCodeError
    from runner.session.options import session_command
    from runner.session.run import run_session
    from runner.session.status import SessionStatus

    if options.simulate and Path(options.simulate).suffix == ".jsonl":
        options = replace(options, simulate=None, replay=options.simulate)
    if console is None:
        console = options.of_a_person and options.backend in (None, "window") and at_a_terminal()
    with ExitStack() as terminal:
        step = terminal.enter_context(progress_bar(quiet=as_json))
        shown = _Shown(observer, terminal, step, console and not options.replay, SessionStatus())
        options = replace(options, progress=step, notify=lambda line: click.echo(line, err=True), listeners=(shown,))
        try:
            done = run_session(experiment, observer, options)
        except UsedCodeError as error:
            if not options.of_a_person or as_json or not at_a_terminal():
                raise
            click.echo(error.what, err=True)
            if not click.confirm("Is this the same person, who sits once more?", err=True):
                raise
            options = replace(options, again=True)
            done = run_session(experiment, observer, options)
    begun = bool(shown.status.blocks)
    completed = done.ending == "completed" and done.folder is not None
    if as_json:
        click.echo(json.dumps(done.to_json()))
    elif completed and done.folder:
        click.echo(
            f"{counted(done.answered, 'answer is', 'answers are')} in {done.folder}\n"
            f"Score all observers with: cyclopean report {done.folder.parents[1]}"
        )
    else:
        saved = f"{done.answered} of {counted(done.trials, 'answer', 'answers')} saved"
        typed = session_command(
            experiment,
            observer,
            options,
            resume=begun,
            new=options.new and not begun,
            again=options.again and not begun,
        )
        more = "The recording ends here" if options.replay else f"{'Continue' if begun else 'Begin again'}: {typed}"
        click.echo(f"{_ENDINGS[done.ending]}; {saved}. {more}")
    if not as_json:
        _say_what_vision_failed(observer, done)
    if done.doubt:
        click.echo(f"warning: {done.doubt}", err=True)
    if not completed and not (options.replay and done.ending == "window closed"):
        sys.exit(1)


@dataclass(slots=True)
class _Shown:
    """Shows where the session stands after each answer: on the experimenter's line if ``has_console``, or by a bar."""

    observer: str
    terminal: ExitStack
    step: Progress
    has_console: bool
    status: SessionStatus
    console: Console | None = None

    def hear(self, event: Event) -> None:
        from analysis.kinds import Trial
        from analysis.records import WindowEvent
        from runner.session.events import Recorded, Replayed, SessionBegan

        self.status.hear(event)
        match event:
            case SessionBegan(session) if self.has_console:
                lines = Console(session, self.status.line, sys.stdin, own_stream(sys.stderr))
                self.console = self.terminal.enter_context(lines)
            case Recorded(Trial() | WindowEvent()) | Replayed(left=0):
                if self.console:
                    self.console.refresh()
                else:
                    self.step(f"Observer {self.observer}", self.status.answered, self.status.trials)


_ENDINGS = {
    "left": "Stopped by the observer",
    "window closed": "The window was closed",
    "interrupted": "Interrupted by Ctrl-C",
    "terminated": "Ended by a signal",
}


def _say_what_vision_failed(observer: str, done: SessionResult) -> None:
    """Print which vision tests the observer failed, what that means, and what to type."""
    for outcome in done.failed_tests:
        say((f"Observer {observer} failed a vision test: {outcome.words}.", "bold"))
    if not done.failed_tests:
        return
    click.echo("It is a screen, no diagnosis: advise the observer at most to see an optometrist.")
    if done.screened_out:
        click.echo("The session ended there, as the experiment says (on_fail: stop), and is complete.")
    tests = " ".join(f"--passed {outcome.test}" for outcome in done.failed_tests)
    click.echo(f"A report includes the answers and names the observer; to leave them out, add {tests} to `report`.")
