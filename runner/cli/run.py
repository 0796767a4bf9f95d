"""`cyclopean run`: a session with a person, or with simulated observers."""

from __future__ import annotations

import json
from pathlib import Path

import click


@click.command(short_help="Run a session with an observer.")
@click.argument("experiment", type=click.Path(path_type=Path))
@click.option("--observer", required=True, help="The observer's code: letters and digits, such as 01.")
@click.option("--resume", is_flag=True, help="Go on exactly where this observer's last session stopped.")
@click.option(
    "--accept-changes",
    is_flag=True,
    help="With --resume or --replay: go on although experiment, stimuli or display changed; the record says so.",
)
@click.option("--results", type=click.Path(path_type=Path), default=Path("results"), show_default=True)
@click.option("--mode", help="A stereo mode in place of the rig's.")
@click.option("--windowed", is_flag=True, help="A window in place of the full screen.")
@click.option(
    "--simulate",
    type=click.Path(path_type=Path),
    help="A file of simulated observers that answer in place of a person, on a surface without a window.",
)
@click.option(
    "--replay",
    type=click.Path(path_type=Path),
    help="A session.jsonl whose presses are repeated in place of a person, on a surface without a window.",
)
@click.option(
    "--backend",
    type=click.Choice(["window", "egl", "null"]),
    help="Where to draw; 'window' for a person, 'egl' for a simulation.",
)
@click.option(
    "--allow-uncharacterised",
    is_flag=True,
    help="Borrow another mode's characterisation, and mark every record of it.",
)
@click.option("--json", "as_json", is_flag=True, help="Print what was done as JSON.")
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
    as_json: bool,
) -> None:
    """Run a session with an observer.

    EXPERIMENT is a file such as experiments/dynamic_range.yaml. Every answer is on disk before the next trial
    appears. The observer answers with the keys that the instructions name; Escape asks before leaving.
    """
    from analysis.records import Trial
    from runner.cli.main import WorkError
    from runner.cli.progress import build_stimuli, progress_bar
    from runner.observers.observer_file import read_observer
    from runner.observers.person import Person
    from runner.observers.replay import read_recording
    from runner.ports import WindowClosed
    from runner.protocol.experiment import check_observer, read_experiment
    from runner.session import Left
    from runner.session_folders import to_resume, unfinished
    from runner.station import Station

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
        click.echo(f"note: observer {observer} has an unfinished session; --resume would go on with it", err=True)
    total = sum(block.trials for block in design.blocks(observer))
    answered = 0
    folder: Path | None = None
    ending = "completed"
    with progress_bar(quiet=as_json) as step:
        stimuli = build_stimuli(design, step)
        backend = backend or ("egl" if law or recording else "window")
        with Station.open(design, stimuli, results, backend, windowed=windowed) as station:
            for remark in station.remarks:
                click.echo(f"warning: {remark}", err=True)
            sitting = Person(station.surface.wait_key, station.presenter.point)
            person = station.simulated(law, observer) if law else sitting

            def on_trial(trial: Trial) -> None:
                nonlocal answered
                answered += trial.kind not in ("instructions", "break")
                step(f"Observer {observer}", answered, total)

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
                    )
            except Left:
                ending = "left"
            except WindowClosed:
                ending = "window closed"
            except KeyboardInterrupt:
                ending = "interrupted"
            except OSError as error:
                raise WorkError(f"the session stopped: {error}; every answer before this is saved") from error
    done = {"ending": ending, "answered": answered, "trials": total, "folder": str(folder) if folder else None}
    if as_json:
        click.echo(json.dumps(done))
    elif ending == "completed":
        click.echo(f"{answered} answers are in {folder}\nScore them with: cyclopean report {folder}")
    else:
        click.echo(f"Stopped ({ending}) after {answered} of {total} answers, all saved. Go on with --resume.")
