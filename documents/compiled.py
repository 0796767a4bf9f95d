"""Loops that Numba compiles, where it is installed and there is so much to do that its start is worth it.

NumPy works through whole arrays, one operation after another, and so waits for memory. A compiled loop does all that is
to be done with a number while the processor has it at hand. Each such loop has a twin in NumPy that does the same, is
tested against it, and works where Numba, of the extra ``fast``, is not installed.

Modules of loops have names that end in ``_loops``, take constants from modules of their own folder only, and are loaded
by `loops` alone.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from importlib import import_module
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from pathlib import Path
from threading import Lock
from types import ModuleType
from typing import Any, TypeVar, cast

Function = TypeVar("Function", bound=Callable[..., Any])

# A picture of so many pixels is worth the second that Numba takes to start.
_WORTH_PIXELS = 4_000_000

_allowed: ContextVar[bool] = ContextVar("compiled loops", default=True)
_lock = Lock()


def loops(module: str, pixels: int) -> ModuleType | None:
    """Return a module of compiled loops by its name, for a picture of so many ``pixels``; None: do it in NumPy.

    None where Numba is not installed, where `without_compiled_loops` forbids them, and where the picture is small. What
    is compiled is kept beside Python's own compiled files.
    """
    if compiler(pixels) is None:
        return None
    with _lock:
        if module not in sys.modules:
            _forget_what_is_old(module)
        return import_module(module)


def _forget_what_is_old(module: str) -> None:
    """Delete what was compiled before a file of the module's folder changed: its constants are part of it.

    Numba itself looks at the file of the loop alone.
    """
    source = Path(str(cast(ModuleSpec, find_spec(module)).origin))
    changed = max(file.stat().st_mtime_ns for file in source.parent.glob("*.py"))
    for kept in (source.parent / "__pycache__").glob(f"{source.stem}.*.nb[ic]"):
        if kept.stat().st_mtime_ns < changed:
            kept.unlink(missing_ok=True)


def compiler(pixels: int) -> str | None:
    """Return what compiles loops for a picture of so many pixels, such as ``Numba 0.68.1``; None if NumPy does it."""
    return _numba() if pixels >= _WORTH_PIXELS and _allowed.get() else None


@cache
def _numba() -> str | None:
    """Return Numba's name and version; None if it is not installed, or cannot be loaded beside what else is."""
    try:
        import numba
    except Exception:  # such as a version that does not go with this NumPy
        return None
    return f"Numba {numba.__version__}"


@contextmanager
def without_compiled_loops() -> Iterator[None]:
    """Use NumPy alone in the body, and in the threads that help there."""
    before = _allowed.set(False)
    try:
        yield
    finally:
        _allowed.reset(before)


def loop(*signature: str, inline: bool = False) -> Callable[[Function], Function]:
    """Compile a function of a module of loops for the types of ``signature``, as Numba writes them.

    Other threads run while it computes; a quotient by 0 is infinite or NaN, as in NumPy. ``inline`` functions have no
    signature and become part of those that call them.
    """
    import numba

    njit: Any = numba.njit
    options: dict[str, Any] = {"nogil": True, "error_model": "numpy", "boundscheck": False}

    def compiled(function: Function) -> Function:
        if inline:
            return cast(Function, njit(inline="always", **options)(function))
        try:
            return cast(Function, njit(*signature, cache=True, **options)(function))
        except RuntimeError:  # there is no folder in which it could be kept
            return cast(Function, njit(*signature, **options)(function))

    return compiled
