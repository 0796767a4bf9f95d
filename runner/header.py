"""How a session was made: the header of its log, and what must not change before it is resumed."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import platform
import subprocess
from collections.abc import Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from analysis.records import Header
from devices.clip_cost import clip_cost
from devices.display_file import EyeModels
from devices.rig_file import Rig
from documents import Finding
from runner.errors import SessionError
from runner.protocol.experiment import Experiment
from stimuli.build import StimulusSet
from stimuli.stereo_image import StereoImage

_NOTABLE = ("cyclopean", "numpy", "moderngl", "glfw", "OpenImageIO", "scipy")


def _digest(value: object) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()


def _display_digest(models: EyeModels) -> str:
    numbers = [
        [model.black_XYZ_cd_m2.tolist(), model.primaries_XYZ_cd_m2.tolist(), [asdict(c) for c in model.curves]]
        for model in (models.left, models.right)
    ]
    return _digest(numbers)


def _rig_digest(rig: Rig) -> str:
    return _digest([rig.mode, rig.distance_mm, rig.glasses, rig.display.panel.model_dump(mode="json")])


def hashes(experiment: Experiment, stimuli: StimulusSet) -> dict[str, str]:
    """Return the SHA-256 of everything that decides what an observer is asked."""
    return {
        "experiment": experiment.digest,
        "stimuli": stimuli.digest,
        "display": _display_digest(experiment.rig.models),
        "rig": _rig_digest(experiment.rig),
    }


def software() -> dict[str, str]:
    """Return the versions of the program and of what it stands on."""
    versions = {name: importlib.metadata.version(name) for name in _NOTABLE}
    versions["python"] = platform.python_version()
    versions["system"] = platform.platform()
    commit = _commit()
    return versions | ({"commit": commit} if commit else {})


def _commit() -> str | None:
    command = ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty", "--abbrev=12"]
    try:
        told = subprocess.run(command, capture_output=True, text=True, timeout=5)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return told.stdout.strip() if told.returncode == 0 else None


def describe_stimulus(
    name: str, image: StereoImage, factors: Mapping[str, str | float], models: EyeModels
) -> dict[str, Any]:
    """Return a stimulus's name and factors, and what the gamut clip costs it in each eye."""
    left = clip_cost(models.left, image.left)
    same = image.is_flat and models.left is models.right
    right = left if same else clip_cost(models.right, image.right)
    clipping = {"left": left.to_json(), "right": right.to_json()}
    return {"name": name, "factors": dict(factors), "flat": image.is_flat, "clipping": clipping}


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
) -> Header:
    """Return the header of a session that begins now."""
    rig = experiment.rig
    panel = rig.display.panel
    return Header(
        experiment=experiment.spec.name,
        observer=observer,
        session=session,
        started_utc=datetime.now(UTC).isoformat(timespec="seconds"),
        seed=experiment.spec.seed,
        question=experiment.spec.question,
        simulated=simulated,
        stimuli=descriptions,
        display={
            "file": Path(rig.display.file).name,
            "mode": rig.mode,
            "characterised_as": rig.characterised_as,
            "source": rig.display.sources[rig.characterised_as],
            "panel": panel.model_dump(mode="json"),
            "white_XYZ_cd_m2": {
                "left": [round(float(v), 6) for v in rig.models.left.white_XYZ_cd_m2],
                "right": [round(float(v), 6) for v in rig.models.right.white_XYZ_cd_m2],
            },
            "distance_mm": rig.distance_mm,
            "glasses": rig.glasses,
        },
        analysis=experiment.spec.analysis.model_dump(mode="json"),
        hashes=hashes(experiment, stimuli),
        software=software(),
        presentation=dict(presentation),
        remarks=remarks,
    )


def check_unchanged(header: Header, now: Mapping[str, str], file: Path) -> None:
    """Raise SessionError, naming what changed, if a session cannot go on as it began."""
    changed = [name for name, digest in now.items() if header.hashes.get(name) != digest]
    if changed:
        raise SessionError(
            Finding(
                f"the {' and the '.join(changed)} changed since this session began",
                str(file),
                remedy="restore what it began with, or leave out --resume to begin a new session",
            )
        )
