"""Printing an HTML page to PDF with a browser without a window."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from documents import Finding
from runner.errors import SessionError

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "microsoft-edge", "chrome")
OUTSIDE_PATH = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "C:/Program Files/Google/Chrome/Application/chrome.exe",
    "C:/Program Files (x86)/Microsoft/Edge/Application/msedge.exe",
)
QUIET = ("--headless", "--disable-gpu", "--no-first-run", "--disable-background-networking", "--disable-sync")
LONGEST_S = 120


def find_browser() -> str | None:
    """Return a browser of the Chromium family; None if there is none."""
    for name in BROWSERS:
        found = shutil.which(name)
        if found:
            return found
    return next((place for place in OUTSIDE_PATH if Path(place).is_file()), None)


def print_pdf(page: Path, pdf: Path) -> None:
    """Print ``page`` to ``pdf``, which appears whole or not at all.

    Raises
    ------
    SessionError
        If there is no such browser, or it prints nothing.
    """
    browser = find_browser()
    if browser is None:
        remedy = "install Chromium or Chrome, or open the page in any browser and print it to a file"
        raise SessionError(Finding("no browser was found that could print the page", str(page), remedy=remedy))
    with tempfile.TemporaryDirectory(prefix="cyclopean-print-") as folder:
        printed = Path(folder) / "page.pdf"
        command = [browser, *QUIET, "--no-pdf-header-footer", f"--user-data-dir={folder}/profile"]
        if hasattr(os, "geteuid") and os.geteuid() == 0:
            command.append("--no-sandbox")  # the browser refuses to run as the administrator otherwise
        command += [f"--print-to-pdf={printed}", page.resolve().as_uri()]
        try:
            subprocess.run(command, capture_output=True, timeout=LONGEST_S, check=True)
        except (OSError, subprocess.SubprocessError) as error:
            raise _failed(browser, page) from error
        if not printed.is_file():
            raise _failed(browser, page)
        draft = pdf.with_name(f"{pdf.name}.part")
        shutil.copyfile(printed, draft)
        draft.replace(pdf)


def _failed(browser: str, page: Path) -> SessionError:
    what = f"{Path(browser).name} did not print the page"
    return SessionError(Finding(what, str(page), remedy="open the page in any browser and print it to a file"))
