"""What the project installs is pinned, hashed, licensed and looked up; what it never calls stands nowhere."""

from __future__ import annotations

import ast
import json
import os
import re
import stat
import subprocess
import sys
import tomllib
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.kept import known

ROOT = Path(__file__).parents[2]
PACKAGES = ("documents", "devices", "stimuli", "analysis", "runner", "extensions", "cyclopean")
FILES = sorted((ROOT / "requirements").glob("*.txt"))


def tool(name: str) -> ModuleType:
    """Import a script of tools/."""
    spec = known(spec_from_file_location(name, ROOT / "tools" / f"{name}.py"))
    module = module_from_spec(spec)
    known(spec.loader).exec_module(module)
    return module


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_every_package_has_one_version_and_hashes(file: Path) -> None:
    packages = re.split(r"(?m)^(?=[A-Za-z0-9])", file.read_text(encoding="utf-8"))[1:]
    assert packages
    for package in packages:
        requirement, *hashes = package.rstrip("\n").split(" \\\n")
        assert [part.operator for part in Requirement(requirement).specifier] == ["=="], requirement
        assert hashes, requirement
        assert all(re.fullmatch(r" +--hash=sha256:[0-9a-f]{64}", line) for line in hashes), requirement


def test_what_the_project_asks_for_is_pinned_at_a_version_that_it_takes() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for file in FILES:
        extra = project["optional-dependencies"][file.stem]
        asked = [*(project["dependencies"] if file.stem == "dev" else []), *extra]
        pinned = {canonicalize_name(n): v for f in (ROOT / "requirements/dev.txt", file) for n, v in pins(f)}
        for text in asked:
            requirement = Requirement(text)
            assert pinned[canonicalize_name(requirement.name)] in requirement.specifier, (file.name, text)


def pins(file: Path) -> list[tuple[str, str]]:
    """Return names and versions in a file."""
    return re.findall(r"(?m)^([A-Za-z0-9_.-]+)==([^\s;\\]+)", file.read_text(encoding="utf-8"))


def test_every_licence_is_allowed_and_listed() -> None:
    licences = tool("licences")
    page = (ROOT / "docs/licences.md").read_text(encoding="utf-8")
    rows = [row.strip("| ").split(" | ") for row in page.splitlines() if row.startswith("| ")][1:]
    listed = {name: licence for name, _, licence, _ in rows}
    assert [(name, version) for name, version, *_ in rows] == sorted(licences.pinned().items())
    for name, licence in listed.items():
        package = licences.installed(name)
        if package is not None:
            assert all(part in licences.ALLOWED for part in licences.parts(licences.licence(package))), name
        assert all(part in licences.ALLOWED for part in licences.parts(licence)), name


ANSWERS = {
    "nothing is known": ([{"name": "click", "version": "8", "vulns": []}], 0, "1 packages looked up, 0 known"),
    "a fault is known": (
        [{"name": "click", "version": "8", "vulns": [{"id": "CVE-1", "fix_versions": ["9"]}]}],
        1,
        "click 8: CVE-1, mended in 9",
    ),
    "no index": ([{"name": "click", "skip_reason": "not found"}], 3, "note: 1 could not be looked up"),
    "no answer": (None, 3, "was not audited: no route to host"),
}


@pytest.mark.skipif(os.name == "nt", reason="the fake program is a shell script")
@pytest.mark.parametrize("case", ANSWERS)
def test_an_audit_that_looked_nothing_up_says_so(tmp_path: Path, case: str) -> None:
    packages, status, said = ANSWERS[case]
    program, answer = tmp_path / "pip-audit", tmp_path / "answer"
    answer.write_text("" if packages is None else json.dumps({"dependencies": packages}))
    program.write_text(f"#!/bin/sh\ncat '{answer}'\necho 'no route to host' >&2\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    command = [sys.executable, str(ROOT / "tools/audit.py"), str(program), "dev.txt"]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", check=False)
    assert (done.returncode, said in done.stdout) == (status, True), done.stdout


# Names that run what a file says, by module; ruff's S rules see some of these, under some of their names.
NEVER = {
    "": {"eval", "exec", "compile", "__import__"},
    "os": {"system", "popen"},
    "yaml": {"load", "load_all", "full_load", "unsafe_load", "Loader", "FullLoader", "UnsafeLoader"},
    "tempfile": {"mktemp"},
}
MODULES = {"pickle", "cPickle", "_pickle", "dill", "cloudpickle", "joblib", "marshal", "shelve", "telnetlib", "ftplib"}
# pickled objects go through pipes between processes of one run (multiprocessing), never through a file
KEYWORDS = {("allow_pickle", True), ("shell", True)}


# A text without any of them is not parsed, which takes long.
_DOTTED = [f"{module}[.]{name}" for module, names in NEVER.items() if module for name in names]
RISKY = re.compile(
    rf"(?<![.\w])({'|'.join(NEVER[''])})\(|\b(allow_pickle|shell)=|from (os|yaml|tempfile) "
    rf"|\b({'|'.join([*_DOTTED, *MODULES])})\b"
)


def faults(text: str) -> list[str]:
    """Return what a module calls or imports that could run what a file or a name says."""
    wrong: list[str] = []
    for node in ast.walk(ast.parse(text)) if RISKY.search(text) else ():
        if isinstance(node, ast.Import):
            wrong += [alias.name for alias in node.names if alias.name.split(".")[0] in MODULES]
        elif isinstance(node, ast.ImportFrom):
            wrong += [str(node.module)] if str(node.module).split(".")[0] in MODULES else []
            wrong += [alias.name for alias in node.names if alias.name in NEVER.get(str(node.module), ())]
        elif isinstance(node, ast.Call):
            called = node.func
            if isinstance(called, ast.Name) and called.id in NEVER[""]:
                wrong.append(called.id)
            for keyword in node.keywords:
                value = keyword.value.value if isinstance(keyword.value, ast.Constant) else None
                wrong += [f"{keyword.arg}={value!r}"] if (keyword.arg, value) in KEYWORDS else []
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            wrong += [f"{node.value.id}.{node.attr}"] if node.attr in NEVER.get(node.value.id, ()) else []
    return wrong


@pytest.mark.parametrize("package", PACKAGES)
def test_nothing_runs_what_a_file_says(package: str) -> None:
    wrong = {
        str(file.relative_to(ROOT)): found
        for file in sorted((ROOT / package).rglob("*.py"))
        if (found := faults(file.read_text(encoding="utf-8")))
    }
    assert not wrong


@pytest.mark.parametrize(
    "code",
    [
        "import pickle",
        "from dask import x, y\nfrom cloudpickle import loads",
        "eval(text)",
        "import yaml\nyaml.load(text)",
        "from yaml import load",
        "import numpy as np\nnp.load(file, allow_pickle=True)",
        "subprocess.run(text, shell=True)",
        "import os\nos.system(text)",
    ],
)
def test_what_is_never_called_would_be_seen(code: str) -> None:
    assert faults(code)


def test_consoles_are_made_in_one_place() -> None:
    """Where text is cleaned; click's styles would be cleaned away with what names contain."""
    wrong = [
        str(file.relative_to(ROOT))
        for package in PACKAGES
        for file in (ROOT / package).rglob("*.py")
        if file.name not in ("console.py", "run.py")
        and file.relative_to(ROOT).as_posix() != "documents/text/terminal.py"
        for line in file.read_text(encoding="utf-8").splitlines()
        if re.search(r"(?<![A-Za-z])Console\(|click\.(style|secho)\(", line) and ">>>" not in line and "..." not in line
    ]
    assert not wrong, "use clean_console and say of documents.text"
