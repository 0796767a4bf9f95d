"""Promises tried in turn, and what is raised where one is not kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from documents import InputError


class BrokenPromiseError(AssertionError):
    """A promise that an extension does not keep: which one, and what was seen."""


def must(holds: bool, promise: str, seen: str) -> None:
    """Raise BrokenPromiseError unless a promise holds."""
    if not holds:
        raise BrokenPromiseError(f"{promise}: {seen}")


def kept(promises: Mapping[str, Callable[[], str | None]]) -> tuple[str, ...]:
    """Try promises in turn, each of which returns what was seen where it is broken, and return them.

    Raises
    ------
    BrokenPromiseError
        If one is broken, or raises what is no InputError.
    """
    for promise, attempt in promises.items():
        try:
            seen = attempt()
        except InputError:
            raise
        except Exception as error:
            raise BrokenPromiseError(f"{promise}: {type(error).__name__}: {error}") from error
        must(seen is None, promise, str(seen))
    return tuple(promises)
