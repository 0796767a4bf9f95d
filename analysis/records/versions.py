"""With which files a session was made, where they lie, and which are other ones in another session, by name.

They are experiment, rig, display, recipe and the manifest of the stimuli.
`RESULTS/EXPERIMENT/configuration/DIGITS/configuration.json` names the files beside it. DIGITS begin the SHA-256 of that
list, so that sessions with equal files share one folder. The reader defines the format; the runner writes it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from analysis.records.session_record import SessionLog
from documents import InputError
from documents.files import inside, read_cached_json

CONFIGURATION_LIST = "configuration.json"
_FOLDER = "configuration"
_DIGITS = 16
_MANIFEST = "stimuli.json"
_NAMED = 8
# Whose file says nothing of the rest: where only a comment of it changed, it is not named.
_OF_FILE = {"experiment": ("experiment",), "rig": ("rig", "display"), "recipe": ("stimuli",)}


@dataclass(frozen=True, slots=True)
class Changes:
    """``what`` changed, such as ``display``, and the names of ``files`` of text and of ``pictures`` that did."""

    what: tuple[str, ...]
    files: tuple[str, ...] = ()
    pictures: tuple[str, ...] = ()

    @property
    def subject(self) -> str:
        """What changed, such as ``the display and the stimuli``."""
        return f"the {' and the '.join(self.what)}"

    @property
    def names(self) -> str:
        """The files and pictures, such as ``: display.yaml, the picture four``; empty where they are not known."""
        names = [*self.files, *(f"the picture {name}" for name in self.pictures)]
        more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
        return f": {', '.join(names[:_NAMED])}{more}" if names else ""


@dataclass(frozen=True, slots=True)
class Version:
    """SHA-256 of what decides what observers are asked and shown (``hashes``), and of the files behind it.

    ``files`` has the SHA-256 of each file of text by its place, ``own`` says which of them is the experiment, the rig
    and the recipe, ``pictures`` has that of each stimulus by name; all three are empty where they were not kept.
    """

    hashes: Mapping[str, str]
    files: Mapping[str, str]
    own: Mapping[str, str]
    pictures: Mapping[str, str]

    @classmethod
    def of_log(cls, log: SessionLog) -> Version:
        """Return what a session was made with at last, by what was kept beside it."""
        hashes = {name: str(digest) for name, digest in log.header.hashes.items()}
        for resumption in log.resumptions:
            changed = resumption.accepted_changes.items()
            hashes |= {name: str(change.now) for name, change in changed if name in hashes}
        digest = hashes.pop("configuration", "")
        lies_in = log.file.absolute().parents
        kept = len(lies_in) > 2 and re.fullmatch("[0-9a-f]{64}", digest)
        folder = configuration_folder(lies_in[2], digest) if kept else Path()
        listed = _read(folder / CONFIGURATION_LIST) if kept else {}
        return cls.of_lists(hashes, listed, _read(folder / _MANIFEST) if listed else {})

    @classmethod
    def of_lists(cls, hashes: Mapping[str, str], listed: Mapping[str, Any], manifest: Mapping[str, Any]) -> Version:
        """Return the version by the list of files that are kept and the manifest of the stimuli, as JSON."""
        kept = listed.get("files")
        files = {str(place): str(digest) for place, digest in kept.items()} if isinstance(kept, dict) else {}
        own = {key: str(listed[key]) for key in _OF_FILE if key in listed}
        pictures = {
            str(entry.get("name")): str(entry.get("sha256"))
            for entry in _list(manifest.get("stimuli"))
            if isinstance(entry, dict)
        }
        return cls(hashes, files, own, pictures)

    def changes_since(self, before: Version) -> Changes | None:
        """Return what is another than ``before``, None if nothing is. What either does not state is not compared.

        A file that only lies elsewhere is no other.
        """
        both = [name for name in self.hashes if name in before.hashes]
        what = tuple(name for name in both if self.hashes[name] != before.hashes[name])
        if not what:
            return None
        unnamed = {place for key, place in self.own.items() if not set(_OF_FILE[key]) & set(what)} | {_MANIFEST}
        known = set(before.files.values())
        files = [place for place, digest in self.files.items() if digest not in known and place not in unnamed]
        pictures = []
        if "stimuli" in what and before.pictures:
            names = dict.fromkeys([*before.pictures, *self.pictures])
            pictures = [name for name in names if self.pictures.get(name) != before.pictures.get(name)]
        return Changes(what, tuple(files) if known else (), tuple(pictures))


def configuration_folder(experiment: Path, digest: str) -> Path:
    """Return where files lie whose list has the SHA-256 ``digest``, below an ``experiment``'s folder of results."""
    return experiment / _FOLDER / digest[:_DIGITS]


def kept_experiments(results: Path, name: str) -> list[Path]:
    """Return the experiment files that were kept beside sessions of the experiment ``name`` in or below ``results``."""
    lying = f"{_FOLDER}/*/{CONFIGURATION_LIST}"
    patterns = (lying, f"{name}/{lying}", f"results/{name}/{lying}")
    lists = [place for pattern in patterns for place in sorted(results.glob(pattern))]
    return [
        file for place in lists for file in _inside(place.parent, [_read(place).get("experiment")]) if file.is_file()
    ]


def kept_files(log: Path) -> dict[str, Path]:
    """Return the files that sessions beside the ``log`` were made with, by their place in the experiment's folder."""
    experiment = log.absolute().parent.parent.parent
    lists = sorted(experiment.glob(f"{_FOLDER}/*/{CONFIGURATION_LIST}"))
    return {
        file.relative_to(experiment).as_posix(): file
        for place in lists
        if stays_in(experiment, place)
        for file in (place, *_inside(place.parent, _read(place).get("files", ())))
        if file.is_file()
    }


def _inside(folder: Path, names: object) -> Iterator[Path]:
    """Yield the files called ``names`` that lie in ``folder`` once links are followed."""
    for name in names if isinstance(names, list | dict) else ():
        if isinstance(name, str) and not Path(name).is_absolute() and stays_in(folder, folder / name):
            yield folder / name


def stays_in(folder: Path, file: Path) -> bool:
    """Return whether ``file`` lies in ``folder`` once links are followed."""
    try:
        inside(folder, file)
    except (InputError, ValueError):  # the latter of what no file can be called
        return False
    return True


def _list(held: object) -> list[Any]:
    return held if isinstance(held, list) else []


def _read(file: Path) -> Mapping[str, Any]:
    held = read_cached_json(file) if file.is_file() else {}
    return held if isinstance(held, dict) else {}
