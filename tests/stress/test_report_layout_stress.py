"""Reports with hostile names, 200 stimuli and 60 observers: text stays text, and everything stays inside its page."""

from __future__ import annotations

import random
import re
import shutil
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from analysis.records import SessionLog, new_header
from analysis.report import Report, write_report
from runner.reports.results import print_pdf
from tests.answers import new_answer

pytestmark = pytest.mark.stress

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
QUIET = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"]
LONG = "W" * 300
HOSTILE = (
    "<script>document.title='owned'</script>",
    LONG,
    "משטח-א-" * 12,
    "塗装の見本" * 20,
    '"><img src=x onerror=alert(1)>',
    "a b\u202ec d\u200f",
    "$\\frac{1}{2}$ & {{ 7*7 }}",
    "=HYPERLINK(1)",
    "🎨" * 40,
    "i\u0307" * 60,
)
UTC = "2026-01-02T03:04:05Z"
# How far the page is wider than its window, and how much of the drawings' text lies outside its drawing.
MEASURE = """
<script>onload = () => {
  const page = frames[0].document, root = page.documentElement;
  const outside = [...page.querySelectorAll("svg")].filter(one => one.getBoundingClientRect().width)
    .flatMap(one => [...one.querySelectorAll("text")].filter(text => {
      const own = text.getBoundingClientRect(), all = one.getBoundingClientRect();
      return own.left < all.left - 4 || own.right > all.right + 4;
    }));
  document.querySelector("p").textContent =
    `${root.scrollWidth} of ${root.clientWidth}, ${outside.length} outside: ` +
    outside.slice(0, 3).map(text => text.textContent);
}</script>
"""


def session(observer: str, names: Sequence[str], kind: str, answers: Sequence[dict[str, Any]]) -> SessionLog:
    stimuli = tuple({"name": name, "factors": {"paint": name[:3], "level": place}} for place, name in enumerate(names))
    header = new_header(
        HOSTILE[0],
        observer,
        f"s{observer}",
        UTC,
        seed=1,
        question=HOSTILE[1],
        stimuli=stimuli,
        display={"mode": "flat"},
    )
    trials = tuple(new_answer(0, number, kind, (), 1.0, UTC, answer) for number, answer in enumerate(answers))
    return SessionLog(Path(f"{observer}.jsonl"), header, trials, complete=True)


def compared(stimuli: int, observers: int, each: int) -> list[SessionLog]:
    """Return sessions in which each observer compares neighbours in quality, and pairs at random."""
    names = [*HOSTILE, *(f"stimulus {number}" for number in range(stimuli - len(HOSTILE)))][:stimuli]
    sessions = []
    for person in range(observers):
        rng = random.Random(person)
        pairs = [(place, (place + 1) % stimuli) for place in range(stimuli)]
        pairs += [tuple(rng.sample(range(stimuli), 2)) for _ in range(each)]  # type: ignore[misc]  # two of them
        answers = []
        for one, other in pairs:
            chosen, rejected = (one, other) if rng.random() < 1 / (1 + 2 ** ((one - other) / 10)) else (other, one)
            answers.append(
                {"first": names[one], "second": names[other], "chosen": names[chosen], "rejected": names[rejected]}
            )
        sessions.append(session(HOSTILE[person % 5] if person < 5 else f"{person:02d}", names, "all_pairs", answers))
    return sessions


def rated(stimuli: int, observers: int) -> list[SessionLog]:
    names = [*HOSTILE, *(f"stimulus {number}" for number in range(stimuli - len(HOSTILE)))][:stimuli]
    sessions = []
    for person in range(observers):
        rng = random.Random(person)
        answers = [
            {
                "stimulus": name,
                "ratings": {HOSTILE[0]: rng.randint(1, 9), LONG: rng.randint(1, 9)},
                "rating_times_s": {},
            }
            for name in names
        ]
        sessions.append(session(f"{person:02d}", names, "rating", answers))
    return sessions


@pytest.fixture
def look(tmp_path: Path) -> Callable[[Path, int], str]:
    def measured(page: Path, width_px: int) -> str:
        if CHROMIUM is None:
            pytest.skip("no Chromium is installed: the page is not opened in a browser")
        frame = f'<iframe src="{page.name}" style="width:{width_px}px;height:900px;border:0"></iframe><p></p>{MEASURE}'
        outer = page.with_name("outer.html")
        outer.write_text(f"<!doctype html><body>{frame}", encoding="utf-8")
        options = ["--allow-file-access-from-files", "--virtual-time-budget=20000", "--window-size=1500,1000"]
        command = [CHROMIUM, *QUIET, *options, f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom", outer.as_uri()]
        shown = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True).stdout
        found = re.search(r"<p>(.*)</p>", shown, re.DOTALL)
        assert found is not None, shown[-500:]
        return found.group(1)

    return measured


MAKERS = {
    "200 stimuli, 60 observers": lambda: compared(200, 60, 200),
    "10 hostile stimuli": lambda: compared(10, 12, 30),
    "one observer": lambda: compared(10, 1, 10),
    "200 ratings of 60 observers on two scales": lambda: rated(200, 60),
}


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_everything_stays_inside(
    make: Callable[[], list[SessionLog]], look: Callable[[Path, int], str], tmp_path: Path
) -> None:
    page = tmp_path / "report.html"
    report: Report = write_report(make(), page, csv_folder=tmp_path / "csv", figure_folder=tmp_path / "figures")
    text = page.read_text(encoding="utf-8")
    assert "<script" not in text
    assert "<img" not in text
    assert report.notes is not None
    for width_px in (390, 1200):
        told = look(page, width_px)
        wide = re.match(r"(\d+) of (\d+), (\d+) outside", told)
        assert wide is not None, told
        assert int(wide[1]) <= int(wide[2]), told
        assert int(wide[3]) == 0, told
    print_pdf(page, tmp_path / "report.pdf")
    assert (tmp_path / "report.pdf").read_bytes().startswith(b"%PDF-")
    svgs, pdfs = (sorted(file.stem for file in (tmp_path / "figures").glob(f"*.{kind}")) for kind in ("svg", "pdf"))
    assert svgs == pdfs
    assert svgs
