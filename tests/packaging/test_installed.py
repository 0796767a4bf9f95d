"""Away from the checkout: the wheel in an environment of its own, used from an empty folder."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import venv
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from analysis.records import read_session, session_files
from runner.protocol import shipped_experiments
from tests.runner.studies.drawn_pictures import draw_flat

pytestmark = pytest.mark.nightly

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Installed:
    """The environment's program, and the folder that its packages lie in."""

    program: Path
    packages: Path

    def run(self, folder: Path, *arguments: str, of_module: bool = False) -> str:
        """Return what the program prints in ``folder``; it must succeed."""
        python = self.program.with_name("python.exe" if os.name == "nt" else "python")
        command = [python, "-m", "cyclopean"] if of_module else [self.program]
        own = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        done = subprocess.run(
            [*map(str, command), *arguments],
            cwd=folder,
            env={**own, "CYCLOPEAN_CACHE": str(folder / "cache")},
            capture_output=True,
            encoding="utf-8",
            timeout=120,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    def files(self) -> set[Path]:
        """Return every file of the environment's packages, but for compiled ones."""
        return {path for path in self.packages.rglob("*") if "__pycache__" not in path.parts}


def build(source: Path, folder: Path, *targets: str) -> list[Path]:
    """Build distributions of ``source`` into ``folder``, and return them."""
    chosen = [word for target in targets for word in ("-t", target)]
    command = [sys.executable, "-m", "hatchling", "build", "-d", str(folder), *chosen]
    subprocess.run(command, cwd=source, check=True, capture_output=True, timeout=120)
    return sorted(folder.iterdir())


@pytest.fixture(scope="module")
def distributions(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The wheel and the source distribution of the checkout."""
    wheel, source = build(ROOT, tmp_path_factory.mktemp("dist"), "wheel", "sdist")[::-1]
    if wheel.suffix != ".whl":
        wheel, source = source, wheel
    return wheel, source


@pytest.fixture(scope="module")
def installed(distributions: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """The wheel in a fresh environment, which borrows the libraries of this one."""
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder, with_pip=False)
    programs = folder / ("Scripts" if os.name == "nt" else "bin")
    python = programs / ("python.exe" if os.name == "nt" else "python")
    pip = [sys.executable, "-m", "pip", "--python", str(python), "--disable-pip-version-check"]
    subprocess.run(
        [*pip, "install", "--quiet", "--no-index", "--no-deps", "--no-compile", distributions[0]],
        check=True,
        timeout=120,
    )
    packages = next(folder.rglob("cyclopean")).parent if os.name == "nt" else next(folder.rglob("site-packages"))
    # Folders named in a .pth file are searched, but .pth files in them are not read: this checkout stays out.
    borrowed = [path for path in sys.path if Path(path).name in ("site-packages", "dist-packages")]
    (packages / "borrowed.pth").write_text("\n".join(borrowed), encoding="utf-8")
    return Installed(programs / ("cyclopean.exe" if os.name == "nt" else "cyclopean"), packages)


def test_a_wheel_built_from_the_source_distribution_holds_the_same(
    distributions: tuple[Path, Path], tmp_path: Path
) -> None:
    """`pip install` of a source archive builds such a one; the tests and pages are in the archive too."""
    shutil.unpack_archive(distributions[1], tmp_path / "source")
    (unpacked,) = (tmp_path / "source").iterdir()
    assert {"tests", "docs", "Makefile", "noxfile.py", "requirements"} <= {path.name for path in unpacked.iterdir()}
    (again,) = build(unpacked, tmp_path / "wheel", "wheel")
    first, second = zipfile.ZipFile(distributions[0]), zipfile.ZipFile(again)
    assert sorted(first.namelist()) == sorted(second.namelist())


def test_everything_that_the_packages_read_is_in_the_wheel(distributions: tuple[Path, Path]) -> None:
    """Templates, shaders, tables, the dither mask: each file of a package that is tracked, and what is shipped."""
    tracked = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, encoding="utf-8", check=False)
    if tracked.returncode:
        pytest.skip("this is no checkout of git")
    packages = (
        "documents",
        "devices",
        "stimuli",
        "analysis",
        "runner",
        "extensions",
        "cyclopean",
        "experiments",
        "configs",
    )
    shipped = ("experiments", "configs")
    wanted = {
        f"runner/shipped/{name}" if name.startswith(shipped) else name
        for name in tracked.stdout.split("\0")
        if name.split("/")[0] in packages and (ROOT / name).is_file()
    }
    held = set(zipfile.ZipFile(distributions[0]).namelist())
    assert wanted <= held
    assert not [name for name in held if name.startswith(("experiments/", "configs/", "tests/"))]


@pytest.fixture(scope="module")
def demo(installed: Installed, tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    """What the demo with three observers printed in an empty folder, and that folder."""
    folder = tmp_path_factory.mktemp("empty")
    before = installed.files()
    said = json.loads(installed.run(folder, "demo", "--observers", "3", "--json"))
    assert {path.name for path in folder.iterdir()} == {"results", "cache"}
    assert installed.files() == before  # nothing is written into the installed packages
    return said, folder


def test_every_observer_answers_every_pair_before_the_report(demo: tuple[dict[str, Any], Path]) -> None:
    said, folder = demo
    logs = [read_session(file) for file in session_files(folder / "results")]
    assert len(logs) == 3
    for log in logs:
        assert log.complete
        pairs = [trial for trial in log.trials if trial.kind == "all_pairs"]
        assert len({frozenset((t.details()["first"], t.details()["second"])) for t in pairs}) == 45
    page = (folder / said["report"]).read_text(encoding="utf-8")
    assert "<svg" in page
    assert "2.1-stereo" in page
    assert page.count("data:image/") >= 10  # the stimuli, found without a checkout


def test_scores_add_up(demo: tuple[dict[str, Any], Path]) -> None:
    scores = demo[0]["scores"]
    assert len(scores["items"]) == 10
    assert sum(item["wins"] for item in scores["items"]) == 135
    assert scores["df"] == 36


def test_nothing_is_computed_that_the_scene_does_not_need(demo: tuple[dict[str, Any], Path]) -> None:
    """Five stereo pairs and five flat pictures make 15 uploads and 15 colour passes, however many trials show them."""
    work = demo[0]["work"]
    assert work["decodes"] == 10
    assert work["uploads"] == 15
    assert work["colour_passes"] == 15
    # Per observer: instructions, 45 pairs, two breaks, each drawn once.
    assert work["frames_drawn"] == 3 * (1 + 45 + 2)
    assert work["evictions"] == 0


def test_doctor_finds_the_packages_where_they_are_installed(installed: Installed, tmp_path: Path) -> None:
    git = ["git", "-C", str(installed.program.parents[1]), "-c", "user.name=A", "-c", "user.email=a@example.org"]
    for words in (["init", "--quiet"], ["commit", "--quiet", "--allow-empty", "-m", "of a study"]):
        subprocess.run([*git, *words], check=True)
    report = json.loads(installed.run(tmp_path, "doctor", "--json", of_module=True))
    assert "commit" not in report["software"]  # that of the repository around it is not ours
    for package in report["packages"].values():
        assert package["problem"] is None
        assert Path(package["folder"]).resolve() == installed.packages.resolve()


def test_schema_and_help_need_no_checkout(installed: Installed, tmp_path: Path) -> None:
    assert json.loads(installed.run(tmp_path, "schema", "experiment"))["title"] == "ExperimentSpec"
    assert installed.run(tmp_path, "--help", of_module=True) == installed.run(tmp_path, "--help")


def test_every_shipped_experiment_can_be_copied_and_checked(installed: Installed, tmp_path: Path) -> None:
    """In one process: a copy of each, found in the installed package, is a study that `check` accepts."""
    code = (
        "import sys; from pathlib import Path\n"
        "from runner.protocol import copy_experiment, shipped_experiments\n"
        "from runner.check import CheckOptions, check_file\n"
        "for name, file in shipped_experiments().items():\n"
        "    copied = copy_experiment(file, Path(name))\n"
        "    report = check_file(copied.experiment, CheckOptions(screen=False, pictures=False))\n"
        "    print(name, len(report.errors), len(copied.observers), file.is_relative_to(sys.prefix))\n"
    )
    python = installed.program.with_name("python.exe" if os.name == "nt" else "python")
    own = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run([python, "-c", code], cwd=tmp_path, env=own, capture_output=True, encoding="utf-8")
    assert done.returncode == 0, done.stderr
    said = [line.split() for line in done.stdout.splitlines()]
    assert [line[0] for line in said] == list(shipped_experiments())
    assert all(line[1] == "0" and int(line[2]) >= 1 and line[3] == "True" for line in said)


def test_studies_are_made_away_from_the_checkout(installed: Installed, tmp_path: Path) -> None:
    draw_flat(tmp_path / "photos", ("a", "b", "c"))
    assert "3 trials" in installed.run(tmp_path, "new", "my_study", "photos", "--panel", "640x480,0.5")
    installed.run(tmp_path, "check", "my_study/experiment.yaml", "--no-screen")


def test_a_package_beside_ours_adds_a_kind_of_block(installed: Installed, tmp_path: Path) -> None:
    """It is checked, run, cut short, resumed, replayed, reported and exported without a changed line of ours."""
    (wheel,) = build(ROOT / "examples/extension", tmp_path / "dist", "wheel")
    python = installed.program.with_name("python.exe" if os.name == "nt" else "python")
    pip = [sys.executable, "-m", "pip", "--python", str(python), "--disable-pip-version-check"]
    subprocess.run([*pip, "install", "--quiet", "--no-index", "--no-deps", wheel], check=True, timeout=120)
    assert "cyclopean-same-or-different 1.0" in installed.run(tmp_path, "--version")
    schema = json.loads(installed.run(tmp_path, "schema", "experiment"))
    assert "exposure_s" in schema["$defs"]["SameOrDifferent"]["properties"]
    (tmp_path / "proof").mkdir()
    proof = "import sys; from cyclopean.testing import prove_block; prove_block(sys.argv[1], 'proof')"
    entry = "kind: same_or_different, trials: 6, exposure_s: 0.1"
    subprocess.run([python, "-P", "-c", proof, entry], cwd=tmp_path, check=True, timeout=300)
    installed.run(tmp_path, "check", "proof/proof.yaml")
    page = tmp_path / "page.html"
    installed.run(tmp_path, "report", "proof/whole", "--with-simulated", "-o", str(page))
    assert "Same or different" in page.read_text(encoding="utf-8")
    subprocess.run([*pip, "uninstall", "--quiet", "--yes", "cyclopean-same-or-different"], check=True, timeout=120)
    assert "same-or-different" not in installed.run(tmp_path, "--version")
