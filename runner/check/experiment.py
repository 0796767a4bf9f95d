"""Check an experiment: the files it names, its blocks, its geometry, and the place where it will run."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

import analysis
from devices.display import (
    CYCLES_PER_DEGREE,
    pixels_per_degree,
    read_rig,
    visual_angle_deg,
)
from documents import Finding, InputError, load_document
from documents.files import beside, read_regular, sha256_of_json
from documents.yaml import YamlSource, read_yaml
from runner.blocks.block import Block
from runner.blocks.message import pause_menu
from runner.blocks.text_entry import typed
from runner.check.display_facts import check_display_facts
from runner.check.error_budget import rig_budget
from runner.check.machine import check_pool, check_results, check_rig_parts, check_screen
from runner.check.pictures import check_pictures
from runner.check.report import CheckOptions, CheckReport
from runner.check.screens import check_screens
from runner.errors import SessionError
from runner.ports import Ask
from runner.presenter.surfaces.screens import primary_monitor
from runner.protocol.experiment import AnalysisSpec, Experiment, ExperimentSpec, doubts, read_experiment
from runner.scene import Scene
from runner.session.clipping_costs import CostCache
from runner.views.pages import CONTINUE_KEYS
from stimuli.build import cache_folder
from stimuli.recipes import faults_of_inputs, read_recipe

# ITU-R BT.500: a session should last up to half an hour.
LONG_MINUTES = 30.0
# Eyes turn by some 30° to either side before the head follows; a picture that fills a screen covers 40°.
WIDEST_DEG = 60.0
NARROWEST_DEG = 0.2


def check_experiment(report: CheckReport, options: CheckOptions) -> None:
    """Check an experiment file: the files it names, its blocks and pictures, the screen and the results folder."""
    try:
        design = read_experiment(
            report.file,
            options.mode,
            allow_uncharacterised=options.allow_uncharacterised,
            monitors=options.monitors,
        )
    except InputError as error:
        named = faults_of_named_files(report.file, options)
        more = [finding for finding in named if finding not in error.findings]
        report.errors.extend([*error.findings, *more])
        return
    _, source = load_document(report.file, ExperimentSpec)
    report.facts.update(
        {
            "kind": "experiment",
            "name": design.spec.name,
            "stimuli": len(design.stimulus_names),
            "mode": design.rig.mode,
            "crosstalk": "cancelled" if design.rig.crosstalk else "not measured",
        }
    )
    report.errors.extend(design.name_clashes)
    check_blocks(report, design, source)
    if options.observers:
        check_power(report, design, source, options)
    check_screens(report, design, source)
    check_display_facts(report, design.rig)
    check_geometry(report, design, source)
    report.errors.extend(missing_pictures(design.recipe_file))
    if not report.errors and options.pictures:
        try:
            check_pictures(report, design, source, options)
        except InputError as error:
            report.errors.extend(error.findings)
    if options.budget and "error_budget" not in report.facts:
        report.facts["error_budget"] = rig_budget(design.rig).to_json()
    check_screen(report, design.rig, options)
    check_rig_parts(report, design.rig, options)
    check_results(report, design.spec.name, options.results)
    check_pool(report, design, options.results)


def faults_of_named_files(experiment_file: Path, options: CheckOptions) -> list[Finding]:
    """Return the faults of the rig and the recipe that ``experiment_file``, which may be wrong itself, names."""
    data = read_yaml(experiment_file).data
    findings: list[Finding] = []
    for key, faults in (("rig", partial(_rig_faults, options)), ("stimuli", missing_pictures)):
        name = data.get(key) if isinstance(data, dict) else None
        if isinstance(name, str) and os.path.isfile(named := beside(experiment_file, name)):
            findings += faults(named)
    return findings


def missing_pictures(recipe_file: Path) -> list[Finding]:
    """Return the faults of a recipe, and of the files it names: those that are not there, and a wrong camera file."""
    try:
        recipe, source = read_recipe(recipe_file)
    except InputError as error:
        return list(error.findings)
    findings = faults_of_inputs(recipe, source, recipe_file.parent)
    return findings or recipe.file_findings(recipe_file.parent)


def _rig_faults(options: CheckOptions, file: Path) -> list[Finding]:
    try:
        read_rig(file, options.mode, allow_uncharacterised=options.allow_uncharacterised, ask_monitor=primary_monitor)
    except InputError as error:
        return list(error.findings)
    return []


def check_blocks(report: CheckReport, design: Experiment, source: YamlSource) -> None:
    """Report the number of trials, their time and what the keys do, for each block and in total."""
    blocks, pressed = design.example_blocks, partial(_pressed, design)
    minutes = sum(block.expected_s for block in blocks) / 60
    report.facts["trials"] = sum(block.trials for block in blocks)
    report.facts["minutes"] = round(minutes, 1)
    report.facts["blocks"] = [_block(block, pressed) for block in blocks]
    report.facts["keys"] = keys_of(design)
    if minutes > LONG_MINUTES:
        what = f"a session takes about {minutes:.0f} minutes, and ITU-R BT.500 has half an hour at most"
        report.warnings.append(source.finding(("blocks",), what, "split it, or let observers rest"))
    report.warnings.extend(source.finding(doubt.path, doubt.message, doubt.remedy) for doubt in doubts(design))
    if not report.facts["trials"]:
        what = "no block asks anything that is scored"
        report.warnings.append(source.finding(("blocks",), what, "add a block such as all_pairs"))


def check_power(report: CheckReport, design: Experiment, source: YamlSource, options: CheckOptions) -> None:
    """Report the smallest difference that the pairs find with each number of observers; warn where none finds one.

    Of pairs within groups it is that of the group with most stimuli. Nothing is said where no block compares all pairs,
    or pairs are chosen by the answers.
    """
    from runner.reports.designs import pair_design

    try:
        pairs = pair_design(design)
    except SessionError:
        return
    name, members = max(pairs.groups, key=lambda group: len(group[1]), default=("", range(len(pairs.items))))
    times = pairs.times[..., pairs.pairs_within(members)]
    found = []
    for done, observers in enumerate(options.observers, start=1):
        if one := _smallest(times, observers, name, design.spec.analysis):
            found.append(one)
        options.progress("Simulating studies", done, len(options.observers))
    report.facts["smallest_difference"] = found
    if len(options.observers) == 1 or all(one["nats"] is None for one in found):
        place = "blocks", next(index for index, block in enumerate(design.spec.blocks) if block.kind == "all_pairs")
        remedy = f"plan for more observers: 'cyclopean power {report.file}' says how many"
        report.warnings.extend(source.finding(place, words, remedy) for one in found[-1:] for words in one["warnings"])


def _smallest(times: NDArray[np.int64], observers: int, group: str, tests: AnalysisSpec) -> Mapping[str, Any] | None:
    """Return the smallest difference that a design finds, as JSON has it; from the cache, where it was found before."""
    asked = {"alpha": tests.alpha, "adjust": tests.adjust, "covariance": tests.covariance}
    design = {"times": sha256_of_json(times.tolist()), "observers": observers, "group": group}
    kept, depends_on = CostCache(cache_folder() / "power"), {**design, **asked, "code": _code_of_analysis()}
    if (before := kept.find(depends_on)) is not None:
        return cast("Mapping[str, Any] | None", before["found"])
    # SciPy and the simulation take 0.2 s to import, which no other check needs.
    from analysis.simulation import smallest_difference

    one = smallest_difference(times, observers, alpha=tests.alpha, adjust=tests.adjust, covariance=tests.covariance)
    found = None if one is None else replace(one, group=group).to_json()
    kept.keep(depends_on, {"found": found})
    return found


MOST_CODE_BYTES = 10_000_000


@cache
def _code_of_analysis() -> str:
    """Return a digest of the code of the analysis: simulated studies depend on all of it."""
    files = sorted(Path(analysis.__file__).parent.rglob("*.py"))
    return sha256(b"".join(read_regular(file, MOST_CODE_BYTES) for file in files)).hexdigest()


def _pressed(design: Experiment, keys: Mapping[str, str]) -> Mapping[str, str]:
    """Return ``keys`` as the experiment has them pressed."""
    return design.style.interface.listening(Ask(Scene(), keys)).keys


def keys_of(design: Experiment) -> dict[str, str]:
    """Return what is pressed in an experiment, the pause's menu and a note, on every keyboard, with what it means."""
    pressed = partial(_pressed, design)
    everywhere = {**pressed({"space": "continue"}), "escape": "pause"}
    found = {key: what for block in design.example_blocks for key, what in pressed(block.keys).items()} | everywhere
    note = next(typed("", design.style, required=False))
    for ask, where in ((pause_menu(design.style, can_repeat=True), "the pause's menu"), (note, "a note")):
        for key, what in design.style.interface.listening(ask).keys.items():
            if key != "escape":
                found[key] = "; ".join([*filter(None, [found.get(key)]), f"{what} in {where}"])
    return found


def _block(block: Block, pressed: Callable[[Mapping[str, str]], Mapping[str, str]]) -> dict[str, Any]:
    return {
        "kind": block.entry.kind,
        "trials": block.trials,
        "minutes": round(block.expected_s / 60, 2),
        "keys": dict(pressed(block.keys or ({} if block.trials else dict.fromkeys(CONTINUE_KEYS, "continue")))),
        **_particulars(block),
    }


def _particulars(block: Block) -> Mapping[str, Any]:
    """Return what several kinds of blocks have: repeats, breaks, ties, catch trials, scales."""
    facts: dict[str, Any] = {}
    repeats, every = getattr(block.entry, "repeats", 1), getattr(block.entry, "break_every", None)
    if repeats != 1:
        facts["repeats"] = repeats
    if every:
        facts["breaks"] = max(0, (block.trials - 1) // every)
    ties = getattr(block.entry, "ties", "none")
    if isinstance(ties, str) and ties != "none":
        facts["ties"] = ties
    return {**facts, **block.facts, **({"ratings": list(block.scale_ends)} if block.scale_ends else {})}


def check_geometry(report: CheckReport, design: Experiment, source: YamlSource) -> None:
    """Report what angle a picture covers and how many pixels there are in a degree; warn of extremes."""
    distance_mm = design.rig.spec.distance_mm
    angle = [round(float(visual_angle_deg(size, distance_mm)), 2) for size in design.spec.layout.size_mm]
    density = pixels_per_degree(design.rig.display.panel.pixel_pitch_mm, distance_mm)
    report.facts["picture_deg"] = angle
    report.facts["picture_px"] = list(design.aperture_px)
    report.facts["pixels_per_degree"] = round(density, 2)
    if max(angle) > WIDEST_DEG:
        what = f"a picture covers {max(angle):.1f}°, more than is looked at without turning the head"
        remedy = "make size_mm smaller, or sit further away; sizes and distances are in millimetres"
        report.warnings.append(source.finding(("layout", "size_mm"), what, remedy))
    if max(angle) < NARROWEST_DEG:
        what = f"a picture covers {max(angle):g}° only"
        remedy = "sizes and distances are in millimetres"
        report.warnings.append(source.finding(("layout", "size_mm"), what, remedy))
    if density < 2 * CYCLES_PER_DEGREE:
        what = (
            f"single pixels may be visible: the screen has {density:.1f} pixels per degree, and the eye resolves "
            f"{2 * CYCLES_PER_DEGREE:.0f} ({CYCLES_PER_DEGREE:.0f} cycles per degree)"
        )
        further_mm = distance_mm * 2 * CYCLES_PER_DEGREE / density
        remedy = f"sit {further_mm / 10:.0f} cm or more from this screen, or use one with finer pixels"
        report.warnings.append(source.finding(("rig",), what, remedy))
