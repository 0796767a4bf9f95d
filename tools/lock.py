"""Write requirements/*.txt: every package that `make` installs, at one version, with the SHA-256 of each of its files.

    python tools/lock.py UV [--upgrade]

UV is the program that resolves, for Python 3.11 and newer on Linux, macOS and Windows at once. Versions in the files
stay unless pyproject.toml asks for others, or `--upgrade` is given. `make lock` calls this. The other files have what
dev.txt has not.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "requirements"
EXTRAS = ("bench", "vdp", "audit")  # of pyproject.toml; each has a file of its own, and dev.txt is installed first
HEADER = "# Written by `make lock`. Installed with: pip install --require-hashes --no-deps -r requirements/{}.txt\n"
ALSO = "hatchling>=1.25\neditables>=0.5\n"  # what pip needs to install the checkout itself


def blocks(text: str) -> dict[str, str]:
    """Return the lines of each package, by its name, version and marker."""
    parts = re.split(r"(?m)^(?=[A-Za-z0-9])", text)
    return {part.splitlines()[0].rstrip(" \\"): part for part in parts if not part.startswith("#") and part.strip()}


def resolved(uv: str, extras: tuple[str, ...], before: str, upgrade: bool) -> dict[str, str]:
    """Return what the project needs with ``extras``, near the versions in ``before``."""
    out = FOLDER / ".resolving.txt"
    also = FOLDER / ".also.in"
    also.write_text(ALSO, encoding="utf-8")
    out.write_text(before, encoding="utf-8")
    options = [
        "--universal",
        "--python-version",
        "3.11",
        "--generate-hashes",
        "--no-annotate",
        "--no-header",
        "--quiet",
    ]
    chosen = [word for extra in extras for word in ("--extra", extra)] + ["--upgrade"] * upgrade
    files = [str(ROOT / "pyproject.toml"), str(also), "-o", str(out)]
    try:
        subprocess.run([uv, "pip", "compile", *files, *options, *chosen], check=True, cwd=ROOT)
        return blocks(out.read_text(encoding="utf-8"))
    finally:
        out.unlink()
        also.unlink()


def written(name: str) -> str:
    """Return what a file has now."""
    file = FOLDER / f"{name}.txt"
    return file.read_text(encoding="utf-8") if file.exists() else ""


def main() -> None:
    """Write the files."""
    uv, upgrade = sys.argv[1], "--upgrade" in sys.argv
    FOLDER.mkdir(exist_ok=True)
    dev = resolved(uv, ("dev",), written("dev"), upgrade)
    everything = "".join(dev.values())
    (FOLDER / "dev.txt").write_text(HEADER.format("dev") + everything, encoding="utf-8")
    for extra in EXTRAS:
        own = resolved(uv, ("dev", extra), everything + written(extra), False)
        text = "".join(part for name, part in own.items() if name not in dev)
        (FOLDER / f"{extra}.txt").write_text(HEADER.format(extra) + text, encoding="utf-8")


if __name__ == "__main__":
    main()
