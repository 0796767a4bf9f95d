"""An experiment, with everything that a session of it needs."""

from __future__ import annotations

from documents import InputError, load_document
from runner.check.checked import Checked, Wishes
from runner.check.course import course
from runner.check.geometry import geometry
from runner.check.named_files import faults_of_named_files, missing_pictures
from runner.check.onsets import onsets
from runner.check.pictures import pictures
from runner.check.results_folder import look_at_results
from runner.check.screen import look
from runner.protocol.experiment import ExperimentSpec, read_experiment


def check(checked: Checked, wishes: Wishes) -> None:
    """Check an experiment file: the files it names, the pictures, the geometry, the blocks, the screen, the results."""
    try:
        design = read_experiment(checked.file)
    except InputError as error:
        more = [finding for finding in faults_of_named_files(checked.file) if finding not in error.findings]
        checked.errors += [*error.findings, *more]
        return
    _, source = load_document(checked.file, ExperimentSpec)
    checked.facts = {
        "kind": "experiment",
        "name": design.spec.name,
        "stimuli": len(design.stimulus_names),
        "mode": design.rig.mode,
        "crosstalk": "cancelled" if design.rig.crosstalk else "not measured",
    }
    course(checked, design, source)
    onsets(checked, design.rig)
    geometry(checked, design, source)
    checked.errors += missing_pictures(design.recipe_file)
    if not checked.errors and wishes.pictures:
        try:
            pictures(checked, design, source, wishes)
        except InputError as error:
            checked.errors += error.findings
    look(checked, design.rig, wishes)
    look_at_results(checked, design.spec.name, wishes.results)
