"""The files of an ordinary picture as they are, kept in place of its codes: a twentieth of their bytes.

Only JPEG (MPO and JPS among it): its codes are decoded in the time that reading their bytes from a disk takes. What is
decoded from the bytes that were kept is what was decoded from the file itself, by the same functions.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from documents import in_threads
from documents.files import read_regular
from stimuli.errors import StimulusError
from stimuli.pictures.packing import PACKINGS, Packing, unpacked
from stimuli.pictures.picture_header import PictureHeader, read_header
from stimuli.pictures.picture_input import MAX_BYTES
from stimuli.pictures.picture_pixels import Pixels, decode
from stimuli.pictures.stereo_image import Eye

_DECODERS = ("OpenImageIO", "pillow")
_EYES = ("left", "right")
Item = TypeVar("Item")


@cache
def decoders() -> Mapping[str, str]:
    """Return the versions of the libraries that decode ordinary pictures: other ones might give other codes."""
    return {name: version(name) for name in _DECODERS}


def decoded_eyes(headers: Sequence[PictureHeader], packing: Packing | None, eye: Eye | None) -> list[Pixels]:
    """Return the pixels that both eyes see, left first, or those of one: of ``eye``, or of a file of one view.

    Parameters
    ----------
    headers
        Of one file, of one view or both, or of the left and the right eye's.
    packing
        How both eyes lie in one file; None of a file for each eye and of a file of one view or two frames.
    eye
        The eye whose picture alone is wanted, of a pair.

    Returns
    -------
    list
        Codes or floats, (height, width, channels).

    Raises
    ------
    StimulusError
        If a file cannot be decoded.
    """
    wanted = of_eye(headers, eye)
    eyes = [decode(header) for header in wanted]
    if wanted[0].frames == 2:
        eyes.append(decode(wanted[0], frame=1))
    elif packing is not None:
        eyes = list(unpacked(eyes[0], packing))
    return list(of_eye(eyes, eye))


def of_eye(both: Sequence[Item], eye: Eye | None) -> Sequence[Item]:
    """Return the item of ``eye`` alone, of two; all of them if there are not two, or no eye is named."""
    if eye is None or len(both) < 2:
        return both
    return both[:1] if eye == "left" else both[1:]


@dataclass(frozen=True, eq=False, slots=True)
class OwnFiles:
    """The bytes of a picture's files, and how its codes lie in them.

    ``frames`` is 2 of an MPO of both eyes; ``packing`` and ``eye`` are as `decoded_eyes` wants.
    """

    files: tuple[bytes, ...]
    frames: int
    packing: Packing | None
    eye: Eye | None

    @property
    def size(self) -> int:
        """Bytes of all files."""
        return sum(len(data) for data in self.files)

    def decoded(self) -> list[Pixels]:
        """Return the pixels, as `decoded_eyes` does; two files are decoded side by side."""
        with TemporaryDirectory(prefix="cyclopean-") as folder:
            # OpenImageIO reads files that have a name.
            paths = [Path(folder, f"{number}.jpg") for number in range(len(self.files))]
            eyes = in_threads(lambda file: self._eyes_of(*file), zip(paths, self.files, strict=True))
        return [pixels for each in eyes for pixels in each]

    def _eyes_of(self, path: Path, data: bytes) -> list[Pixels]:
        path.write_bytes(data)
        header = replace(read_header(path, self.packing or "none"), frames=self.frames)
        return decoded_eyes([header], self.packing, self.eye)

    def arrays(self) -> Iterator[NDArray[np.uint8]]:
        """Yield what `of_arrays` makes the same of again: how the codes lie in the files, and each file's bytes."""
        how = {"frames": self.frames, "packing": self.packing, "eye": self.eye}
        for data in (json.dumps({"files": len(self.files)} | how).encode(), *self.files):
            yield np.frombuffer(data, np.uint8)

    @classmethod
    def of_arrays(cls, arrays: Iterator[NDArray[Any]]) -> OwnFiles:
        """Return what was made into ``arrays``; ValueError, KeyError or TypeError if it was not."""
        how = json.loads(next(arrays).tobytes())
        files = tuple(next(arrays).tobytes() for _ in range(int(how["files"])))
        if not 1 <= len(files) <= 2 or how["packing"] not in (None, *PACKINGS) or how["eye"] not in (None, *_EYES):
            raise ValueError("it does not say how its files are decoded")
        return cls(files, int(how["frames"]), how["packing"], how["eye"])


def own_files(headers: Sequence[PictureHeader], packing: Packing | None, eye: Eye | None) -> OwnFiles | None:
    """Return the files of a picture, to be kept in place of its codes, or None if these are quicker to read.

    Raises
    ------
    StimulusError
        If a file cannot be read.
    """
    wanted = of_eye(headers, eye)
    if any(header.kind != "jpeg" for header in wanted):
        return None
    files = tuple(read_regular(header.path, MAX_BYTES, "picture", error=StimulusError) for header in wanted)
    return OwnFiles(files, wanted[0].frames, packing, eye)


def stamps(headers: Sequence[PictureHeader], eye: Eye | None) -> tuple[tuple[int, int], ...]:
    """Return size and time of change of each file: equal ones before and after show that it was not written to."""
    stats = [header.path.stat() for header in of_eye(headers, eye)]
    return tuple((stat.st_size, stat.st_mtime_ns) for stat in stats)
