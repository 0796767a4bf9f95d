"""Check an experiment's pictures, built for its display: what of them cannot be shown, and what that costs."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

from devices.compensation import NOTICED_DELTA_E_00
from documents.text import counted
from documents.yaml import YamlSource
from runner.check.error_budget import picture_budget
from runner.check.report import CheckOptions, CheckReport
from runner.protocol.experiment import Experiment
from runner.session.clipping_costs import ClippingCosts
from runner.session.earlier import changed_since_earlier
from runner.session.picture_source import build_stimuli
from runner.views.layout import SIZES_DIFFER, size_ratio
from stimuli.build import StimulusSet

# A share of a picture's area: an odd pixel at its edge is nothing to warn of.
LEAST_SEEN = 0.9


def check_pictures(report: CheckReport, design: Experiment, source: YamlSource, options: CheckOptions) -> None:
    """Build the stimuli, unless they are in the cache, and report what gamut clipping costs for each eye."""
    stimuli = build_stimuli(design, options.progress)
    if unequal := _unequal_views(design, stimuli):
        report.errors.append(source.finding(("rig",), *unequal))
        return
    load = partial(stimuli.load, part=design.visible_part)
    costs = ClippingCosts.of(design, stimuli, load)
    clipping = {}
    for done, name in enumerate(stimuli.names, start=1):
        clipping[name] = costs.description(name)["clipping"]
        options.progress("Looking at stimuli", done, len(stimuli.names))
    report.facts["pictures_rendered"] = stimuli.rendered
    report.facts.update(asdict(costs.work))
    report.facts["clipped_percent"] = _per_eye(clipping, "percent_any")
    report.facts["clip_limit_percent"] = options.clip_limit_percent
    report.facts["clipping_cost_mean_delta_e_00"] = _per_eye(clipping, "delta_e_00_mean")
    if design.mode.mixture(design.rig.models) is not None:
        report.facts["filters_cost_mean_delta_e_00"] = _per_eye(clipping, "projection_delta_e_00_mean")
        report.facts["filters_cost_max_delta_e_00"] = _per_eye(clipping, "projection_delta_e_00_max")
        _filters(report, source)
    if options.budget:
        pictures = (load(name) for name in stimuli.names)
        budget = picture_budget(design.rig, costs.compensation, pictures, design.places_px)
        report.facts["error_budget"] = budget.to_json()
    ghosts = {name: costs["crosstalk"] for name, costs in clipping.items() if "crosstalk" in costs}
    if ghosts:
        short = _per_eye(ghosts, "percent_above_full")
        report.facts["ghost_percent"] = {
            name: [max(both) for both in zip(eyes, short[name], strict=True)]
            for name, eyes in _per_eye(ghosts, "percent_negative").items()
        }
        report.facts["ghost_cost_max_delta_e_00"] = _per_eye(ghosts, "delta_e_00_max")
        _ghosts(report, design, source)
    worst = _worst(report.facts["clipped_percent"])
    over = [name for name, percent in worst.items() if percent > options.clip_limit_percent]
    for share, most in _among(over, worst):
        what = (
            f"more than {options.clip_limit_percent:g} % of an eye's pixels are outside the gamut in {share}; most in "
        )
        what += f"'{most}', {worst[most]:.2f} %"
        remedy = "`cyclopean preview --clipping` marks them; scale the luminance down, or accept it"
        report.warnings.append(source.finding(("stimuli",), what, remedy))
    _sizes(report, design, source, stimuli)
    since = changed_since_earlier(design, stimuli, options.results, report.warnings.append, simulated=False)
    (report.warnings if options.accept_changes else report.errors).extend(each.finding for each in since)
    if design.rig.gain_map:
        what = f"the gain map costs {100 * design.rig.gain_map.luminance_lost:.1f} % of the luminance"
        report.warnings.append(source.finding(("rig",), what))


def _unequal_views(design: Experiment, stimuli: StimulusSet) -> tuple[str, str] | None:
    """Return that stereo pictures are to be shown in a mode in which both eyes see the same pixels, and a remedy."""
    areas = design.mode.areas(design.rig.display.panel.resolution_px)
    mixed = design.mode.mixture(design.rig.models) is not None
    if mixed or not any(len(area.eyes) > 1 for area in areas):
        return None
    stereo = [name for name in stimuli.names if not stimuli.entry(name)["flat"]]
    if not stereo:
        return None
    what = (
        f"{counted(len(stereo), 'stimulus has', 'stimuli have')} a view for each eye: {_some(stereo)}; the mode "
        f"'{design.rig.mode}' shows both eyes the same pixels"
    )
    return what, "choose a stereo mode in the rig, or with --mode, or show flat pictures"


def _ghosts(report: CheckReport, design: Experiment, source: YamlSource) -> None:
    """Warn of pictures that keep a ghost of the other eye's, where crosstalk cannot be cancelled."""
    percents, costs = (_worst(report.facts[key]) for key in ("ghost_percent", "ghost_cost_max_delta_e_00"))
    kept = [name for name, cost in costs.items() if percents[name] > 0.0 and cost >= NOTICED_DELTA_E_00]
    for share, most in _among(kept, percents):
        what = (
            f"crosstalk cannot be cancelled everywhere in {share}; most in '{most}', where {percents[most]:.2f} % of "
        )
        what += f"an eye's pixels keep a ghost of the other's, and ΔE00 is at most {costs[most]:.1f}"
        models, can_lift = design.rig.models, not design.rig.spec.lift_black
        can_lift = can_lift and models.left.additive and models.right.additive
        remedy = "write lift_black: true in the rig file, or accept it" if can_lift else ""
        report.warnings.append(source.finding(("stimuli",), what, remedy))


def _filters(report: CheckReport, source: YamlSource) -> None:
    """Warn of pictures that differ, through an anaglyph's filters, so much that an eye notices it on the whole."""
    keys = "filters_cost_mean_delta_e_00", "filters_cost_max_delta_e_00"
    means, largest = (_worst(report.facts[key]) for key in keys)
    for share, most in _among([name for name, mean in means.items() if mean >= NOTICED_DELTA_E_00], means):
        what = "through the anaglyph's filters, pictures differ from what was asked by a mean ΔE00 of "
        what += f"{NOTICED_DELTA_E_00:g} or more in {share}; most in '{most}', by {means[most]:.1f} on average and "
        what += f"{largest[most]:.0f} at most"
        remedy = "choose a mode that gives each eye its own colours (`cyclopean doctor` lists them), or accept it"
        report.warnings.append(source.finding(("stimuli",), what, remedy))


def _worst(per_eye: Mapping[str, Sequence[float]]) -> dict[str, float]:
    return {name: max(eyes) for name, eyes in per_eye.items()}


def _among(names: Collection[str], of: Mapping[str, float]) -> Iterator[tuple[str, str]]:
    """Yield once, if there are any, how many of all stimuli these are, with names, and the one of the largest value."""
    if names:
        share = f"{len(names)} of {counted(len(of), 'stimulus', 'stimuli')}: {_some(names)}"
        yield share, max(names, key=of.__getitem__)


def _sizes(report: CheckReport, design: Experiment, source: YamlSource, stimuli: StimulusSet) -> None:
    aperture = design.aperture_px
    small = [name for name in stimuli.names if any(a < b for a, b in zip(stimuli.size_px(name), aperture, strict=True))]
    if small:
        what = (
            f"{counted(len(small), 'stimulus is', 'stimuli are')} smaller than the aperture of {aperture[0]} x "
            f"{aperture[1]} px: {_some(small)}"
        )
        remedy = "black will surround them; make size_mm smaller, or the pictures larger"
        report.warnings.append(source.finding(("layout", "size_mm"), what, remedy))
    _one_size(report, design, source, stimuli)
    seen = {name: _seen_share(stimuli.size_px(name), aperture) for name in stimuli.names}
    cut = {name: share for name, share in seen.items() if share < LEAST_SEEN}
    if cut:
        least = min(cut, key=lambda name: cut[name])
        what = (
            f"the aperture of {aperture[0]} x {aperture[1]} px shows the middle alone of "
            f"{counted(len(cut), 'stimulus', 'stimuli')}: "
            f"{_some(cut)}; least of '{least}', {100 * cut[least]:.0f} % of its area"
        )
        remedy = "make size_mm larger, resample the pictures, or accept it"
        report.warnings.append(source.finding(("layout", "size_mm"), what, remedy))


def _one_size(report: CheckReport, design: Experiment, source: YamlSource, stimuli: StimulusSet) -> None:
    """Warn of pictures that are compared and differ in size: size goes with content, and may be what is judged."""
    groups: dict[object, dict[str, tuple[int, int]]] = {}
    factors = {getattr(spec, "within", None) for spec in design.spec.blocks if hasattr(spec, "within")}
    within = next(iter(factors)) if len(factors) == 1 else None
    for name in stimuli.names:
        width, height = (min(both) for both in zip(stimuli.size_px(name), design.aperture_px, strict=True))
        group = design.stimuli.factors[name].get(within) if within else None
        groups.setdefault(group, {})[name] = width, height
    sizes = max(groups.values(), key=lambda sizes: size_ratio(list(sizes.values())))
    ratio = size_ratio(list(sizes.values()))
    report.facts["size_ratio"] = round(ratio, 3)
    if ratio > SIZES_DIFFER:
        large, small = (pick(sizes, key=lambda name: math.prod(sizes[name])) for pick in (max, min))
        what = (
            f"pictures that are compared differ in size on the screen: '{large}' is {ratio:.2f} times as long as "
            f"'{small}'. Size goes with content: observers may judge it"
        )
        remedy = "bring them to one size by resample in the recipe (`cyclopean new --fit` does), or accept it"
        report.warnings.append(source.finding(("stimuli",), what, remedy))


def _seen_share(size_px: tuple[int, int], aperture_px: tuple[int, int]) -> float:
    """Return how much of a picture's area its aperture leaves to see."""
    shares = [min(a / b, 1.0) for a, b in zip(aperture_px, size_px, strict=True)]
    return shares[0] * shares[1]


def _some(names: Any) -> str:
    listed = list(names)
    return ", ".join(listed[:5]) + (f" and {len(listed) - 5} more" if len(listed) > 5 else "")


def _per_eye(clipping: Mapping[str, Mapping[str, Any]], key: str) -> dict[str, list[float]]:
    return {name: [eyes["left"][key], eyes["right"][key]] for name, eyes in clipping.items()}
