"""The files that sessions were made with are kept beside them, once for equal files."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path

import pytest

from analysis.records import kept_experiments, kept_files, read_session, session_files
from extensions.bids import export_dataset
from runner.errors import SessionError
from runner.protocol import copy_experiment, read_experiment, shipped_experiment
from runner.reports import report_results
from runner.session import SessionOptions, build_stimuli, run_session, simulate
from runner.session.configuration import configuration_of

pytestmark = pytest.mark.usefixtures("unseen")
OBSERVERS = "configs/observers/table_4_4.yaml"


def copied(folder: Path) -> Path:
    """Copy a shipped experiment, its pictures made small, and return its file."""
    study = copy_experiment(shipped_experiment("dynamic_range"), folder).experiment
    for file in (study, study.parents[1] / "configs/stimuli/manitoba_gray.yaml"):
        text = file.read_text(encoding="utf-8")
        assert "size_mm: [150, 100]" in text
        file.write_text(text.replace("size_mm: [150, 100]", "size_mm: [12, 8]"), encoding="utf-8")
    return study


@pytest.fixture
def study(tmp_path: Path) -> Path:
    return copied(tmp_path / "study")


@pytest.fixture(scope="module")
def one_session(tmp_path_factory: pytest.TempPathFactory, unseen: None) -> Path:
    """The results of one simulated observer."""
    folder = tmp_path_factory.mktemp("one")
    study = copied(folder / "study")
    simulate(study, OBSERVERS, ["01"], results=folder / "results")
    return folder / "results"


@pytest.fixture
def results(one_session: Path, tmp_path: Path) -> Path:
    """Those results in a folder of the test's own."""
    return Path(shutil.copytree(one_session, tmp_path / "results"))


def kept(results: Path) -> list[Path]:
    return sorted(results.glob("dynamic_range/configuration/*/configuration.json"))


def test_sessions_with_equal_files_share_one_copy(study: Path, tmp_path: Path) -> None:
    results = tmp_path / "results"
    simulate(study, OBSERVERS, ["01", "02"], results=results)
    (listed,) = kept(results)
    named = json.loads(listed.read_text(encoding="utf-8"))
    assert named["experiment"] == "experiments/dynamic_range.yaml"
    assert set(named["files"]) == {
        "experiments/dynamic_range.yaml",
        "configs/rigs/asus_vg248qe_3dvision.yaml",
        "configs/displays/asus_vg248qe.yaml",
        "configs/stimuli/manitoba_gray.yaml",
        "elsewhere/table_4_4.yaml",
        "stimuli.json",
    }
    for name, digest in named["files"].items():
        assert hashlib.sha256((listed.parent / name).read_bytes()).hexdigest() == digest
    copied = (listed.parent / named["rig"]).read_bytes()
    assert copied == (study.parents[1] / "configs/rigs/asus_vg248qe_3dvision.yaml").read_bytes()
    for log in map(read_session, session_files(results)):
        assert str(log.header.hashes["configuration"]).startswith(listed.parent.name)


def test_a_resumed_session_keeps_the_files_where_it_looks_for_them(study: Path, tmp_path: Path) -> None:
    results = tmp_path / "results"
    simulate(study, OBSERVERS, ["01"], results=results)
    (log,) = session_files(results)
    lines = log.read_bytes().splitlines(keepends=True)
    log.write_bytes(b"".join(lines[: len(lines) // 2]))
    (before,) = kept(results)
    shutil.rmtree(before.parents[1])
    run_session(study, "01", SessionOptions(results, simulate=OBSERVERS, resume=True))
    resumed = read_session(log)
    assert resumed.complete
    assert resumed.software == (resumed.header.software,)
    assert kept(results) == [before]
    assert list(tmp_path.glob("**/configuration.json")) == [before]


def test_a_changed_file_is_kept_in_a_folder_of_its_own(study: Path, tmp_path: Path) -> None:
    results = tmp_path / "results"
    simulate(study, OBSERVERS, ["01"], results=results)
    first = {file.parent.name: file.read_bytes() for file in kept(results)}
    study.write_text(study.read_text(encoding="utf-8") + "# a comment\n", encoding="utf-8")
    simulate(study, OBSERVERS, ["02"], results=results)
    after = {file.parent.name: file.read_bytes() for file in kept(results)}
    assert len(after) == 2
    assert first.items() <= after.items()


@pytest.mark.usefixtures("undrawn")
def test_a_report_shows_pictures_by_the_files_that_were_kept(study: Path, tmp_path: Path) -> None:
    results = tmp_path / "results"
    spec = study.read_text(encoding="utf-8").replace("name: dynamic_range", "name: a_study_of_mine")
    study.write_text(spec, encoding="utf-8")
    simulate(study, OBSERVERS, ["01"], results=results)
    shutil.rmtree(study.parents[1])
    assert kept_experiments(results, "a_study_of_mine")
    assert report_results([results]).without_pictures == ""


def test_files_named_by_absolute_paths_are_kept_too(study: Path, tmp_path: Path) -> None:
    rig = study.parents[1] / "configs/rigs/asus_vg248qe_3dvision.yaml"
    spec = study.read_text(encoding="utf-8").replace("../configs/rigs/asus_vg248qe_3dvision.yaml", str(rig))
    elsewhere = tmp_path / "other" / "experiment.yaml"
    elsewhere.parent.mkdir()
    recipe = study.parents[1] / "configs/stimuli/manitoba_gray.yaml"
    elsewhere.write_text(spec.replace("../configs/stimuli/manitoba_gray.yaml", str(recipe)), encoding="utf-8")
    design = read_experiment(elsewhere)
    configuration = configuration_of(design, build_stimuli(design))
    assert {"experiment.yaml", "elsewhere/manitoba_gray.yaml", "elsewhere/asus_vg248qe.yaml"} <= set(
        configuration.contents
    )


def test_where_nothing_can_be_kept_no_session_begins(study: Path, tmp_path: Path) -> None:
    results = tmp_path / "results"
    (results / "dynamic_range").mkdir(parents=True)
    (results / "dynamic_range" / "configuration").write_text("a file where the folder should be")
    options = SessionOptions(results, simulate=OBSERVERS)
    with pytest.raises(SessionError, match="configuration cannot be written: there is something already"):
        run_session(study, "01", options)
    assert not list(session_files(results))


def test_an_export_carries_the_files_and_can_be_exported_again(results: Path, tmp_path: Path) -> None:
    (listed,) = kept(results)
    for number, place in enumerate([results, tmp_path / "bids0", results]):
        folder = tmp_path / f"bids{number % 2}"
        export_dataset([place], folder)
        copy = folder / "sourcedata" / "dynamicrange" / "configuration" / listed.parent.name
        here = {file.relative_to(copy): file.read_bytes() for file in copy.rglob("*") if file.is_file()}
        assert here == {f.relative_to(listed.parent): f.read_bytes() for f in listed.parent.rglob("*") if f.is_file()}


@pytest.mark.parametrize(
    "names", ['["../../sub-01"]', '{"../../../secret.txt": "0"}', "7", "null", '["/etc/hostname"]']
)
def test_a_changed_list_names_no_file_elsewhere(results: Path, names: str) -> None:
    (results / "secret.txt").write_text("secret")
    (listed,) = kept(results)
    listed.write_text(f'{{"experiment": 3, "files": {names}}}', encoding="utf-8")
    (log,) = session_files(results)
    assert list(kept_files(log).values()) == [listed]
    assert kept_experiments(results, "dynamic_range") == []
