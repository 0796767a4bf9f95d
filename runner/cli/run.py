"""`cyclopean run`: a session with a person, or with simulated observers."""

from __future__ import annotations

import json
from pathlib import Path

import click

from documents.text.words import counted


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
    help="Use another mode's characterisation if this mode has none; every record says so.",
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
    backend: str | None,
    allow_uncharacterised: bool,
    console: bool | None,
    as_json: bool,
) -> None:
    """Run a session with an observer.

    EXPERIMENT is a file such as experiments/dynamic_range.yaml. Every answer is on disk before the next trial
    appears. The observer answers with the keys that the instructions name; Escape opens a
    menu: go on, repeat, note, stop. Meanwhile the experimenter can type notes at the terminal, and 'r' to have the last
    trial asked again.
    """
    import sys
    import time
    from contextlib import ExitStack

    from analysis.records.session_record import Trial
    from runner.cli.console import Console, at_a_terminal
    from runner.cli.main import WorkError
    from runner.cli.progress import build_stimuli, progress_bar
    from runner.cli.session_status import SessionStatus
    from runner.observers.observer_file import read_observer
    from runner.observers.person import Person
    from runner.observers.replay import read_recording
    from runner.ports import WindowClosed
    from runner.protocol.experiment import check_observer, read_experiment
    from runner.session.folders import to_resume, unfinished
    from runner.session.session import Left, Session
    from runner.session.station import Station

    check_observer(observer)
    design = read_experiment(experiment, mode, allow_uncharacterised=allow_uncharacterised)
    if simulate and simulate.suffix == ".jsonl":
        simulate, replay = None, simulate
    if replay and (resume or simulate):
        raise click.UsageError("--replay goes neither with --resume nor with another --simulate")
    law = read_observer(simulate, design.stimulus_names, design.stimuli.reference) if simulate else None
    recording = read_recording(replay) if replay else None
    if resume:
        to_resume(results, design.spec.name, observer)
    elif unfinished(results, design.spec.name, observer):
        click.echo(
            f"note: observer {observer} has an unfinished session. To go on with it, stop this one before it asks "
            "anything, and give --resume",
            err=True,
        )
    folder: Path | None = None
    ending = "completed"
    backend = backend or ("egl" if law or recording else "window")
    if console is None:
        console = backend == "window" and not (law or recording) and at_a_terminal()
    with progress_bar(quiet=as_json) as step:
        stimuli = build_stimuli(design, step)
    with (
        progress_bar(quiet=as_json) as step,
        ExitStack() as terminal,
        Station.open(design, stimuli, results, backend, windowed=windowed) as station,
    ):
        for remark in station.remarks:
            click.echo(f"warning: {remark}", err=True)
        sitting = Person(station.surface.wait_key, station.presenter.point)
        person = station.simulated(law, observer) if law else sitting

        status = SessionStatus(
            design.blocks(observer),
            [block.kind for block in design.spec.blocks],
            time.monotonic,
            lambda: station.presenter.counters.frames_missed,
        )
        shown: Console | None = None

        def on_session(session: Session) -> None:
            nonlocal shown
            if console:
                shown = terminal.enter_context(Console(session, status.line, sys.stdin, sys.stderr))

        def on_trial(trial: Trial) -> None:
            status.hear(trial)
            if shown:
                shown.refresh()
            else:
                step(f"Observer {observer}", status.answered, status.trials)

        try:
            if recording:
                folder = station.replay(recording, observer, accept_changes=accept_changes, on_trial=on_trial)
            else:
                folder = station.run(
                    observer,
                    person,
                    simulated=law is not None,
                    resume=resume,
                    accept_changes=accept_changes,
                    on_trial=on_trial,
                    on_session=on_session,
                )
        except Left:
            ending = "left"
        except WindowClosed:
            ending = "window closed"
        except KeyboardInterrupt:
            ending = "interrupted"
        except OSError as error:
            raise WorkError(f"the session stopped: {error}; every answer before this is saved") from error
    answered, total = status.answered, status.trials
    done = {"ending": ending, "answered": answered, "trials": total, "folder": str(folder) if folder else None}
    if as_json:
        click.echo(json.dumps(done))
    elif ending == "completed" and folder:
        click.echo(
            f"{counted(answered, 'answer is', 'answers are')} in {folder}\n"
            f"Score all observers with: cyclopean report {folder.parents[1]}"
        )
    else:
        click.echo(
            f"Stopped ({ending}) after {answered} of {counted(total, 'answer', 'answers')}, all saved. Go on "
            "with --resume."
        )
