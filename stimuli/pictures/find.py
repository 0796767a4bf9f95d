"""The stereo pictures in folders and files, paired by their names, found without decoding a picture."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from documents import Finding
from documents.files import no_file_name
from stimuli.errors import StimulusError
from stimuli.pictures.colour_spaces import ColourEncoding, embedded_encoding, same_space
from stimuli.pictures.packing import Packing, eye_size_px, without_packing, words_of
from stimuli.pictures.picture_header import PictureHeader, is_ordinary, read_header
from stimuli.pictures.stereo_image import Eye

_EYE_WORDS: dict[str, Eye] = {"left": "left", "right": "right", "l": "left", "r": "right"}
_EYE_FOLDERS: dict[str, Eye] = {"left": "left", "right": "right"}
_LONGEST_NAME = 60


@dataclass(frozen=True, slots=True)
class FoundPicture:
    """A picture for two eyes: a file for each, or ``file``, one for both.

    Attributes
    ----------
    name
        A name that recipes take, of the file's.
    left, right
        The file of each eye; None of ``file``.
    file
        The file of both eyes, or of a flat picture; None of a pair of files.
    packing
        How both eyes lie in ``file``, such as ``side-by-side``; None if it is flat, or an MPO pair, which needs none.
    size_px
        Width and height of each eye's picture, upright and stretched to its full size.
    stereo
        Whether the eyes see different pictures.
    colour_space
        That which the file declares: a name such as ``srgb``, ``icc`` for a profile that is no named space, or None.
    """

    name: str
    left: Path | None
    right: Path | None
    file: Path | None
    packing: Packing | None
    size_px: tuple[int, int]
    stereo: bool
    colour_space: str | None

    @property
    def files(self) -> tuple[Path, ...]:
        """Its files: one, or the left and the right eye's."""
        return tuple(path for path in (self.left, self.right, self.file) if path is not None)


def find_pictures(paths: Iterable[str | Path]) -> tuple[FoundPicture, ...]:
    """List the PNG, JPEG, TIFF, WebP, MPO and JPS pictures in folders and among files, paired by name.

    Two files are a pair if their names differ in one word only: ``left`` and ``right``, or at the end ``l`` and ``r``
    (``plate_L.jpg``, ``plate-r.png``, ``left plate.tif``), or if they have one name in folders called ``left`` and
    ``right``. Words such as ``sbs``, ``hsbs``, ``ou`` and ``crossed`` say that a file holds both eyes.

    Parameters
    ----------
    paths
        Files, and folders, of which the pictures directly inside are listed, and those in its ``left`` and ``right``.

    Returns
    -------
    tuple[FoundPicture, ...]
        The pictures in natural order: ``plate2`` before ``plate10``.

    Raises
    ------
    StimulusError
        If a picture has no partner, the two differ in size or colour space, names differ in case alone, a folder
        holds no pictures, or a file cannot be shown; all that is wrong at once.

    Examples
    --------
    >>> import numpy as np
    >>> from PIL import Image
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     for name in ("plate_L.png", "plate_R.png", "vase.png"):
    ...         Image.fromarray(np.zeros((4, 6, 3), np.uint8)).save(Path(folder, name))
    ...     [(picture.name, picture.stereo, picture.size_px) for picture in find_pictures([folder])]
    [('plate', True, (6, 4)), ('vase', False, (6, 4))]
    """
    findings: list[Finding] = []
    headers: dict[Path, PictureHeader] = {}
    groups: dict[tuple[Path, str], dict[str, list[Path]]] = defaultdict(lambda: defaultdict(list))
    for path, eye_of_folder in _files(paths, findings):
        if path in headers:
            continue
        try:
            headers[path] = read_header(path)
        except StimulusError as error:
            findings += error.findings
            continue
        eye, stem = (None, path.stem) if headers[path].is_pair else _eye_of(path.stem)
        folder = path.parent
        if eye_of_folder is not None:
            eye, folder = eye_of_folder, folder.parent
        groups[folder, stem.lower()][eye or "both"].append(path)
    pictures = []
    for group in groups.values():
        pictures += _pictures(group, headers, findings)
    findings += _same_names(pictures)
    if findings:
        raise StimulusError(findings)
    return tuple(sorted(pictures, key=lambda picture: natural_order(picture.name)))


def natural_order(name: str) -> list[tuple[int, str]]:
    """Return a key that sorts names with their numbers in order."""
    parts = re.split(r"(\d+)", name.lower())
    return [(int(part), "") if part.isdecimal() else (0, part) for part in parts]


def _files(paths: Iterable[str | Path], findings: list[Finding]) -> Iterator[tuple[Path, Eye | None]]:
    """Yield the files, with the eye that the folder of each names."""
    for given in paths:
        path = Path(given)
        if not path.is_dir():
            yield path, None
            continue
        there = list(_in_folder(path))
        if not there:
            kinds = "PNG, JPEG, TIFF, WebP, MPO or JPS"
            findings.append(
                Finding("there are no pictures in the folder", str(path), remedy=f"it needs files of {kinds}")
            )
        yield from there


def _in_folder(folder: Path) -> Iterator[tuple[Path, Eye | None]]:
    eye = _EYE_FOLDERS.get(folder.name.lower())
    for path in sorted(folder.iterdir()):
        if path.is_file() and is_ordinary(path) and not path.name.startswith("."):
            yield path, eye
        elif path.is_dir() and path.name.lower() in _EYE_FOLDERS:
            yield from _in_folder(path)


def _eye_of(stem: str) -> tuple[Eye | None, str]:
    """Return the eye that a file's name states, and the name without it; (None, stem) if it states none, or both."""
    words = words_of(stem)
    eyes = {word for word in words if word in ("left", "right")}
    last = words[-1] if len(words) > 1 else ""
    if len(eyes) == 1:
        word = eyes.pop()
    elif not eyes and last in ("l", "r"):
        word = last
    else:
        return None, stem
    if words.count(word) > 1 and len(word) > 1:
        return None, stem
    parts = re.split(r"([-_. ]+)", stem)
    places = [place for place, part in enumerate(parts) if part.lower() == word]
    at = places[-1]
    kept = [*parts[: max(at - 1, 0)], *parts[at + 1 :]] if at else parts[2:]
    return _EYE_WORDS[word], "".join(kept)


def _pictures(
    group: dict[str, list[Path]], headers: dict[Path, PictureHeader], findings: list[Finding]
) -> list[FoundPicture]:
    """Return the pictures of files that share a name: a pair, and those for both eyes."""
    pictures = []
    for path in group.get("both", ()):
        pictures += _checked(None, None, path, headers, findings)
    lefts, rights = group.get("left", []), group.get("right", [])
    if len(lefts) == len(rights) == 1:
        return pictures + _checked(lefts[0], rights[0], None, headers, findings)
    for eye, mine, others in (("left", lefts, rights), ("right", rights, lefts)):
        other = "right" if eye == "left" else "left"
        for path in mine if not others else mine[1:]:
            if others:
                message = f"there are two files of the {eye} eye: {mine[0].name} and {path.name}"
                findings.append(Finding(message, str(path), remedy="keep one, or give one another name"))
                continue
            message = f"the {eye} eye's picture is without the {other} eye's"
            remedy = f"put the {other} eye's beside it, called alike, or rename it if both eyes see it"
            findings.append(Finding(message, str(path), remedy=remedy))
    return pictures


def _checked(
    left: Path | None,
    right: Path | None,
    file: Path | None,
    headers: dict[Path, PictureHeader],
    findings: list[Finding],
) -> list[FoundPicture]:
    """Return the picture, or nothing and what is wrong with it."""
    paths = [path for path in (left, right, file) if path is not None]
    mine = [headers[path] for path in paths]
    try:
        spaces = [_declared(header) for header in mine]
        packing = None if file is None or mine[0].packing == "none" else mine[0].packing
        size = mine[0].size_px if packing is None else eye_size_px(mine[0].size_px, packing, paths[0])
    except StimulusError as error:
        findings += error.findings
        return []
    first, last = mine[0], mine[-1]
    if first.size_px != last.size_px:
        sizes = [f"{header.size_px[0]} × {header.size_px[1]}" for header in mine]
        message = f"the left eye's picture has {sizes[0]} pixels and the right eye's {sizes[1]}"
        findings.append(Finding(message, str(paths[-1]), remedy="crop or save them alike"))
        return []
    if spaces[0] != spaces[-1]:
        words = [space or "none" for space in spaces]
        message = f"the left eye's picture declares the colour space {words[0]} and the right eye's {words[1]}"
        findings.append(Finding(message, str(paths[-1]), remedy="save them alike"))
        return []
    stem = without_packing(file.stem) if file is not None else _eye_of(paths[0].stem)[1]
    stereo = file is None or first.is_pair
    return [FoundPicture(_name(stem or paths[0].parent.name), left, right, file, packing, size, stereo, spaces[0])]


def _declared(header: PictureHeader) -> str | None:
    """Return the colour space that a file declares; StimulusError if it declares two."""
    own = None if header.profile is None else embedded_encoding(header.profile, header.path)
    space, faults = declared_space(header, own)
    if faults:
        raise StimulusError([Finding(message, str(header.path), remedy=remedy) for message, remedy in faults])
    return space


def _name(stem: str) -> str:
    """Return a name for recipes: letters, digits, dots, hyphens and underscores, first a letter or digit."""
    name = re.sub(r"[^A-Za-z0-9._-]+", "-", stem).lstrip("._-")[:_LONGEST_NAME].rstrip("._-")
    return name if name and no_file_name(name) is None else f"picture-{name}".rstrip("-")


def _same_names(pictures: Sequence[FoundPicture]) -> Iterator[Finding]:
    by_name: dict[str, list[FoundPicture]] = defaultdict(list)
    for picture in pictures:
        by_name[picture.name.casefold()].append(picture)
    for alike in by_name.values():
        if len(alike) > 1:
            files = [picture.files[0] for picture in alike]
            listed = ", ".join(path.name for path in files)
            case_only = len({path.name for path in files}) > len({path.name.casefold() for path in files})
            what = "differ in upper and lower case alone" if case_only else "give one name"
            message = f"{len(files)} files {what}, '{alike[0].name}': {listed}"
            yield Finding(message, str(files[1]), remedy="rename one")


def declared_space(header: PictureHeader, own: ColourEncoding | None) -> tuple[str | None, list[tuple[str, str]]]:
    """Return the colour space that a file with the profile ``own`` declares, and the fault and remedy if it states two.

    A name, ``icc`` for a profile that is no named space, or None. A JPEG's profile stands above EXIF, which hardly any
    program keeps up with it; a PNG's chunks are meant to be one statement.
    """
    if own is None:
        return header.declared, []
    space = same_space(own) or "icc"
    if header.kind != "png" or header.declared in (None, space):
        return space, []
    whose = "another colour space" if space == "icc" else space
    message = f"its chunk cICP or sRGB states {header.declared}, and its ICC profile {whose}"
    choice = f"colour_space: {header.declared}, or colour_space: icc"
    return space, [(message, f"save it with the one that it is in; or write which holds: {choice}")]
