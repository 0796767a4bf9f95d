"""What sessions were made with, kept beside them: copies of the files that the experiment consists of.

The experiment, rig, display, recipe, font and what else is text are copied as they lie beside each other, with the
stimuli's manifest, which has the SHA-256 of every picture. `analysis.records.versions` says where; no copy is ever
changed. What another program removed or changed of them while a session runs is written again at its end.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from analysis.records import CONFIGURATION_LIST, configuration_folder
from documents import InputError
from documents.files import read_regular, sha256_of_json, whole_file, whole_folder, writing
from runner.errors import SessionError
from runner.protocol import Experiment, named_files
from stimuli.build import StimulusSet

_STIMULI = "stimuli.json"
_MOST_BYTES = 100_000_000
_TEXT = (".yaml", ".yml", ".json", ".csv", ".tsv", ".txt")


@dataclass(frozen=True, slots=True)
class Configuration:
    """The files that sessions are made with: ``contents`` by their place in the folder, ``named`` as they were named.

    ``digest`` is the SHA-256 of the list in `configuration.json`.
    """

    contents: dict[str, bytes]
    named: dict[str, Any]
    digest: str

    def keep(self, folder: Path) -> tuple[str, ...]:
        """Write what is missing of the files below the experiment's ``folder`` of results, or is there as others.

        Returns
        -------
        tuple of str
            The names of what was written, such as ``rig.yaml``; empty if all were there.

        Raises
        ------
        SessionError
            If they cannot be written; nothing is then left of them, unless some were there.
        """
        place = configuration_folder(folder, self.digest)
        listed = json.dumps(self.named, indent=2, ensure_ascii=False) + "\n"
        files = {**self.contents, CONFIGURATION_LIST: listed.encode("utf-8", "surrogateescape")}
        wrong = {name: content for name, content in files.items() if not _holds(place / name, content)}
        if wrong:
            with writing(place, "session's configuration", SessionError):
                _write(place, wrong)
        return tuple(wrong)


def _holds(file: Path, content: bytes) -> bool:
    try:
        return read_regular(file, len(content)) == content
    except InputError:  # there is none, it cannot be read, or it is longer
        return False


def _write(place: Path, contents: Mapping[str, bytes]) -> None:
    if not place.exists():
        try:
            with whole_folder(place, private=True) as draft:
                _put(draft, contents)
            return
        except OSError:
            if not place.is_dir():  # else another station wrote the same meanwhile
                raise
    _put(place, contents)


def _put(folder: Path, contents: Mapping[str, bytes]) -> None:
    for name, content in contents.items():
        with whole_file(folder / name, private=True) as draft:
            draft.write_bytes(content)


def configuration_of(experiment: Experiment, stimuli: StimulusSet, further: Sequence[Path] = ()) -> Configuration:
    """Return the files that ``experiment`` consists of, with its ``stimuli`` and ``further`` files, as they are now.

    Pictures are not copied: the manifest has the SHA-256 of those that were read and of those that are shown.

    Raises
    ------
    SessionError
        If a file cannot be read.
    """
    rig, recipe = Path(experiment.rig.file), experiment.recipe_file
    always = {_whole(file) for file in (experiment.file, rig, recipe, experiment.font) if file}
    named_as = {_whole(file): absolute for file, absolute in named_files(experiment)}
    named_as |= {_whole(file): True for file in further}
    files = [file for file in named_as if file in always or file.suffix.lower() in _TEXT]
    top = Path(os.path.commonpath([file.parent for file in files if not named_as[file]]))
    places: dict[Path, str] = {}
    for file in files:
        name = file.relative_to(top) if file.is_relative_to(top) else Path("elsewhere", file.name)
        while name.as_posix() in places.values():
            name = name.with_stem(f"{name.stem}-")
        places[file] = name.as_posix()
    contents = {name: read_regular(file, _MOST_BYTES, error=SessionError) for file, name in places.items()}
    contents[_STIMULI] = read_regular(stimuli.manifest_path, _MOST_BYTES, error=SessionError)
    named = {
        "schema_version": 1,
        "experiment": places[_whole(experiment.file)],
        "rig": places[_whole(rig)],
        "recipe": places[_whole(recipe)],
        "stimuli": _STIMULI,
        "files": {name: hashlib.sha256(data).hexdigest() for name, data in contents.items()},
    }
    return Configuration(contents, named, sha256_of_json(named))


def _whole(file: Path) -> Path:
    return Path(os.path.abspath(file))
