#!/usr/bin/env python3
"""Run the usual commands on small studies, and compare all that they print and write with what was kept.

    python tools/golden.py              print what differs from tests/golden; exit status 1 if anything does
    python tools/golden.py --write      keep what is printed and written now
    python tools/golden.py --only run   those commands alone

Kept are exit statuses, what is printed, JSON, CSV, logs, pages as text, and the code values of pictures, without what
two runs never have in common: times, durations, identifiers, digests, folders. Numbers are kept to five digits:
processors differ beyond, by as much as what is fitted is badly conditioned. What is long is kept as its first and last
lines and a digest of all. A change of the program that moves no number and no word leaves all of it as it was; one that
does is listed with its reason where it lands.
"""

from __future__ import annotations

import argparse
import difflib
import hashlib
import html
import io
import json
import os
import re
import shutil
import sys
import tempfile
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))
KEPT = ROOT / "tests" / "golden"
STUDY = ROOT / "tests" / "runner" / "recorded"
MOST_LINES, SHOWN_LINES = 400, 40
# What two runs do not have in common, and what stands in its place.
_VARIES = [
    (re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(?:\.\d+)?(?:Z|[+-]\d\d:?\d\d)?"), "TIME"),
    (re.compile(r"\d{4}-\d\d-\d\d(?: \d\d:\d\d(?::\d\d)?)?"), "DATE"),
    (re.compile(r"(?<![0-9a-z])\d{8}[tT]\d{6}[0-9a-z]*"), "SESSION"),
    (re.compile(r"(?<![.\w])(?=[0-9]*[a-f])[0-9a-f]{12,}(?:-dirty)?\b"), "DIGEST"),
    (re.compile(r"\b(numpy|scipy|moderngl|glfw|OpenImageIO|python|system) \d?[\w.+-]*\d[\w.+-]*"), r"\1 VERSION"),
]
# Keys of JSON whose values are measured with a clock, or say which machine and version this was.
_MEASURED = re.compile(
    r'"(software|machine|packages|process|host|station|graphics|gl|versions?|seconds|shown_ms|duration_s|elapsed_s|took_s|pid|chain'
    r'|OperatingSystem|time|at|started|began|ended|t|clock|work|threads|cores|platform|python|cache)": ?'
    r'("(?:[^"\\]|\\.)*"|-?[\d.e+-]+|\{[^{}]*\}|\[[^\[\]]*\]|null)'
)
_NUMBER = re.compile(r"-?\d+\.\d{6,}(?:e[+-]?\d+)?|-?\d\.\d+e[+-]?\d+|(?<![\w.+-])\d+e-1\d\b")
_ROUNDING = 1e-10  # below it a number is what rounding left, which processors have in common no more
_TABLES = {
    "plain.csv": "winner,loser,count\n"
    + "".join(
        f"{a},{b},{n}\n"
        for a, b, n in (
            ("A", "B", 14),
            ("B", "A", 6),
            ("B", "C", 15),
            ("C", "B", 5),
            ("A", "C", 18),
            ("C", "A", 2),
            ("C", "D", 11),
            ("D", "C", 9),
            ("A", "D", 17),
            ("D", "A", 3),
            ("B", "D", 13),
            ("D", "B", 7),
        )
    ),
    "separated.csv": "winner,loser,observer\n"
    + "".join(f"{a},{b},{observer}\n" for observer in range(1, 9) for a, b in (("A", "B"), ("B", "C"), ("A", "C"))),
}


@dataclass(frozen=True)
class Case:
    """One command: its words, the files that it writes, and the lamp for pictures of it."""

    name: str
    words: str
    writes: tuple[str, ...] = ()


CASES = (
    *(
        Case(f"check_{name}", f"check experiments/{name}.yaml --no-pictures --no-screen --observers 10 --json")
        for name in ("dynamic_range", "exposure_series", "paints", "preliminary")
    ),
    Case("check_wrong", "check study/wrong.yaml --no-screen"),
    Case("schema", "schema experiment"),
    Case("help_run", "run --help"),
    Case(
        "build",
        "stimuli build study/recipe.yaml --rig study/rig.yaml -o built --json",
        ("built/*.json", "built/**/*.exr"),
    ),
    *(
        Case(
            f"run_{name}_{who}",
            f"run study/{name}.yaml --observer {who} --simulate study/observers.yaml --results results "
            "--allow-uncharacterised --json",
            (f"results/{name}/sub-{who}/**/session.jsonl",),
        )
        for name, who in (
            ("pairs", "01"),
            ("pairs", "02"),
            ("pairs", "03"),
            ("others", "01"),
            ("groups", "01"),
            ("sequence", "01"),
            ("many", "01"),
            ("many", "02"),
            ("many", "03"),
            ("many", "04"),
            ("many", "05"),
        )
    ),
    Case("run_no_observer", "run study/pairs.yaml --simulate study/observers.yaml"),
    *(
        Case(
            f"report_{name}",
            f"report results/{name} -o pages/{name}.html --csv tables_{name} --no-thumbnails --json",
            (f"pages/{name}.html", f"tables_{name}/*.csv"),
        )
        for name in ("pairs", "others", "groups", "many")
    ),
    Case("report_terminal", "report results/many -o pages/again.html --no-thumbnails"),
    Case(
        "export",
        "export results/pairs results/others -o bids --name Small --author A.B --json",
        ("bids/**/*.tsv", "bids/**/*.json"),
    ),
    Case("verify", "verify results/pairs --json"),
    Case("preview", "preview study/pairs.yaml -o screens --json", ("screens/**/*.png",)),
    Case("scores_plain", "scores plain.csv"),
    Case("scores_plain_json", "scores plain.csv --pairs --checks --json"),
    Case("scores_separated", "scores separated.csv --pairs --json"),
    Case("scores_observers", "scores answers.csv --pairs --margin 0.5jnd --checks --multiverse --json"),
    Case("scores_davidson", "scores answers.csv --model davidson"),
    Case("scores_missing", "scores nowhere.csv"),
    Case("power", "power study/many.yaml --observers 5:15:5 --replicates 40 --observer-sd 0.7 --workers 1 --json"),
    Case("display_check", "check configs/displays/asus_vg248qe.yaml --json"),
    Case(
        "display_fit",
        "display fit readings.csv --mode side-by-side --panel 1920x1080,0.25 -o fitted.yaml --json",
        ("fitted.yaml",),
    ),
    Case("display_fit_gamma", "display fit readings_gamma.csv --mode side-by-side --model gamma --brief"),
    Case("display_patches", "display patches study/display.yaml -o patches.csv", ("patches.csv",)),
    Case(
        "compare",
        "compare photo.exr rendering.exr --regions configs/regions/plate.yaml --white-luminance 100 "
        "--distance-mm 700 --display configs/displays/asus_vg248qe.yaml -o pages/compare.html --json",
        ("pages/compare.html",),
    ),
)


def _readings(file: Path, gamma: float, seed: int) -> None:
    """Write what a display with noise of 0.2 % reads."""
    from devices.readings import Measurements, write_csv

    levels = np.linspace(0, 255, 18).round()[:, None] / 255
    codes = np.concatenate([levels * channel for channel in ([1, 1, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1])])
    matrix = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
    light = np.array([0.02, 0.02, 0.03]) + codes**gamma @ matrix.T
    write_csv(Measurements(codes, light * np.random.default_rng(seed).normal(1, 0.002, light.shape)), file)


def _picture(file: Path, seed: int, noise: float) -> None:
    """Write a sparkling picture of 90 x 60 pixels."""
    import cyclopean

    rng = np.random.default_rng(7)
    light = 12 + 250 * (rng.random((60, 90)) < 0.02) * rng.lognormal(0, 0.5, (60, 90))
    light = light * np.random.default_rng(seed).normal(1, noise, light.shape)
    cyclopean.write_picture(file, (light[..., None] * np.array([0.964, 1.0, 0.825])).astype(np.float32))


def prepare(folder: Path) -> None:
    """Put what the commands read into ``folder``."""
    for shipped in ("configs", "experiments"):
        shutil.copytree(ROOT / shipped, folder / shipped)
    shutil.copytree(STUDY, folder / "study", ignore=shutil.ignore_patterns("results"))
    pairs = (folder / "study" / "pairs.yaml").read_text(encoding="utf-8")
    head = pairs.split("blocks:")[0].replace("name: pairs", "name: many")
    many = head + "blocks:\n  - {kind: all_pairs, repeats: 2, break_every: 10}\n"
    (folder / "study" / "many.yaml").write_text(many, encoding="utf-8")
    wrong = many.replace("question:", "questoin:").replace("repeats: 2", "repeats: none")
    (folder / "study" / "wrong.yaml").write_text(wrong, encoding="utf-8")
    for name, text in _TABLES.items():
        (folder / name).write_text(text, encoding="utf-8")
    rng = np.random.default_rng(2016)
    rows = ["winner,loser,observer,first,outcome"]
    for observer in range(1, 11):
        for i, j in ((i, j) for i in range(5) for j in range(5) if i != j):
            won = rng.random() < 1 / (1 + np.exp(0.5 * (i - j) + 0.3 * rng.standard_normal()))
            a, b = ("ABCDE"[i], "ABCDE"[j]) if won else ("ABCDE"[j], "ABCDE"[i])
            rows.append(f"{a},{b},{observer},{'ABCDE'[i]},{'tie' if rng.random() < 0.08 else 'win'}")
    (folder / "answers.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    _readings(folder / "readings.csv", 2.2, 1)
    _readings(folder / "readings_gamma.csv", 1.9, 2)
    _picture(folder / "photo.exr", 1, 0.01)
    _picture(folder / "rendering.exr", 2, 0.01)
    (folder / "pages").mkdir()


def typed(words: str) -> tuple[int, str, str]:
    """Run the program in this process on words; return exit status, output, errors."""
    from runner.cli.main import main

    out, err = (io.TextIOWrapper(io.BytesIO(), "utf-8") for _ in range(2))
    status = 0
    with patch.object(sys, "argv", ["cyclopean", *words.split()]), redirect_stdout(out), redirect_stderr(err):
        try:
            main()
        except SystemExit as left:
            status = int(left.code or 0)
    out.seek(0)
    err.seek(0)
    return status, out.read(), err.read()


def plain(text: str, folder: Path) -> str:
    """Return a text without what two runs never have in common."""
    from importlib.metadata import version

    text = text.replace(str(folder), "FOLDER").replace(version("cyclopean"), "VERSION")
    text = _MEASURED.sub(lambda found: f'"{found[1]}": MEASURED', text)
    for pattern, word in _VARIES:
        text = pattern.sub(word, text)
    text = _NUMBER.sub(lambda found: f"{float(found[0]):.5g}" if abs(float(found[0])) >= _ROUNDING else "0", text)
    return re.sub(
        r"\b\d+(?:\.\d+)? (ms|s|seconds|minutes)\b(?= (?:of|for|in all|took)|$)",
        r"DURATION \1",
        text,
        flags=re.MULTILINE,
    )


def shortened(text: str) -> str:
    """Return a long text as its first and last lines and the digest of all."""
    lines = text.splitlines()
    if len(lines) <= MOST_LINES and len(text) < 60_000:
        return text if text.endswith("\n") or not text else text + "\n"
    cut = [line if len(line) < 2_000 else f"{line[:1_900]} ..." for line in lines]
    left = max(len(lines) - 2 * SHOWN_LINES, 0)
    digest = hashlib.sha256(text.encode()).hexdigest()
    return (
        "\n".join([*cut[:SHOWN_LINES], f"[{left} more lines; all: {digest}]", *(cut[-SHOWN_LINES:] if left else [])])
        + "\n"
    )


def read(file: Path, folder: Path) -> str:
    """Return what a file holds, as text: pages without marks, JSON indented, pictures as their code values."""
    if file.suffix in (".png", ".exr"):
        import OpenImageIO as oiio

        pixels = np.asarray(oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT))
        values = pixels.reshape(-1, pixels.shape[-1])
        means = " ".join(f"{value:.6g}" for value in values.mean(axis=0, dtype=np.float64))
        digest = hashlib.sha256(np.round(values, 5).tobytes()).hexdigest()[:10]
        return f"{pixels.shape[1]} x {pixels.shape[0]}, means {means}, values {digest}\n"
    text = file.read_text(encoding="utf-8")
    if file.suffix == ".html":
        text = re.sub(r"(?s)<(style|script|svg)\b.*?</\1>", "", text)
        text = html.unescape(re.sub(r"(?s)<[^>]*>", "\n", text))
        text = "\n".join(line.strip() for line in text.splitlines() if line.strip())
    if file.name.endswith("_beh.tsv"):  # its first column is a time since the session began
        text = re.sub(r"(?m)^[\d.]+\t", "ONSET\t", text)
    if file.suffix == ".json":
        text = json.dumps(json.loads(text), indent=1, ensure_ascii=False)
    return plain(text, folder)


def run(case: Case, folder: Path) -> str:
    """Return all that a command says and writes."""
    status, out, err = typed(case.words)
    if out.startswith("{"):
        out = json.dumps(json.loads(out), indent=1, ensure_ascii=False)
    parts = [f"$ cyclopean {case.words}\nexit status {status}\n", shortened(plain(out, folder))]
    if err:
        parts.append("errors:\n" + shortened(plain(err, folder)))
    for pattern in case.writes:
        for file in sorted(folder.glob(pattern)):
            parts.append(f"== {plain(file.relative_to(folder).as_posix(), folder)}\n{shortened(read(file, folder))}")
    return "\n".join(parts)


def main() -> None:
    """Run the commands; write what they say, or print how it differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="keep what is printed and written now")
    parser.add_argument("--only", default="", help="those commands alone whose name begins so, and what they need")
    asked = parser.parse_args()
    os.environ |= {"COLUMNS": "100", "NO_COLOR": "1", "TZ": "UTC"}
    different = []
    with tempfile.TemporaryDirectory(prefix="golden-") as place:
        folder = Path(place).resolve()
        os.environ["CYCLOPEAN_CACHE"] = str(folder / "cache")
        prepare(folder)
        KEPT.mkdir(exist_ok=True)
        for case in CASES:
            kept = KEPT / f"{case.name}.txt"
            with chdir(folder):
                now = run(case, folder)
            if not case.name.startswith(asked.only):
                continue
            if asked.write:
                kept.write_text(now, encoding="utf-8")
                continue
            before = kept.read_text(encoding="utf-8") if kept.exists() else ""
            if before != now:
                different.append(case.name)
                lines = difflib.unified_diff(before.splitlines(), now.splitlines(), "kept", "now", lineterm="", n=1)
                print(f"{case.name}:", *list(lines)[:60], sep="\n")
    if different:
        sys.exit(f"{len(different)} of {len(CASES)} differ: {' '.join(different)}")


if __name__ == "__main__":
    main()
