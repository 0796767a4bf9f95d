"""The pictures of a study and the groups that they make: by folder, or by the name before the last underscore."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from documents import Finding, InputError, counted
from stimuli.pictures import FoundPicture, find_pictures

_EYES = ("left", "right", "l", "r")
_LONGEST_NAME = 60


@dataclass(frozen=True, slots=True)
class Member:
    """A picture of a study.

    ``folder`` is the one that it was in, above those that are named for an eye; ``called`` is its name in there.
    """

    picture: FoundPicture
    folder: Path
    called: str

    @property
    def name(self) -> str:
        """The picture's name in the recipe."""
        return self.picture.name


@dataclass(frozen=True, slots=True)
class Grouping:
    """Pictures that belong together: ``members`` are their names by group, ``versions`` what each is called in it.

    ``sentence`` says what makes the groups, and which there are.
    """

    members: Mapping[str, tuple[str, ...]]
    versions: Mapping[str, str]
    sentence: str

    def factors(self, name: str) -> dict[str, str]:
        """Return the factors of a picture."""
        group = next(group for group, names in self.members.items() if name in names)
        return {"group": group, "version": self.versions[name]}


def gather(paths: Sequence[Path]) -> tuple[Member, ...]:
    """Return the pictures among ``paths`` and in the folders among them, folder by folder, each under its own name.

    A folder that holds only folders stands for these. Where pictures of several folders have one name, the folder's
    name comes before it.

    Raises
    ------
    InputError
        With all that is wrong with the pictures, as `stimuli.pictures.find_pictures` does.
    """
    by_folder: dict[Path, list[Path]] = {}
    if exr := [path for path in paths if path.suffix.lower() == ".exr"]:
        remedy = "name PNG or JPEG files; for OpenEXR write a recipe (docs/stimuli.md)"
        raise InputError([Finding("a new study is of ordinary pictures", str(path), remedy=remedy) for path in exr])
    for path in paths:
        for folder, inside in _folders(path):
            by_folder.setdefault(folder, []).append(inside)
    members: list[Member] = []
    findings: list[Finding] = []
    for folder, given in by_folder.items():
        try:
            members += [Member(picture, folder, picture.name) for picture in find_pictures(given)]
        except InputError as error:
            findings += error.findings
    if not findings and not members:
        findings = [Finding("there are no pictures", remedy="name picture files, or folders of them")]
    if findings:
        raise InputError(findings)
    return _own_names(members)


def _folders(path: Path) -> list[tuple[Path, Path]]:
    """Return the folder that a path belongs to, with the path; of a folder of folders, each of these."""
    if not path.is_dir():
        parent = path.absolute().parent
        return [(parent.parent if parent.name.lower() in _EYES else parent, path)]
    inside = [entry for entry in sorted(path.iterdir()) if not entry.name.startswith(".")]
    below = [entry for entry in inside if entry.is_dir() and entry.name.lower() not in _EYES]
    if below and len(below) == len([entry for entry in inside if entry.is_dir()]) and not _has_files(inside):
        return [(entry.absolute(), entry) for entry in below]
    return [(path.absolute(), path)]


def _has_files(entries: Sequence[Path]) -> bool:
    return any(entry.is_file() for entry in entries)


def _own_names(members: Sequence[Member]) -> tuple[Member, ...]:
    """Return the pictures, with their folders' names before theirs if names would meet otherwise."""
    if max(Counter(member.name.casefold() for member in members).values()) == 1:
        return tuple(members)
    named = []
    for member in members:
        folder = re.sub(r"[^A-Za-z0-9._-]+", "-", member.folder.name).strip("._-") or "folder"
        name = f"{folder}_{member.name}"[:_LONGEST_NAME]
        named.append(replace(member, picture=replace(member.picture, name=name)))
    for name, count in Counter(member.name.casefold() for member in named).items():
        if count > 1:
            files = [str(member.picture.files[0]) for member in named if member.name.casefold() == name]
            raise InputError(
                Finding(f"these pictures would all be called '{name}': {', '.join(files)}", remedy="rename")
            )
    return tuple(named)


def by_folder(members: Sequence[Member]) -> Grouping | None:
    """Return the groups that the pictures' folders make; None if all lie in one."""
    folders = {member.folder for member in members}
    if len(folders) < 2:
        return None
    # As much of the paths' ends as tells the folders apart.
    depth = next(count for count in range(1, 99) if len({path.parts[-count:] for path in folders}) == len(folders))
    groups = {member.name: "/".join(member.folder.parts[-depth:]) for member in members}
    versions = {member.name: member.called for member in members}
    return _grouping(members, groups, versions, "A group is the pictures of one folder")


def by_name(members: Sequence[Member]) -> Grouping:
    """Return the groups of names that agree before their last underscore.

    Raises
    ------
    InputError
        If a name has no underscore.
    """
    parts = {member.name: member.name.rpartition("_") for member in members}
    without = [name for name, (group, _, version) in parts.items() if not (group and version)]
    if without:
        message = f"{counted(len(without), 'picture belongs', 'pictures belong')} to no group, such as '{without[0]}'"
        remedy = "put each group into a folder of its own, or name the files GROUP_VERSION, such as church_jpeg.png"
        raise InputError(Finding(message, remedy=remedy))
    groups = {name: group for name, (group, _, _) in parts.items()}
    versions = {name: version for name, (_, _, version) in parts.items()}
    return _grouping(members, groups, versions, "A group is the pictures whose names agree before the last underscore")


def groups_of_pairs(members: Sequence[Member]) -> Grouping:
    """Return the groups within which pictures are compared: by folder if there are several, else by name.

    Raises
    ------
    InputError
        If pictures belong to no group, or a group has one picture only.
    """
    grouping = by_folder(members) or by_name(members)
    alone = [group for group, names in grouping.members.items() if len(names) < 2]
    if alone:
        message = f"{counted(len(alone), 'group has', 'groups have')} one picture only, such as '{alone[0]}'"
        raise InputError(Finding(message, remedy=f"{grouping.sentence} Add another picture to it, or leave it out"))
    return grouping


def _grouping(members: Sequence[Member], groups: Mapping[str, str], versions: Mapping[str, str], rule: str) -> Grouping:
    names: dict[str, list[str]] = {}
    for member in members:
        names.setdefault(groups[member.name], []).append(member.name)
    shown = [f"{group} ({len(of_group)})" for group, of_group in names.items()]
    more = f" and {len(shown) - 5} more" if len(shown) > 5 else ""
    sentence = f"{rule}: {', '.join(shown[:5])}{more}."
    return Grouping({group: tuple(of_group) for group, of_group in names.items()}, versions, sentence)
