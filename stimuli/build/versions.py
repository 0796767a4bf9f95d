"""The versions of what pictures are made with, for a manifest."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

_PACKAGES = ("cyclopean", "numpy", "scipy", "OpenImageIO", "rawpy")


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that are installed."""
    import platform

    found = {"python": platform.python_version()}
    for package in _PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found
