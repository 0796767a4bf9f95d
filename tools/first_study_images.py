"""Make the screenshots of README.md and docs/first_study.md again: the demo, and a study with ten simulated observers.

    python tools/first_study_images.py [FOLDER]

Needs Chromium. FOLDER is docs/images if left out.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

from runner.reports.results import QUIET, find_browser

ROOT = Path(__file__).parents[1]
MOST_BYTES = 150_000
WIDTH_PX = 960


def main() -> None:
    """Run demo and study in a folder of their own, and keep a trial and the top of both reports."""
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "images"
    browser = find_browser()
    if browser is None:
        sys.exit("there is no Chromium, Chrome or Edge here")
    with TemporaryDirectory() as place:
        folder = Path(place)

        def run(*words: str) -> None:
            environment = {**os.environ, "PYTHONPATH": str(ROOT), "CYCLOPEAN_CACHE": str(folder / "cache")}
            subprocess.run([sys.executable, *words], cwd=folder, env=environment, check=True)

        experiment, simulated = "my_study/experiment.yaml", "my_study/simulated.yaml"
        run(str(ROOT / "examples" / "ten_photographs.py"), "photos")
        run("-m", "cyclopean", "new", "my_study", "photos/", "--panel", "1920x1080,0.2768")
        run("-m", "cyclopean", "preview", experiment, "-o", "preview")
        for observer in range(1, 11):
            run("-m", "cyclopean", "run", experiment, "--observer", f"{observer:02d}", "--simulate", simulated)
        run("-m", "cyclopean", "report", "results/my_study")
        trial = folder / "preview" / "block-04_screen-003_left.png"
        keep(Image.open(trial).convert("RGB"), out / "first_study_trial.png")
        run("-m", "cyclopean", "demo", "--results", "demo")
        (demo,) = (folder / "demo").glob("*/report.html")
        pages = {"first_study_report": folder / "results" / "my_study" / "report.html", "report": demo}
        for name, page in pages.items():
            shot = folder / f"{name}.png"
            command = [browser, *QUIET, "--no-sandbox", "--hide-scrollbars", f"--screenshot={shot}"]
            subprocess.run([*command, "--window-size=1000,2020", page.as_uri()], check=True, capture_output=True)
            keep(Image.open(shot).convert("RGB"), out / f"{name}.png")


def keep(picture: Image.Image, file: Path) -> None:
    """Write a screenshot as a page shows it, with as many colours as the file has room for."""
    small = picture.resize((WIDTH_PX, round(picture.height * WIDTH_PX / picture.width)), Image.Resampling.LANCZOS)
    small.save(file, optimize=True)
    for colours in (256, 128, 64, 32):
        if file.stat().st_size <= MOST_BYTES:
            break
        # An octree keeps the colours of the few pixels of a class's mark; a median cut does not.
        small.quantize(colours, method=Image.Quantize.FASTOCTREE).save(file, optimize=True)
    print(f"{file}: {file.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
