"""What a browser says of a page: its document after everything has run that would, and the errors of its console."""

from __future__ import annotations

import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
QUIET = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--virtual-time-budget=2000", "--enable-logging=stderr"),
)
# Each of them would give the page another title.
INJECTED = (
    "<script>document.title = 'owned'</script>"
    "<img src='none.png' onerror=\"document.title = 'owned'\">"
    "<svg onload=\"document.title = 'owned'\"></svg>"
    "<iframe srcdoc=\"<script>parent.document.title = 'owned'</script>\"></iframe>"
)
_BEGINNING = r'<!doctype html>\n<html lang="en">\n<head>\n<meta http-equiv="Content-Security-Policy" content="(.*?)">'


class Page(HTMLParser):
    """The tags of a page with their attributes, and all its text."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(page)
        self.close()

    @property
    def names(self) -> set[str]:
        """The names of the tags."""
        return {tag for tag, _ in self.tags}

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Keep a tag."""
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        """Keep text."""
        self.text += data


def policy_of(page: str) -> dict[str, str]:
    """Return the directives of the policy that stands first in the head of ``page``; none if it stands elsewhere."""
    found = re.match(_BEGINNING, page)
    return dict(one.strip().split(" ", 1) for one in found[1].split(";")) if found else {}


def browsed(page: Path, profile: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Let a browser open ``page`` with ``options``, such as ``--dump-dom``, and run whatever it would run."""
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed: the page is not opened in a browser")
    command = [CHROMIUM, *QUIET, f"--user-data-dir={profile}", *options, page.as_uri()]
    return subprocess.run(command, capture_output=True, encoding="utf-8", timeout=60, check=True)


def opened(page: Path, profile: Path) -> tuple[str, list[str]]:
    """Return the title of ``page`` in a browser, and what its console says."""
    ran = browsed(page, profile, "--dump-dom")
    title = re.search(r"<title>(.*?)</title>", ran.stdout, re.DOTALL)
    return title[1] if title else "", [line for line in ran.stderr.splitlines() if "CONSOLE" in line]


def works_and_runs_nothing(page: str, folder: Path) -> None:
    """Check that a page opens without an error, and that scripts which came into it do not run."""
    clean, injected = folder / "clean.html", folder / "injected.html"
    clean.write_text(page, encoding="utf-8")
    injected.write_text(page.replace("</body>", f"{INJECTED}</body>"), encoding="utf-8")
    title, console = opened(clean, folder / "profile")
    assert title
    assert console == []
    told, refused = opened(injected, folder / "profile")
    assert told == title
    assert len([line for line in refused if "Content Security Policy" in line]) >= 4
