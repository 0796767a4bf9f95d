"""How a session was made: the header of its log, and what must not change before it is resumed."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import platform
import re
import secrets
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from analysis.records import Header, SessionLog, Version, new_header
from documents import Finding, InputError
from documents.extensions import version_of
from documents.files import read_regular, sha256_of_file, write_whole
from documents.fonts import font_name, other_fonts
from documents.platform import state_folder
from runner.errors import SessionError
from runner.observers.presses import changes
from runner.session.clocks import SteadyClock
from runner.session.events import LISTENERS

if TYPE_CHECKING:  # `software` is all that many want of this module
    import numpy as np
    from numpy.typing import NDArray

    from devices.display import DisplayModel, Rig
    from runner.blocks.block import Block
    from runner.protocol.experiment import Experiment
    from stimuli.build import StimulusSet

    Floats = NDArray[np.float64]

_NOTABLE = ("cyclopean", "numpy", "moderngl", "glfw", "OpenImageIO", "scipy")


def _digest(value: object) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()


def _display_digest(rig: Rig) -> str:
    models = rig.models
    numbers: list[object] = [model.numbers for model in (models.left, models.right)]
    ambient = [model.ambient_XYZ_cd_m2.tolist() for model in (models.left, models.right)]
    if any(map(any, ambient)):
        numbers.append({"ambient_XYZ_cd_m2": ambient})
    if rig.crosstalk:
        numbers += [rig.crosstalk.left.tolist(), rig.crosstalk.right.tolist()]
    for eye, table in rig.display.gamma_tables.get(rig.characterised_as, {}).items():
        numbers += [eye, table.sha256] if table.known else []
    if rig.nominal:
        numbers.append({"nominal": rig.nominal.kind, "black_cd_m2": rig.nominal.black_cd_m2})
    if rig.gain_map:
        numbers += [rig.gain_map.luminance.tolist(), rig.gain_map.positions, rig.gain_map.normalise]
    return _digest(numbers)


def _rig_digest(rig: Rig) -> str:
    panel = rig.display.panel.model_dump(mode="json")
    viewing = [rig.spec.distance_mm, rig.spec.interpupillary_distance_mm, rig.spec.glasses]
    gamma_table = [rig.spec.gamma_table] if rig.spec.gamma_table else []
    settings = [rig.spec.monitor_settings.stated] if rig.spec.monitor_settings else []
    stated = [*gamma_table, *settings]
    return _digest(
        [rig.mode, dict(rig.spec.mode_options), rig.spec.lift_black, rig.spec.dither, *viewing, panel, *stated]
    )


def hashes(experiment: Experiment, stimuli: StimulusSet) -> dict[str, str]:
    """Return the SHA-256 of everything that determines what an observer is asked."""
    own_font = {"font": sha256_of_file(experiment.font)} if experiment.font else {}
    return {
        "experiment": experiment.digest,
        "stimuli": stimuli.digest,
        "display": _display_digest(experiment.rig),
        "rig": _rig_digest(experiment.rig),
        **own_font,
    }


@cache
def software() -> dict[str, str]:
    """Return the versions of the program and of the libraries it uses, as they were when first asked for."""
    versions = {name: importlib.metadata.version(name) for name in _NOTABLE}
    versions |= {"python": platform.python_version(), "system": platform.platform()}
    return versions | ({"commit": commit} if (commit := _commit()) else {})


def _commit() -> str | None:
    """Return the commit of this checkout; an installed package may lie in a repository of somebody else's."""
    root = Path(__file__).parents[2]
    if not (root / ".git").exists():
        return None
    command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=12"]
    try:
        result = subprocess.run(command, capture_output=True, encoding="utf-8", errors="replace", timeout=5)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return result.stdout.strip() if result.returncode == 0 else None


def station() -> str:
    """Return the random name of this user's account on this machine, made when first needed.

    It says nothing of who or where, only which sessions were recorded on one station. Empty where it cannot be kept.
    """
    file = state_folder() / "station"
    try:
        if not (known := _station(file)):
            write_whole(file, f"{secrets.token_hex(4)}\n")
            known = _station(file)  # that of another process that began at the same time, if there was one
        return known
    except OSError:
        return ""


def _station(file: Path) -> str:
    try:
        text = read_regular(file, 100).decode("ascii", "replace").strip()
    except InputError:
        return ""
    return text if re.fullmatch("[0-9a-f]{8}", text) else ""


def make_header(
    experiment: Experiment,
    stimuli: StimulusSet,
    observer: str,
    session: str,
    descriptions: tuple[Mapping[str, Any], ...],
    presentation: Mapping[str, Any],
    *,
    simulated: bool,
    remarks: tuple[str, ...] = (),
    started_utc: str | None = None,
    configuration: str = "",
    listen: Sequence[str] = (),
    **drawn: Any,
) -> Header:
    """Return the header of a session that begins now, or at ``started_utc`` by the session's own clock.

    ``configuration`` is the SHA-256 of the files that are kept beside it; ``listen`` names listeners of other packages;
    ``drawn`` are further fields.
    """
    from devices.timing_marks import MARKS
    from runner.blocks.registry import BLOCKS

    rig = experiment.rig
    panel = rig.display.panel
    kinds = {block.kind for block in experiment.spec.blocks}
    offers = {kind: offer for kind in sorted(kinds) if (offer := BLOCKS.offer(kind))}
    marks = (MARKS.offer(entry.kind) for entry in rig.marks)
    others = [*offers.values(), *filter(None, [*map(LISTENERS.offer, listen), *marks])]
    return new_header(
        experiment.spec.name,
        observer,
        session,
        started_utc or SteadyClock()(),
        seed=experiment.spec.seed,
        question=experiment.spec.question,
        simulated=simulated,
        stimuli=descriptions,
        display={
            "file": Path(rig.display.file).name,
            "mode": rig.mode,
            "characterised_as": rig.characterised_as,
            **({"nominal": rig.nominal.to_json()} if rig.nominal else {}),
            "source": rig.display.source(rig.characterised_as),
            "colorimetric_observer": rig.observer,
            "panel": panel.model_dump(mode="json"),
            "monitor_settings": {
                name: settings.stated
                for name, settings in (("measured", rig.measured_settings), ("used", rig.spec.monitor_settings))
                if settings
            },
            "white_XYZ_cd_m2": {
                "left": [round(float(v), 6) for v in rig.models.left.shown_white_XYZ_cd_m2],
                "right": [round(float(v), 6) for v in rig.models.right.shown_white_XYZ_cd_m2],
            },
            **_room(rig),
            "surround_XYZ_cd_m2": _surround(experiment),
            "distance_mm": rig.spec.distance_mm,
            "glasses": rig.spec.glasses,
            "mode_options": dict(rig.spec.mode_options),
            "filters": _filters(experiment),
            "crosstalk_cancelled": rig.crosstalk is not None,
            "lift_black": rig.spec.lift_black,
            "dither": rig.spec.dither,
            "gain_map_delivers": rig.gain_map.delivered_share if rig.gain_map else None,
        },
        analysis=experiment.spec.analysis.model_dump(mode="json", exclude_none=True),
        hashes=hashes(experiment, stimuli) | ({"configuration": configuration} if configuration else {}),
        software=software()
        | {offer.package: version_of(offer) for offer in others}
        | stimuli.manifest.get("extension", {}),
        **({"extensions": {kind: offer.package for kind, offer in offers.items()}} if offers else {}),
        presentation=dict(presentation),
        remarks=remarks,
        interface=_interface(experiment),
        station="" if simulated else station(),
        **drawn,
    )


def planned(experiment: Experiment, blocks: Sequence[Block]) -> tuple[Mapping[str, Any], ...]:
    """Return each block's kind, trials and expected time in seconds, by which others see how far a session is.

    Where it asks scales, their ends are there too, which bound the intervals of mean ratings.
    """
    kinds = (block.kind for block in experiment.spec.blocks)
    return tuple(
        {"kind": kind, "trials": block.trials, "expected_s": round(block.expected_s, 1)}
        | ({"scales": {name: [*ends] for name, ends in block.scale_ends.items()}} if block.scale_ends else {})
        for kind, block in zip(kinds, blocks, strict=True)
    )


def _interface(experiment: Experiment) -> dict[str, Any]:
    """Return the language of what observers read, and what the experiment sets of how it looks and of its keys."""
    spec = experiment.spec
    own = {name: words for name, words in spec.words.items() if name != "language"}
    return {
        "language": spec.words.get("language", "en"),
        "style": spec.style.model_dump(mode="json", exclude_defaults=True),
        "keys": dict(spec.keys),
        "words": own,
        **({"keyboard_labels": dict(labels)} if (labels := experiment.keyboard_labels) else {}),
        **_fonts(experiment),
    }


def _fonts(experiment: Experiment) -> dict[str, Any]:
    """Return the fonts other than DejaVu Sans that draw what the experiment says, if there are any."""
    spec = experiment.spec
    said = "".join(_strings([spec.question, dict(spec.words), [block.model_dump() for block in spec.blocks]]))
    fonts = [
        {"name": font_name(font), "file": font.name, "sha256": sha256_of_file(font)}
        for font in other_fonts(said, experiment.font)
    ]
    return {"fonts": fonts} if fonts else {}


def _strings(value: object) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping | Sequence):
        for inner in value.values() if isinstance(value, Mapping) else value:
            yield from _strings(inner)


def _room(rig: Rig) -> dict[str, Any]:
    """Return the terms of the darkest that each eye is shown: the display's own black, and the room's light."""
    models = {"left": rig.models.left, "right": rig.models.right}
    stated = rig.nominal.black_XYZ_cd_m2 if rig.nominal else 0.0
    terms = {
        "black_XYZ_cd_m2": {
            eye: model.shown_black_XYZ_cd_m2 - model.ambient_XYZ_cd_m2 + stated for eye, model in models.items()
        },
        "ambient_XYZ_cd_m2": {eye: model.ambient_XYZ_cd_m2 for eye, model in models.items()},
    }
    return {name: {eye: [round(float(v), 6) for v in xyz] for eye, xyz in eyes.items()} for name, eyes in terms.items()}


def _surround(experiment: Experiment) -> dict[str, list[float]]:
    """Return the light around the pictures: the background, or the darkest that the display can do if that is more."""
    models, nominal = experiment.rig.models, experiment.rig.nominal
    of_standard = nominal.black_XYZ_cd_m2 if nominal else 0.0

    def light(model: DisplayModel) -> Floats:
        darkest = model.shown_black_XYZ_cd_m2 + of_standard
        background = experiment.ground.background_XYZ_cd_m2(model) if experiment.ground else darkest
        return darkest if background[1] < darkest[1] else background

    return _at_the_eyes(experiment, light(models.left), light(models.right))


def _filters(experiment: Experiment) -> dict[str, Any] | None:
    """Return the filters of an anaglyph, and what they leave of white; None in a mode without such filters."""
    models = experiment.rig.models
    through = experiment.mode.seen_through(models)
    if through is None:
        return None
    white = _at_the_eyes(experiment, models.left.shown_white_XYZ_cd_m2, models.right.shown_white_XYZ_cd_m2)
    return {**through.to_json(), "white_XYZ_cd_m2": white}


def _at_the_eyes(experiment: Experiment, left_XYZ: Floats, right_XYZ: Floats) -> dict[str, list[float]]:
    """Return what the eyes see of lights in cd/m² that are asked of the display: in an anaglyph, behind the filters."""
    models, seen = experiment.rig.models, (left_XYZ, right_XYZ)
    mixture = experiment.mode.mixture(models)
    if mixture is not None:
        light = mixture.light(left_XYZ, right_XYZ).clip(*mixture.limits)
        left, right = (each.dark_XYZ_cd_m2 + each.primaries_XYZ_cd_m2 @ light for each in (models.left, models.right))
        seen = mixture.left_through @ left, mixture.right_through @ right
    return {eye: [round(float(v), 6) for v in xyz] for eye, xyz in zip(("left", "right"), seen, strict=True)}


def check_unchanged(log: SessionLog, now: Version) -> None:
    """Raise SessionError, naming what changed, if a session cannot be resumed as it began."""
    if changed := changes(log.header, now.hashes):
        names = named.names if (named := now.changes_since(Version.of_log(log))) else ""
        raise SessionError(
            Finding(
                f"the {' and the '.join(changed)} changed since this session began{names}",
                str(log.file),
                remedy="restore what it began with, or leave out --resume to begin a new session, or resume with "
                "--accept-changes, which the record will state",
            )
        )
