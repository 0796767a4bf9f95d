"""What the program prints on consoles and into pipes whose encoding lacks ΔE, × or →."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import pytest

from runner.cli.main import COMMANDS, main
from runner.protocol import KINDS

Study = Any  # tests/conftest.py
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
