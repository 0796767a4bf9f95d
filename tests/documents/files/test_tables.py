"""Tables are refused by every reader where columns are separated by something else than commas."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from analysis.comparisons import read_table
from devices.camera import read_correspondences, read_reference
from devices.display.colour_table import read_colours
from devices.measurements import read_measurements
from devices.patches.patch_file import read_patches
from documents import Finding, InputError
from documents.files import other_separator
from stimuli.spectral.curves import read_illuminant

MEASURED = "name;red;green;blue;X;Y;Z\na;0;0;255;1,5;2;3\nb;0;0;0;0;0;0\n"
CHART = "R;G;B;X;Y;Z\n0,1;0,2;0,3;4;5;6\n0,1;0,2;0,4;4;5;6\n"


@pytest.mark.parametrize(
    ("read", "text"),
    [
        (read_measurements, MEASURED),
        (read_correspondences, CHART),
        (read_reference, "X;Y;Z\n1,5;2;3\n1;2;3\n"),
        (read_patches, "name;red;green;blue\na;0;0;255\n"),
        (lambda path: read_colours(str(path), "xyz", 255.0), "X;Y;Z\n1,5;2;3\n"),
        (lambda path: read_colours(str(path), "code", 255.0), "red;green;blue\n1;2;3\n"),
        (lambda path: read_illuminant(str(path), None), "wavelength_nm;value\n380;1\n"),  # type: ignore[arg-type]  # luminance does not matter here
        (read_table, "winner;loser\na;b\n"),
    ],
)
@pytest.mark.parametrize(("mark", "word"), [(";", "semicolons"), ("\t", "tabs")])
def test_every_reader_names_the_separator(
    tmp_path: Path, read: Callable[[Path], Any], text: str, mark: str, word: str
) -> None:
    file = tmp_path / "table.csv"
    file.write_text("\ufeff" + text.replace(";", mark), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read(file)
    (finding,) = caught.value.findings
    assert finding.message == f"the table is separated by {word}"
    assert (finding.file, finding.line) == (str(file), 1)
    assert finding.remedy


def test_tables_with_commas_are_none_of_it() -> None:
    assert other_separator(["name", "a;b"], "t.csv", 1) is None
    assert other_separator(["winner"], "t.csv", 1) is None
    assert other_separator([], "t.csv", 1) is None


@pytest.mark.parametrize("hidden", ["\u202e", "\x1b[2J", "\r", "\n", "\x00", "\x9b"])
def test_what_is_told_of_a_file_cannot_move_the_terminal(hidden: str) -> None:
    told = str(Finding(f"red is '{hidden}'", f"a{hidden}.csv", 1, 2, f"write {hidden}"))
    assert told.isprintable()
    assert told.startswith("a")


def test_what_is_told_of_a_file_has_an_end() -> None:
    told = str(Finding("x" * 10**7, "a.csv", remedy="y" * 10**7))
    assert len(told) < 1300
    assert "x…" in told
