"""Printing a page to PDF."""

from __future__ import annotations

from pathlib import Path

import pytest

from runner.errors import SessionError
from runner.reports import results
from runner.reports.results import print_pdf


def test_without_a_browser_the_remedy_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(results, "BROWSERS", ())
    monkeypatch.setattr(results, "OUTSIDE_PATH", ())
    with pytest.raises(SessionError, match="install Chromium or Chrome"):
        print_pdf(tmp_path / "page.html", tmp_path / "page.pdf")
    assert not list(tmp_path.iterdir())


def test_a_browser_that_fails_leaves_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for command in ("true", "false"):
        monkeypatch.setattr(results, "BROWSERS", (command,))
        with pytest.raises(SessionError, match="did not print"):
            print_pdf(tmp_path / "page.html", tmp_path / "page.pdf")
    assert not list(tmp_path.iterdir())
