"""What proves a form of export: ours keeps the promises, one that breaks a promise is found out, names are refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cyclopean import export
from cyclopean.testing import BrokenPromiseError, prove_exporter
from documents import InputError
from documents.extensions import ExtensionError
from runner.reports import EXPORTERS

EXPORTER = """
from analysis.records import read_results
from documents.files import whole_folder
from runner.reports import Exported

CYCLOPEAN_INTERFACE = 1

def write(results, folder, about, progress):
    logs = read_results(*results)
    with whole_folder(folder) as draft:
        for number, log in enumerate(logs):
            rows = [f"{trial.kind},{trial.response_time_s}" for trial in log.trials]
            (draft / f"{number}.csv").write_text("\\n".join(rows))
    return Exported(folder, len(logs), sum(len(log.trials) for log in logs))
"""
BROKEN = {
    "in log.trials]": ("in log.trials[:3]]", "an answer more"),
    "enumerate(logs)": ("enumerate(logs[:1])", "second session"),
    "whole_folder(folder)": ("whole_folder(folder, replace=True)", "another file was taken"),
    "= read_results(*results)": ("= read_results(*results[:1])", "1 sessions"),
    "    with whole": ("    (results[0] / logs[0].file).write_text('')\n    with whole", "stay as they are"),
    "    logs = read": ("    import shutil; shutil.rmtree(folder, ignore_errors=True)\n    logs = read", "is another"),
}


def _exporter(old: str = "", new: str = "") -> Callable[..., Any]:
    held: dict[str, Any] = {}
    exec(EXPORTER.replace(old, new) if old else EXPORTER, held)
    write: Callable[..., Any] = held["write"]
    return write


@pytest.mark.parametrize("old", BROKEN)
def test_a_broken_promise_is_found(old: str, tmp_path: Path) -> None:
    with pytest.raises(BrokenPromiseError, match=BROKEN[old][1]):
        prove_exporter("csv", tmp_path, exporter=_exporter(old, BROKEN[old][0]))


def test_ours_and_another_packages_keep_the_promises_and_a_wrong_one_is_named(
    install: Callable[..., None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(EXPORTERS, "_loaded", {})
    install("tables", EXPORTER, group=EXPORTERS.group, csv="write")
    install("torn", EXPORTER.replace("return Exported", "return"), "2.1", group=EXPORTERS.group, torn="write")
    for name in ("bids", "csv"):
        (tmp_path / name).mkdir()
        assert len(prove_exporter(name, tmp_path / name)) == 6
    results = tmp_path / "csv" / "results"
    with pytest.raises(InputError, match=r"form of export 'cvs'.*'csv'"):
        export(results, folder=tmp_path / "out", to="cvs")
    with pytest.raises(ExtensionError, match=r"torn 2\.1.*tuple in place of Exported"):
        export(results, folder=tmp_path / "out", to="torn")
