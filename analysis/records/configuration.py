"""Where the files lie that sessions were made with: experiment, rig, display, recipe, the manifest of the stimuli.

`RESULTS/EXPERIMENT/configuration/DIGITS/configuration.json` names the files beside it. DIGITS begin the SHA-256 of that
list, so that sessions with equal files share one folder. The reader defines the format; the runner writes it.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from documents import InputError
from documents.files import inside, read_cached_json

CONFIGURATION_LIST = "configuration.json"
_FOLDER = "configuration"
_DIGITS = 16


def configuration_folder(experiment: Path, digest: str) -> Path:
    """Return where files lie whose list has the SHA-256 ``digest``, below an ``experiment``'s folder of results."""
    return experiment / _FOLDER / digest[:_DIGITS]


def kept_experiments(results: Path, name: str) -> list[Path]:
    """Return the experiment files that were kept beside sessions of the experiment ``name`` in or below ``results``."""
    lying = f"{_FOLDER}/*/{CONFIGURATION_LIST}"
    patterns = (lying, f"{name}/{lying}", f"results/{name}/{lying}")
    lists = [place for pattern in patterns for place in sorted(results.glob(pattern))]
    return [
        file for place in lists for file in _inside(place.parent, [_listed(place).get("experiment")]) if file.is_file()
    ]


def kept_files(log: Path) -> dict[str, Path]:
    """Return the files that sessions beside the ``log`` were made with, by their place in the experiment's folder."""
    experiment = log.absolute().parent.parent.parent
    lists = sorted(experiment.glob(f"{_FOLDER}/*/{CONFIGURATION_LIST}"))
    return {
        file.relative_to(experiment).as_posix(): file
        for place in lists
        if _stays(experiment, place)
        for file in (place, *_inside(place.parent, _listed(place).get("files", ())))
        if file.is_file()
    }


def _listed(place: Path) -> dict[str, Any]:
    listed = read_cached_json(place)
    return listed if isinstance(listed, dict) else {}


def _inside(folder: Path, names: object) -> Iterator[Path]:
    """Yield the files called ``names`` that lie in ``folder`` once links are followed."""
    for name in names if isinstance(names, list | dict) else ():
        if isinstance(name, str) and not Path(name).is_absolute() and _stays(folder, folder / name):
            yield folder / name


def _stays(folder: Path, file: Path) -> bool:
    try:
        inside(folder, file)
    except (InputError, ValueError):  # the latter of what no file can be called
        return False
    return True
