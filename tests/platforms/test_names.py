"""Names, line ends and consoles: what one system takes and another does not."""

from __future__ import annotations

import dataclasses
import io
import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.comparisons import read_table
from analysis.records import read_session, session_files
from devices.camera import read_correspondences, read_reference
from devices.readings import Measurements, read_measurements, write_csv
from devices.readings.sets import read_patches
from devices.readings.ti3 import write_ti3
from documents import InputError
from documents.files import looked_for, no_file_name, with_slashes
from documents.yaml import parse_yaml
from runner.cli.main import main
from runner.commands import COMMANDS
from runner.protocol import KINDS, read_experiment
from runner.session.folders import observer_folder
from stimuli.recipes import read_recipe
from stimuli.recipes.values import relative_path
from stimuli.spectral.curves import read_reflectances

# Names and paths that one system takes and another does not.

Study = Any  # tests/conftest.py


@pytest.mark.parametrize("name", ["con", "NUL", "aux.exr", "com1", "LPT9.tar.gz", "a.", "a "])
def test_no_file_is_named_so(name: str) -> None:
    assert no_file_name(name)


@pytest.mark.parametrize("name", ["console", "nul-1", "auxiliary.exr", "com10", "a.b", "1.1"])
def test_a_file_may_be_named_so(name: str) -> None:
    assert no_file_name(name) is None


@pytest.mark.parametrize(
    ("file", "old", "new", "why"),
    [
        ("small.yaml", "name: small", "name: con", "Windows keeps the name 'con' for a device"),
        ("recipe.yaml", "name: one,", "name: aux,", "Windows keeps the name 'aux' for a device"),
        ("recipe.yaml", "name: one,", "name: two.,", "full stop or a space at the end"),
        ("recipe.yaml", "name: one,", "name: TWO,", "the name 'two' stands twice"),
        ("recipe.yaml", "one.exr", r"sub\one.exr", "which every system reads: sub/one.exr"),
        (
            "small.yaml",
            "rig: rig.yaml",
            r"rig: sub\rig.yaml",
            "which every system reads: sub/rig.yaml",
        ),
        (
            "small.yaml",
            "rig: rig.yaml",
            r'rig: "..\rig.yaml"',
            "which every system reads: ../rig.yaml",
        ),
        ("small.yaml", "rig: rig.yaml", r'rig: "..\lab\rig.yaml"', "forward slashes"),
        ("small.yaml", "rig: rig.yaml", r'rig: "sub\bar.yaml"', "begins an escape"),
        ("small.yaml", "recipe.yaml", r"sub\recipe.yaml", "which every system reads: sub/recipe.yaml"),
        ("rig.yaml", "display.yaml", r"..\display.yaml", "which every system reads: ../display.yaml"),
    ],
)
def test_what_only_one_system_takes_is_refused_with_what_to_write(
    study: Study, file: str, old: str, new: str, why: str
) -> None:
    study.edit(file, old, new)
    with pytest.raises(InputError) as caught:
        read_experiment(study.experiment)
    assert why in str(caught.value)
    assert file in str(caught.value)


def test_windows_takes_backslashes_in_recipes(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is made of them is the same text as with slashes, so that the cache and the manifest do not differ."""
    monkeypatch.setattr("stimuli.recipes.values.sys.platform", "win32")
    assert relative_path(r"day 1\a.exr") == "day 1/a.exr"
    monkeypatch.setattr("documents.files.paths.sys.platform", "win32")
    assert "looked for" in looked_for(Path("lab.yaml"), r"rigs\lab.yaml")  # the backslash is not what is wrong


def test_observers_that_differ_in_capitals_only_are_one_folder_on_windows(study: Study, tmp_path: Path) -> None:
    run = ("run", study.experiment, "--results", study.results, "--simulate", study.observers, "--observer")
    study.cyclopean(*run, "ann")
    before = sorted(study.results.rglob("*"))
    assert "'Ann' differs from that in capitals only" in study.cyclopean(*run, "Ann", expect=2).stderr
    assert sorted(study.results.rglob("*")) == before
    assert observer_folder(study.results, "small", "anna").name == "sub-anna"


@pytest.mark.parametrize("end", ["\r\n", "\n", "\r"])
def test_yaml_reads_the_same_whatever_ends_its_lines(study: Study, end: str) -> None:
    """Also a text of several lines: observers see the same page."""
    lines = "instructions, text: Look at the two pictures.}"
    study.edit("small.yaml", f"  - {{kind: {lines}", "  - kind: instructions\n    text: |\n      Look.\n      Press.")
    before = read_experiment(study.experiment).digest
    for file in ("small.yaml", "rig.yaml", "recipe.yaml", "display.yaml"):
        text = (study.folder / file).read_text(encoding="utf-8")
        (study.folder / file).write_bytes(text.replace("\n", end).encode())
    assert read_experiment(study.experiment).digest == before
    read_recipe(study.folder / "recipe.yaml")


def test_slashes_are_put_back_where_an_escape_ate_the_letter() -> None:
    assert with_slashes(parse_yaml(r'"..\new\table\rig.yaml"', "a.yaml").data) == "../new/table/rig.yaml"


# Files whose lines end in \r\n, as editors and spreadsheets of Windows write them, say what they said before.

CODES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], dtype=float)
READINGS = Measurements(CODES, CODES @ np.array([[10.8, 5.6, 0.5], [9.7, 18.7, 1.6], [5.7, 2.2, 29.2]]) + 0.1)
WAVES = [400, 500, 600, 700]
TEXTS: dict[str, tuple[str, Callable[[Path], Any]]] = {
    "comparisons.csv": ('winner,loser,count\n"a,b",c,2\nc,"a,b",1\n', read_table),
    "patches.csv": ("red,green,blue\n0,0,0\n255,128,0\n", read_patches),
    "reflectances.csv": (
        "wavelength_nm,one,two\n" + "".join(f"{wave},0.5,0.25\n" for wave in WAVES),
        read_reflectances,
    ),
    "reference.csv": ("name,X,Y,Z\nA1,10,11,12\nA2,20,21,22\n", read_reference),
    "correspondences.csv": (
        "name,R,G,B,X,Y,Z\nA1,0.1,0.2,0.3,10,11,12\nA2,0.2,0.3,0.4,20,21,22\n",
        read_correspondences,
    ),
}


def plain(value: Any) -> Any:
    """Return a value that can be compared: arrays as lists."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    return [plain(item) for item in value] if isinstance(value, (list, tuple)) else value


def alike(file: Path, read: Callable[[Path], Any]) -> None:
    before = plain(read(file))
    content = file.read_bytes()
    assert b"\r" not in content.replace(b"\r\n", b"\n")
    file.write_bytes(content.replace(b"\r\n", b"\n").replace(b"\n", b"\r\n"))
    assert plain(read(file)) == before
    file.write_bytes(b"\xef\xbb\xbf" + file.read_bytes() if file.suffix == ".csv" else file.read_bytes())
    assert plain(read(file)) == before  # and with the mark that spreadsheets put before UTF-8


@pytest.mark.parametrize("name", TEXTS)
def test_tables_read_the_same(name: str, tmp_path: Path) -> None:
    text, read = TEXTS[name]
    (tmp_path / name).write_text(text, encoding="utf-8", newline="\n")
    alike(tmp_path / name, read)


@pytest.mark.parametrize("name", ["readings.csv", "readings.ti3"])
def test_readings_of_a_display_read_the_same(name: str, tmp_path: Path) -> None:
    write: Callable[[Measurements, Path], None] = write_csv if name.endswith("csv") else write_ti3
    write(READINGS, tmp_path / name)
    alike(tmp_path / name, lambda file: (read_measurements(file).codes, read_measurements(file).XYZ))


def test_a_session_reads_the_same(study: Study) -> None:
    study.cyclopean(
        "run", study.experiment, "--observer", "01", "--results", study.results, "--simulate", study.observers
    )
    (file,) = session_files(study.results)
    alike(file, lambda log: repr(read_session(log)))


# What the program prints on consoles and into pipes whose encoding lacks ΔE, × or →.

ROOT = Path(__file__).parents[2]


def said(encoding: str, *words: object, expect: int = 0) -> tuple[str, str]:
    """Return what the program writes on streams of ``encoding``, which must be able to read it again."""
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding) for _ in range(2))
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        patch.setattr(sys, "argv", ["cyclopean", *map(str, words)])
        with pytest.raises(SystemExit) as left:
            main()
    texts = []
    for stream in (out, err):
        stream.flush()
        texts.append(stream.buffer.getvalue().decode(encoding))
    assert int(left.value.code or 0) == expect, texts[1]
    return texts[0], texts[1]


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Comparisons whose winner has a name that no code page of Windows holds."""
    file = tmp_path_factory.mktemp("table") / "table.csv"
    rows = ["λ→2,b", "b,λ→2", "b,c", "c,b", "c,λ→2", "λ→2,c"] * 3
    file.write_text("winner,loser\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return file


@pytest.mark.parametrize("encoding", ["cp1252", "ascii", "utf-8"])
def test_scores_are_printed_in_every_encoding(encoding: str, table: Path) -> None:
    out, _ = said(encoding, "scores", table)
    assert ("λ→2" if encoding == "utf-8" else "->2") in out
    if encoding == "cp1252":
        assert "lambda->2" in out


@pytest.mark.parametrize("encoding", ["cp1252", "utf-8"])
def test_json_is_whole_in_every_encoding(encoding: str, table: Path) -> None:
    """It is ASCII, so that what reads it need not know the console's code page."""
    out, _ = said(encoding, "scores", table, "--json")
    assert out.isascii()
    assert "λ→2" in {item["name"] for item in json.loads(out)["items"]}


@pytest.mark.parametrize("kind", KINDS)
def test_schemas_are_whole_in_every_encoding(kind: str) -> None:
    out, _ = said("cp1252", "schema", kind)
    assert out.isascii()
    assert json.loads(out)["$schema"]


def helps() -> list[Sequence[str]]:
    return [[], *([name] for name in COMMANDS)]


@pytest.mark.parametrize("command", helps(), ids=" ".join)
def test_every_help_can_be_read_on_a_console_of_windows(command: Sequence[str]) -> None:
    out, _ = said("cp1252", *command, "--help")
    assert out.startswith("Usage: cyclopean")
    assert out.count("?") == said("utf-8", *command, "--help")[0].count("?")  # each sign has letters


def test_findings_and_reports_are_printed(study: Study, tmp_path: Path) -> None:
    out, _ = said("cp1252", "check", study.experiment, "--no-screen")
    assert "small" in out
    study.edit("small.yaml", "Which is closer?", "Which ≥ ‽?")
    study.edit("small.yaml", "name: small", "nume: ΔE→")
    _, err = said("cp1252", "check", study.experiment, expect=2)
    assert "nume" in err


@pytest.mark.nightly
def test_a_pipe_of_windows_breaks_nothing(table: Path) -> None:
    """In a process of its own, as `cyclopean scores table.csv > scores.txt` is there."""
    code = "from runner.cli.main import main; main()"
    own = {**os.environ, "PYTHONIOENCODING": "cp1252", "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code, "scores", str(table)], capture_output=True, env=own, check=False)
    assert done.returncode == 0, done.stderr
    assert b"lambda->2" in done.stdout


def test_json_for_the_console_is_ascii_everywhere() -> None:
    """A code page turns other letters into bytes that no reader of JSON understands."""
    files = (ROOT / "runner" / "cli").rglob("*.py")
    assert not [file for file in files if "ensure_ascii=False" in file.read_text(encoding="utf-8")]
