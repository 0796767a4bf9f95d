"""Printing a page to PDF."""

from __future__ import annotations

from pathlib import Path

import pytest

from runner.errors import SessionError
from runner.reports import results
from runner.reports.results import find_browser, print_pdf


@pytest.mark.nightly
def test_a_page_becomes_a_pdf_and_nothing_else(tmp_path: Path) -> None:
    if find_browser() is None:
        pytest.skip("no Chromium is installed: nothing is printed")
    page = tmp_path / "a page #1.html"
    page.write_text("<!doctype html><title>t</title><p style='break-after: page'>one</p><p>two</p>")
    print_pdf(page, tmp_path / "page.pdf")
    content = (tmp_path / "page.pdf").read_bytes()
    assert content.startswith(b"%PDF-")
    assert b"/Count 2" in content
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a page #1.html", "page.pdf"]


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
