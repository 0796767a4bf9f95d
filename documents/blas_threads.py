"""One thread for the linear algebra of small matrices: OpenBLAS's threads wait for each other longer than they compute.

On a busy machine the threads of one product of 100 × 100 numbers wait for a whole time slice. One thread also makes a
result the same on every number of cores. NumPy and SciPy each bring an OpenBLAS of their own; other libraries, such as
Apple's Accelerate, keep their threads.
"""

from __future__ import annotations

import os
import sys
from collections.abc import MutableMapping
from contextlib import ContextDecorator
from functools import cache
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import ctypes

# A module that is linked with the library, of each package that brings one.
_LINKED = ("numpy.linalg._umath_linalg", "scipy.linalg._flapack")
_VARIABLES = ("OPENBLAS_NUM_THREADS", "GOTO_NUM_THREADS", "OMP_NUM_THREADS")


class _Library(NamedTuple):
    """The functions of one OpenBLAS that return and set its number of threads."""

    get: ctypes._NamedFuncPointer
    set: ctypes._NamedFuncPointer


_lock = Lock()
_lowered: list[tuple[_Library, int]] = []
_depth = 0


def prefer_one_blas_thread(environment: MutableMapping[str, str] = os.environ) -> None:
    """Let this process and those that it starts use one BLAS thread, unless a variable of its user says otherwise.

    Only before NumPy is imported: each library reads the variables when it is loaded.
    """
    if not any(name in environment for name in _VARIABLES):
        environment[_VARIABLES[0]] = "1"


class one_blas_thread(ContextDecorator):
    """Compute with one BLAS thread, as a context or a decorator; afterwards as many as before. For a whole process.

    Contexts may be nested, and open in several threads at once: the last one that closes restores the number.
    """

    __slots__ = ()

    def __enter__(self) -> None:
        global _depth
        with _lock:
            if _depth == 0:
                for library in _libraries():
                    if (before := library.get()) > 1:
                        library.set(1)
                        _lowered.append((library, before))
            _depth += 1

    def __exit__(self, *exception: object) -> None:
        global _depth
        with _lock:
            _depth -= 1
            while _lowered and _depth == 0:
                library, before = _lowered.pop()
                library.set(before)


def blas_threads() -> list[int]:
    """Return the number of threads of each OpenBLAS that is loaded."""
    return [library.get() for library in _libraries()]


def set_blas_threads(number: int) -> None:
    """Let each OpenBLAS that is loaded use so many threads from now on."""
    for library in _libraries():
        library.set(number)


def _libraries() -> list[_Library]:
    found = (_library(module) for module in _LINKED if module in sys.modules)
    return [library for library in found if library]


@cache
def _library(module: str) -> _Library | None:
    """Return the OpenBLAS that a loaded ``module`` is linked with; None if that is another library."""
    import ctypes

    file = Path(str(sys.modules[module].__file__))
    package = file.parents[1]
    folders = (package.with_name(f"{package.name}.libs"), package / ".dylibs")  # of a wheel
    brought = [str(path) for folder in folders for path in folder.glob("*openblas*")]
    for path in (*brought, str(file)):  # the file itself gives what its system's library has
        try:
            loaded = ctypes.CDLL(path)
        except OSError:
            continue
        for name in ("scipy_openblas_{}_num_threads64_", "scipy_openblas_{}_num_threads", "openblas_{}_num_threads"):
            if hasattr(loaded, name.format("set")):
                return _Library(getattr(loaded, name.format("get")), getattr(loaded, name.format("set")))
    return None
