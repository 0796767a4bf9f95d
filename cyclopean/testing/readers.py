"""The promises of every reader of measurements, tried on one: whatever a file holds is readings, or a clear error."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random

import numpy as np
from numpy.typing import ArrayLike

from cyclopean.testing.promises import kept
from devices.readings import READERS, Measurements, read_measurements
from documents import InputError
from documents.files import read_regular

_CUTS, _CHANGES = 120, 200
_MOST_BYTES = 100_000_000
_NUMBER = re.compile(rb"(?<![\w.#])\d+\.\d+(?![\w.])")


def prove_reader(
    file: str | Path,
    codes: ArrayLike,
    XYZ_cd_m2: ArrayLike,
    *,
    reader: Callable[[Path], Measurements] | None = None,
) -> tuple[str, ...]:
    """Prove that a reader of measurements keeps what the program promises of every reader.

    The file is read as `devices.readings.read_measurements` reads it, and so are copies of it: cut short anywhere, with
    bytes changed, and, where it is a text, with words in the place of numbers. Each is readings, or an InputError whose
    findings name the file, the line of a wrong word, and what would be right.

    Parameters
    ----------
    file
        A file that it reads.
    codes
        The device codes that are in the file, shape (n, 3), in 0..1.
    XYZ_cd_m2
        The light that is in it, shape (n, 3), in cd/m².
    reader
        The reader, where its package is not installed: of files whose name ends as this one's.

    Returns
    -------
    tuple of str
        The promises that it kept.

    Raises
    ------
    BrokenPromiseError
        If a promise is not kept.
    InputError
        If the file cannot be read.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "readings.csv")
    ...     _ = file.write_text("R,G,B,X,Y,Z\\n0,0,0,0.1,0.1,0.1\\n1,1,1,95.2,100.1,109.3\\n")
    ...     proved = prove_reader(file, [[0, 0, 0], [1, 1, 1]], [[0.1, 0.1, 0.1], [95.2, 100.1, 109.3]])
    >>> "a file that is cut short is readings or an error" in proved
    True
    """
    tried = _Tried(Path(file), np.asarray(codes, float), np.asarray(XYZ_cd_m2, float))
    with READERS.trying(tried.file.suffix[1:].lower(), reader):
        return kept(
            {
                "what the file holds are the readings": tried.right,
                "the file stays as it is": tried.unchanged,
                "a file that is cut short is readings or an error": tried.cut,
                "a file with other bytes is readings or an error": tried.changed,
                "a word in place of a number is named with its line": tried.words,
                "what is no such file is an error": tried.others,
            }
        )


class _Tried:
    """A file, and copies of it beside it that are harmed; each attempt returns what broke."""

    def __init__(self, file: Path, codes: np.ndarray, XYZ: np.ndarray) -> None:
        self.file, self._codes, self._XYZ = file, codes, XYZ
        self._content = read_regular(file, _MOST_BYTES)
        self._harmed = file.with_name(f"harmed{file.suffix}")

    def _read(self, content: bytes) -> Measurements | InputError:
        self._harmed.write_bytes(content)
        try:
            return read_measurements(self._harmed)
        except InputError as error:
            return error
        finally:
            self._harmed.unlink()

    def right(self) -> str | None:
        found = read_measurements(self.file)
        for what, got, wanted in (("codes", found.codes, self._codes), ("XYZ", found.XYZ, self._XYZ)):
            if got.shape != wanted.shape or not np.allclose(got, wanted, rtol=1e-6, atol=1e-9):
                return f"{what} are {got.tolist()} in place of {wanted.tolist()}"
        return None

    def unchanged(self) -> str | None:
        read_measurements(self.file)
        return None if read_regular(self.file, _MOST_BYTES) == self._content else f"{self.file.name} was written to"

    def cut(self) -> str | None:
        step = max(1, len(self._content) // _CUTS)
        return self._first_unclear(
            (f"cut at byte {at}", self._content[:at]) for at in range(0, len(self._content), step)
        )

    def changed(self) -> str | None:
        return self._first_unclear(self._changes())

    def _changes(self) -> Iterator[tuple[str, bytes]]:
        rng = Random(1)
        for _ in range(_CHANGES):
            at, value = rng.randrange(len(self._content)), rng.randrange(256)
            yield f"byte {at} as {value}", self._content[:at] + bytes([value]) + self._content[at + 1 :]

    def words(self) -> str | None:
        for number in _NUMBER.finditer(self._content) if self._is_text() else ():
            content = self._content[: number.start()] + b"word" + self._content[number.end() :]
            line = content[: number.start()].count(b"\n") + 1
            found = self._read(content)
            if isinstance(found, InputError) and all(fault.line != line for fault in found.findings):
                return f"'word' for {number[0].decode()} on line {line}: {found}"
            if isinstance(found, Measurements) and not self._holds(found):
                return f"'word' for {number[0].decode()} on line {line} was read"
        return None

    def others(self) -> str | None:
        for what, content in {"an empty file": b"", "noise": Random(2).randbytes(4000), "a text": b"a text\n"}.items():
            if not isinstance(found := self._read(content), InputError):
                return f"{what} was read as {len(found.codes)} readings"
        return self._first_unclear([("noise", Random(3).randbytes(4000))])

    def _holds(self, found: Measurements) -> bool:
        """Return whether what was read is of the file as it is, or lacks some of it."""
        return all(any(np.allclose(row, own) for own in self._XYZ) for row in found.XYZ)

    def _is_text(self) -> bool:
        return self._content.isascii() and b"\0" not in self._content

    def _first_unclear(self, harmed: Iterator[tuple[str, bytes]] | list[tuple[str, bytes]]) -> str | None:
        """Return how the first file was harmed whose error does not name it, or what would be right."""
        for how, content in harmed:
            found = self._read(content)
            for fault in found.findings if isinstance(found, InputError) else ():
                if not (fault.file or "").startswith(str(self._harmed)) or not fault.remedy:
                    return f"{how}: '{fault}' has {'no remedy' if fault.file else 'no file'}"
        return None
