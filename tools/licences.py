"""Write docs/licences.md: the licence of every package that `make` installs, as its own metadata states it.

    python tools/licences.py [--check]

With `--check` nothing is written: the exit status is 1 if the page is not what would be written, or a licence is not
one of `ALLOWED`, which all let a lab use, change and pass on the program.
"""

from __future__ import annotations

import re
import sys
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs/licences.md"
ALLOWED = frozenset(
    {"0BSD", "Apache-2.0", "BSD", "BSD-2-Clause", "BSD-3-Clause", "CC0-1.0", "MIT", "MIT-CMU", "MPL-2.0", "PSF-2.0"}
    | {"Apache-2.0 WITH LLVM-exception", "MIT-0", "Zlib"}
)
# What metadata says in place of an identifier: in words, in a classifier, or in the whole text.
_WORDS = {
    "apache 2.0": "Apache-2.0",
    "apache software license": "Apache-2.0",
    "bsd 2-clause license": "BSD-2-Clause",
    "bsd license": "BSD",
    "mit license": "MIT",
    "mozilla public license 2.0 (mpl 2.0)": "MPL-2.0",
    "python software foundation license": "PSF-2.0",
}
HEAD = """\
# Which licences have the packages that it needs?

cyclopean is under the BSD licence of three clauses ([LICENSE](../LICENSE)). The packages that `make` installs, in the
versions of `requirements/dev.txt`, are under the licences that their own metadata states; `make licences` writes this
page, and a test refuses a licence that is not one of {allowed}. All of them
let you use, change and pass on the program, also in a company. MPL-2.0 asks that changes of the package's own files are
passed on with their source.

Wheels also contain compiled libraries with licences of their own, which each states in its `.dist-info` folder: LibRaw
(LGPL-2.1 or CDDL-1.0) in rawpy, FFmpeg (LGPL-2.1) in opencv-python-headless, OpenBLAS and the GCC runtime in NumPy and
SciPy.

**runs**: cyclopean needs the package to run. **develops**: it tests and checks the project, or belongs to an extra.

| package | version | licence | for |
|---|---|---|---|
"""


def pinned() -> dict[str, str]:
    """Return the version of each package of requirements/dev.txt; of several, the newest Python's."""
    lines = (ROOT / "requirements/dev.txt").read_text(encoding="utf-8").splitlines()
    return {match[1]: match[2] for line in lines if (match := re.match(r"([A-Za-z0-9_.-]+)==([^\s;\\]+)", line))}


def licence(package: Distribution) -> str:
    """Return a package's licence as its metadata states it, by the identifiers of SPDX where they are known."""
    meta = package.metadata
    classifiers = [
        text.split("::")[-1].strip() for text in meta.get_all("Classifier", []) if text.startswith("License")
    ]
    stated = [meta.get("License-Expression"), meta.get("License"), *classifiers]
    for text in stated:
        words = _WORDS.get((text or "").strip().lower(), (text or "").strip())
        if words and all(part in ALLOWED for part in parts(words)):
            return words
    return next((text.strip().splitlines()[0][:60] for text in stated if text and text.strip()), "not stated")


def parts(expression: str) -> list[str]:
    """Return the licences that an expression names."""
    return [part for part in re.split(r"\s+(?:AND|OR)\s+|[()]", expression) if part]


def needed_to_run() -> set[str]:
    """Return the packages without which cyclopean does not run, by their canonical names."""
    import tomllib

    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    waiting, known = [Requirement(text) for text in project["dependencies"]], set[str]()
    while waiting:
        requirement = waiting.pop()
        name = canonicalize_name(requirement.name)
        if name in known or (requirement.marker and not requirement.marker.evaluate({"extra": ""})):
            continue
        known.add(name)
        waiting += [Requirement(text) for text in installed(name).requires or []] if installed(name) else []
    return known


def installed(name: str) -> Distribution | None:
    """Return the package as it is installed here, if it is."""
    try:
        return distribution(name)
    except PackageNotFoundError:
        return None


def rows(before: str) -> list[str]:
    """Return the table's rows; a package that is not installed here, as on another system, keeps its row."""
    kept = {line.split(" | ")[0].removeprefix("| "): line for line in before.splitlines() if line.startswith("| ")}
    runs, made = needed_to_run(), []
    for name, version in sorted(pinned().items()):
        package = installed(name)
        if package is None:
            made.append(kept.get(name, f"| {name} | {version} | not installed here | develops |"))
            continue
        use = "runs" if canonicalize_name(name) in runs else "develops"
        made.append(f"| {name} | {version} | {licence(package)} | {use} |")
    return made


def main() -> int:
    """Write or check the page."""
    before = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    names = ", ".join(sorted(ALLOWED))
    text = HEAD.format(allowed=names) + "\n".join(rows(before)) + "\n"
    refused = [row for row in rows(before) if not all(part in ALLOWED for part in parts(row.split(" | ")[2]))]
    refused = [row for row in refused if installed(row.split(" | ")[0].removeprefix("| "))]
    for row in refused:
        print(f"{PAGE.name}: not an allowed licence: {row}", file=sys.stderr)
    if "--check" not in sys.argv:
        PAGE.write_text(text, encoding="utf-8", newline="\n")
    elif text != before:
        print(f"{PAGE.name} is not what is installed: run make licences", file=sys.stderr)
        return 1
    return 1 if refused else 0


if __name__ == "__main__":
    sys.exit(main())
