"""The views in an OpenEXR file, as they stand: which channels belong to which eye, and what the file declares.

Two layouts exist (OpenEXR's "Storing multi-view images"): one part whose ``multiView`` attribute lists the views,
its unprefixed channels belonging to the first of them; and several parts, each naming its own ``view``.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from devices.colour_matching import DEFAULT_OBSERVER
from documents import count_work
from stimuli.errors import StimulusError
from stimuli.pictures.exr_header import (
    EXACT_ATTRIBUTE,
    declared_chromaticities,
    declared_observer,
    numbers,
    refuse_other_than_a_view,
)
from stimuli.pictures.luminance_chroma import is_reconstructed, rgb_of
from stimuli.pictures.picture_input import MAX_PIXELS, opened, reason, refuse_undecoded, text_of
from stimuli.pictures.region import Part, Region

if TYPE_CHECKING:
    import OpenImageIO


MAX_CHANNELS = 256
# Of all channels of a part: 100 megapixels of both eyes, and as much again in other layers.
MAX_VALUES = 1_200_000_000
# Rows are read some at a time: of a picture that is 10,000 px wide 512, whole blocks of every compression.
_BLOCK_ROWS = 256
_BAND_PIXELS = 1 << 22

_COLOURS = (("R", "G", "B"), ("X", "Y", "Z"), ("Y", "RY", "BY"))
# Beside one of these a channel Y is no grey picture.
_OF_COLOURS = {channel for colours in _COLOURS for channel in colours} - {"Y"}
_SPELLINGS = {"centre": "center"}
_EYES = ("left", "right", "center")
# Takes the names of all views and returns those to read.
Chosen = Callable[[tuple[str, ...]], Collection[str]]


@dataclass(frozen=True, eq=False, slots=True)
class View:
    """One view as stored: three channels in the file's own units; of luminance alone, the same three times.

    ``name`` is ``left``, ``right``, ``center`` or another name in the file, in lower case; empty if there is none.
    ``pixels`` is float32, (height, width, 3), on the display window of ``size_px`` (width, height) or the region of it
    that was read; the file stores the rectangle ``data_window_px`` (x, y, width, height) of it. ``chromaticities`` are
    x, y of red, green, blue and white, shape (4, 2), or None if the file declares none; ``is_xyz`` is true if the
    channels are named X, Y, Z.
    ``white_luminance_cd_m2`` is the luminance of the value 1, or None. ``observer`` is the colorimetric observer of its
    XYZ: that of the attribute ``colorimetricObserver``, else CIE 1931 2°. ``exact`` is true of floats that are to be
    kept as they are (`EXACT_ATTRIBUTE`), ``half`` of values stored as half floats.
    """

    name: str
    pixels: NDArray[np.float32]
    chromaticities: NDArray[np.float64] | None
    is_xyz: bool
    white_luminance_cd_m2: float | None
    data_window_px: tuple[int, int, int, int]
    size_px: tuple[int, int]
    observer: str = DEFAULT_OBSERVER
    exact: bool = False
    half: bool = False


def read_views(path: Path, region: Region | Part | None = None, wanted: Chosen | None = None) -> Mapping[str, View]:
    """Return the file's views by name, in file order, whole or the ``region`` of them, which may depend on their size.

    ``wanted`` takes the names of all views and returns those to read; without it, all are. Of a region, only the rows
    are read from the file, or the rows of tiles that it touches: a fault elsewhere in the file is not seen.

    Alpha, depth, and channels of named layers are left out, and not read. A data window that differs from the display
    window is placed on it: what lies outside is black, as OpenEXR defines. Luminance alone is grey; luminance and
    chroma become R, G and B by the chromaticities that the file declares, else Rec. 709's.

    Raises
    ------
    StimulusError
        If the file is missing, unreadable, cut short, no OpenEXR file, deep, too large, an environment map, of pixels
        that are not square, or holds no colour view, or one view twice; if the region is not within a view.
    """
    count_work("pictures_read" if region is None else "parts_of_pictures_read")
    with opened(path, whole=region is None) as picture:
        if picture.format_name() != "openexr":
            raise StimulusError.at(
                path,
                f"the picture is {picture.format_name()}, not OpenEXR",
                f"give it the suffix of its own kind, such as .{picture.format_name()}",
            )
        parts = list(parts_of(picture, path))
        names = [name for part in parts for name in part.groups]
        if twice := next((name for name in names if names.count(name) > 1), None):
            raise StimulusError.at(path, f"the view '{twice}' stands twice", "keep one")
        if not names:
            message = "no view has the channels R, G, B or X, Y, Z, or Y alone"
            raise StimulusError.at(path, message, "write the picture with them")
        chosen = set(names if wanted is None else wanted(tuple(names)))
        views = [view for part in parts for view in _views(picture, part, chosen, region, path)]
    return {view.name: view for view in views}


@dataclass(frozen=True, slots=True)
class FilePart:
    """A part of the file: its header, and the indices of the three channels of each view."""

    number: int
    spec: OpenImageIO.ImageSpec
    groups: Mapping[str, tuple[int, int, int]]


def parts_of(picture: OpenImageIO.ImageInput, path: Path) -> Iterator[FilePart]:
    """Yield the parts of an open OpenEXR file, checked; StimulusError as `read_views`."""
    part = 0
    while picture.seek_subimage(part, 0):
        spec = picture.spec()
        _refuse_size(path, spec)
        refuse_other_than_a_view(spec, path)
        yield FilePart(part, spec, _groups(spec, path))
        part += 1
    if problem := text_of(picture.geterror):
        refuse_undecoded(path, f"the picture is damaged: {reason(problem)}", "copy or write it again")


def header_view(name: str, part: FilePart, path: Path) -> View:
    """Return what a part's header declares of a view: a `View` of one black pixel."""
    return _view(name, part.groups[name], np.zeros((1, 1, 3), np.float32), part.spec, path)


def _views(
    picture: OpenImageIO.ImageInput, part: FilePart, chosen: Collection[str], region: Region | Part | None, path: Path
) -> Iterator[View]:
    """Yield the views of one part that were chosen."""
    spec = part.spec
    groups = {name: indices for name, indices in part.groups.items() if name in chosen}
    if not groups:
        return
    if callable(region):
        region = region((spec.full_width, spec.full_height))
    wanted = region or Region(0, 0, spec.full_width, spec.full_height)
    if not wanted.is_within(spec.full_width, spec.full_height):
        size = f"{spec.full_width} × {spec.full_height} px"
        raise StimulusError.at(path, f"the picture is {size} and holds no {wanted}", "build the stimuli again")
    pixels = {name: _black(name, wanted, spec, path) for name in groups}
    for first, last in _bands(spec, region):
        for run in channel_runs(groups.values()):
            stored = _read(picture, part.number, spec, (first, last), run)
            if stored is None:
                problem = reason(text_of(picture.geterror))
                refuse_undecoded(path, f"the picture is damaged: {problem}", "copy or write it again")
            window = Region(spec.x - spec.full_x, first - spec.full_y, spec.width, last - first)
            for name, indices in groups.items():
                for place, index in enumerate(indices):
                    if index in run:
                        _put(pixels[name][..., place], wanted, stored[..., index - run.start], window)
    for name, indices in groups.items():
        yield _view(name, indices, pixels.pop(name), spec, path)


def channel_runs(groups: Iterable[Sequence[int]]) -> list[range]:
    """Return the runs of channels to read for those of ``groups``: each read decompresses the others beside them again.

    What lies between two channels is read with them, as long as it is no more than the channels that are wanted.
    """
    wanted = sorted({index for group in groups for index in group})
    runs = [range(wanted[0], wanted[0] + 1)]
    for index in wanted[1:]:
        if index - runs[-1].stop <= len(wanted):
            runs[-1] = range(runs[-1].start, index + 1)
        else:
            runs.append(range(index, index + 1))
    return runs


def _bands(spec: OpenImageIO.ImageSpec, region: Region | None) -> Iterator[tuple[int, int]]:
    """Yield the first row and the first not to read of some rows of the file at a time, whole blocks of it."""
    first, last = _rows(spec, None if is_reconstructed(spec) else region)
    rows = spec.tile_height or _BLOCK_ROWS
    step = last - first if is_reconstructed(spec) else max(1, _BAND_PIXELS // (rows * max(spec.width, 1))) * rows
    # Blocks are counted from the first row of the file.
    at = first
    while at < last:
        stop = min(spec.y + ((at - spec.y) // step + 1) * step, last)
        yield at, stop
        at = stop


def _rows(spec: OpenImageIO.ImageSpec, region: Region | None) -> tuple[int, int]:
    """Return the first row of the file to read for ``region`` and the first not to read, counted as the file does.

    Of a tiled file, they are those of whole tiles.
    """
    bottom = spec.y + spec.height
    if region is None:
        return spec.y, bottom
    tile = spec.tile_height or 1
    first = max(spec.full_y + region.top, spec.y)
    last = min(spec.full_y + region.bottom, bottom)
    return first - (first - spec.y) % tile, min(last + (spec.y - last) % tile, bottom)


def _read(
    picture: OpenImageIO.ImageInput, part: int, spec: OpenImageIO.ImageSpec, rows: tuple[int, int], channels: range
) -> NDArray[Any] | None:
    """Return ``rows``, from the first to the first not to read, of some channels; None if they cannot be read."""
    first, last = rows
    if is_reconstructed(spec):
        return picture.read_image(part, 0, channels.start, channels.stop, "float")
    if spec.tile_width:
        columns = spec.x, spec.x + spec.width
        return picture.read_tiles(part, 0, *columns, first, last, 0, 1, channels.start, channels.stop, "float")
    return picture.read_scanlines(part, 0, first, last, 0, channels.start, channels.stop, "float")


def _black(name: str, wanted: Region, spec: OpenImageIO.ImageSpec, path: Path) -> NDArray[np.float32]:
    """Return black pixels for the ``wanted`` region of a view; StimulusError if the file stores nothing of the view."""
    left, top = spec.x - spec.full_x, spec.y - spec.full_y
    right, bottom = min(left + spec.width, spec.full_width), min(top + spec.height, spec.full_height)
    if right <= max(left, 0) or bottom <= max(top, 0):
        raise StimulusError.at(path, f"the view '{name}' stores nothing of its display window", "crop or pad it")
    return np.zeros((wanted.height, wanted.width, 3), dtype=np.float32)


def _put(pixels: NDArray[np.float32], wanted: Region, stored: NDArray[Any], window: Region) -> None:
    """Put the channel that is ``stored`` of ``window`` into ``pixels``, a channel of the ``wanted`` region."""
    columns = max(window.left, wanted.left), min(window.right, wanted.right)
    rows = max(window.top, wanted.top), min(window.bottom, wanted.bottom)
    if columns[0] < columns[1] and rows[0] < rows[1]:
        there = slice(*(row - wanted.top for row in rows)), slice(*(column - wanted.left for column in columns))
        here = slice(*(row - window.top for row in rows)), slice(*(column - window.left for column in columns))
        pixels[there] = stored[here]


def _refuse_size(path: Path, spec: OpenImageIO.ImageSpec) -> None:
    if spec.deep:
        raise StimulusError.at(path, "the picture is deep", "flatten it")
    for width, height in ((spec.width, spec.height), (spec.full_width, spec.full_height)):
        if not 0 < width * height <= MAX_PIXELS:
            raise StimulusError.at(path, f"a view of {width} × {height} pixels is beyond {MAX_PIXELS}", "crop it")
    refuse_many_values(path, spec, MAX_VALUES)
    if spec.nchannels > MAX_CHANNELS:
        raise StimulusError.at(
            path, f"the picture has {spec.nchannels} channels, more than {MAX_CHANNELS}", "keep R, G and B"
        )


def refuse_many_values(path: Path, spec: OpenImageIO.ImageSpec, most: int) -> None:
    """Raise StimulusError if a part has more than ``most`` values: all are decompressed, whichever are wanted."""
    if spec.width * spec.height * spec.nchannels > most:
        size = f"{spec.width} × {spec.height} pixels of {spec.nchannels} channels"
        raise StimulusError.at(path, f"the picture has {size}, more than {most} values", "keep R, G and B")


def _groups(spec: OpenImageIO.ImageSpec, path: Path) -> dict[str, tuple[int, int, int]]:
    """Return, per view of one part, the indices of its three colour channels, or three times that of its luminance."""
    listed = [_spelling(name) for name in _strings(spec.getattribute("multiView"))]
    if len(set(listed)) != len(listed):
        raise StimulusError.at(path, f"multiView lists a view twice: {', '.join(listed)}", "name each view once")
    view_of_all = spec.getattribute("view")
    unprefixed = listed[0] if listed else _spelling(view_of_all if isinstance(view_of_all, str) else "")
    if not listed and not unprefixed:
        _refuse_unlisted(spec, path)
    channels_by_view: dict[str, dict[str, int]] = {}
    for index, channel in enumerate(spec.channelnames):
        prefix, _, base = channel.rpartition(".")
        view = _spelling(prefix) if prefix else unprefixed
        if not prefix or view in listed:
            channels_by_view.setdefault(view, {}).setdefault(base, index)
    groups = {}
    for view, channels in channels_by_view.items():
        for colours in _COLOURS:
            if all(colour in channels for colour in colours):
                groups[view] = (channels[colours[0]], channels[colours[1]], channels[colours[2]])
                break
        else:
            if "Y" in channels and not _OF_COLOURS & channels.keys():
                groups[view] = (channels["Y"],) * 3
    for view in listed:
        if view not in groups:
            raise StimulusError.at(path, f"the view '{view}' lacks a channel of R, G, B", "write all three")
    return groups


def _refuse_unlisted(spec: OpenImageIO.ImageSpec, path: Path) -> None:
    """Refuse layers that are named as eyes: they may be views, or the light of two lamps."""
    layers = {_spelling(name.rpartition(".")[0]) for name in spec.channelnames}
    if found := [eye for eye in _EYES if eye in layers]:
        message = f"it has layers named {' and '.join(found)}, and no attribute multiView says that they are views"
        remedy = "list the views in the attribute multiView, such as left, right; or give the layers other names"
        raise StimulusError.at(path, message, remedy)


def _view(
    name: str, indices: Sequence[int], pixels: NDArray[np.float32], spec: OpenImageIO.ImageSpec, path: Path
) -> View:
    chromaticities = declared_chromaticities(spec, path)
    if spec.channelnames[indices[1]].rpartition(".")[2] == "RY":
        pixels = rgb_of(pixels, chromaticities, path)
    formats = spec.channelformats or (spec.format,) * spec.nchannels
    white = numbers(spec, "whiteLuminance", 1, path)
    return View(
        name=name,
        pixels=pixels,
        chromaticities=chromaticities,
        is_xyz=spec.channelnames[indices[0]].rpartition(".")[2] == "X",
        white_luminance_cd_m2=None if white is None else float(white[0]),
        data_window_px=(spec.x - spec.full_x, spec.y - spec.full_y, spec.width, spec.height),
        size_px=(spec.full_width, spec.full_height),
        observer=declared_observer(spec, path),
        exact=spec.getattribute(EXACT_ATTRIBUTE) == 1,
        half=all(str(formats[index]) == "half" for index in indices),
    )


def _strings(value: Any) -> list[str]:
    if value is None:
        return []
    return [str(part) for part in value] if isinstance(value, (tuple, list)) else [str(value)]


def _spelling(name: str) -> str:
    name = name.lower()
    return _SPELLINGS.get(name, name)
