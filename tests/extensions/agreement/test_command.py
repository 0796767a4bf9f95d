"""`cyclopean agreement`, from pictures that were degraded and simulated observers who see it, to the page."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from extensions.agreement.compare import LIMITS
from runner.session import simulate
from stimuli.comparison.verdict import Limits
from stimuli.pictures import StereoImage, write_exr

pytestmark = pytest.mark.usefixtures("unseen")
Cyclopean = Callable[..., subprocess.CompletedProcess[str]]  # tests/conftest.py
ROOT = Path(__file__).parents[3]
BLURS_PX = (0.0, 0.5, 0.8, 1.2, 2.0)
SCENES = ("church", "beach")


def picture(seed: int, blur_px: float) -> StereoImage:
    """Return a scene with sparkles in stereo, blurred."""
    random = np.random.default_rng(seed)
    light = 6 + 3 * gaussian_filter(random.normal(size=(40, 60)), 2) + 8 * (random.random((40, 60)) < 0.03)
    light = np.maximum(gaussian_filter(light, blur_px), 0.1)
    left = (light[..., None] * [0.95, 1.0, 1.09]).astype(np.float32)
    return StereoImage(left, np.roll(left, 2, axis=1))


@dataclass(frozen=True)
class Study:
    folder: Path
    experiment: Path
    results: Path


def write_study(
    folder: Path,
    blocks: str = "{kind: all_pairs, within: scene, repeats: 2}",
    reference: str = "none",
    scenes: tuple[str, ...] = SCENES,
) -> Path:
    """Write pictures, recipe, experiment and simulated observers."""
    names = [(f"{scene}-{step}", scene, step) for scene in scenes for step in range(len(BLURS_PX))]
    recipe, observers = [], []
    for name, scene, step in names:
        write_exr(folder / f"{name}.exr", picture(SCENES.index(scene), BLURS_PX[step]))
        recipe.append(
            f"  - {{name: {name}, file: {name}.exr, factors: {{scene: {scene}, blur_px: {BLURS_PX[step]}}}}}\n"
        )
        observers.append(f"  {name}: {{score: {np.exp(-2.5 * BLURS_PX[step]):.5f}}}\n")
    (folder / "recipe.yaml").write_text("schema_version: 1\nkind: pictures\nstimuli:\n" + "".join(recipe))
    (folder / "observers.yaml").write_text("schema_version: 1\nkind: bradley_terry\nstimuli:\n" + "".join(observers))
    file = folder / "blur.yaml"
    file.write_text(
        f"schema_version: 1\nname: blur\nrig: {ROOT / 'configs/rigs/asus_vg248qe_3dvision.yaml'}\n"
        "stimuli: recipe.yaml\nquestion: Which is closer to the original?\n"
        f"layout: {{arrangement: vertical, size_mm: [16, 11], gap_mm: 10, reference: {reference}}}\n"
        f"blocks:\n  - {blocks}\n"
    )
    return file


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Any:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CYCLOPEAN_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory, unseen: None) -> Study:
    folder = tmp_path_factory.mktemp("study")
    file = write_study(folder)
    simulate(file, folder / "observers.yaml", 8, results=folder / "results")
    return Study(folder, file, folder / "results")


def asked(study: Study, *words: object) -> list[object]:
    return ["agreement", study.results, "--experiment", study.experiment, *words]


PHOTOGRAPHS = ("--photograph", "church-0", "--photograph", "beach-0")


@pytest.mark.usefixtures("undrawn")
def test_a_measure_of_blur_agrees_with_observers_who_see_blur(
    study: Study, cyclopean: Cyclopean, tmp_path: Path
) -> None:
    words = asked(study, "--measures", "delta-e-2000,s-cielab", *PHOTOGRAPHS, "--limit", "s-cielab=1")
    found = json.loads(cyclopean(*words, "-o", tmp_path / "page.html", "--csv", tmp_path / "tables", "--json").stdout)
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<svg" in page
    assert "700 mm, by the record of the sessions" in page
    first, second = found["measures"]
    assert [first["decision"], second["decision"]] == ["agrees", "agrees"]
    assert (first["limit"]["table"]["limit"], second["limit"]["table"]["limit"]) == (1.4, 1.0)
    assert [group["name"] for group in found["groups"]] == ["church", "beach"]
    assert [group["photograph"] for group in found["groups"]] == ["church-0", "beach-0"]
    for group in found["groups"]:
        values = [stimulus["delta-e-2000"] for stimulus in group["stimuli"]]
        assert values[0] == 0
        assert values == sorted(values)
    assert (tmp_path / "tables/agreement.csv").is_file()


def test_the_limit_is_that_of_compare() -> None:
    assert LIMITS["delta-e-2000"] == Limits().delta_e


def test_the_measures_are_those_of_the_pictures_that_were_shown(study: Study, cyclopean: Cyclopean) -> None:
    """Slow twin: the picture is read, clipped as the display clips it, and measured by hand."""
    from devices.colour import delta_e_2000, xyz_to_lab
    from devices.display import read_rig
    from stimuli.pictures import read_exr

    words = asked(study, "--measures", "delta-e-2000", "--photograph", "blur_px=0", "--json")
    found = json.loads(cyclopean(*words).stdout)
    assert [group["photograph"] for group in found["groups"]] == ["church-0", "beach-0"]
    rig = read_rig(ROOT / "configs/rigs/asus_vg248qe_3dvision.yaml")
    model, white = rig.models.left, rig.models.left.shown_white_XYZ_cd_m2
    labs = []
    for name in ("church-0", "church-3"):
        image = read_exr(study.folder / f"{name}.exr", observer=None)
        height, width = image.left.shape[:2]
        across, down = (round(mm / rig.display.panel.pixel_pitch_mm) for mm in (16, 11))
        assert (across, down) <= (width, height)
        rows, columns = slice((height - down) // 2, None), slice((width - across) // 2, None)
        part = [view[rows, columns][:down, :across] for view in (image.left, image.right)]
        labs.append([xyz_to_lab(model.xyz(model.code(view)), white) for view in part])
    expected = np.mean([delta_e_2000(one, other).mean() for one, other in zip(*labs, strict=True)])
    measured = found["groups"][0]["stimuli"][3]["delta-e-2000"]
    assert measured == pytest.approx(float(expected), rel=2e-3)  # the code is not rounded in the measure


@pytest.mark.nightly
def test_one_reference_picture_is_the_photograph(tmp_path: Path, cyclopean: Cyclopean) -> None:
    """It is shown beside each pair and not compared: there is no class to compare a limit with."""
    file = write_study(tmp_path, "{kind: all_pairs, stimuli: all, repeats: 3}", "church-0", SCENES[:1])
    simulate(file, tmp_path / "observers.yaml", 4, results=tmp_path / "results")
    study = Study(tmp_path, file, tmp_path / "results")
    found = json.loads(cyclopean(*asked(study, "--measures", "delta-e-2000", "--json")).stdout)
    assert found["groups"][0]["photograph"] == "church-0"
    assert found["measures"][0]["limit"] is None
    assert any("did not compare the photograph" in note for note in found["notes"])
    assert found["measures"][0]["correlations"]["spearman"]["value"] > 0.7


@pytest.mark.nightly
def test_ratings_are_divided_by_their_photographs(tmp_path: Path, cyclopean: Cyclopean) -> None:
    scale = "{name: quality, question: How good, lowest: 1, highest: 9}"
    file = write_study(tmp_path, f"{{kind: rating, ratings: [{scale}]}}")
    simulate(file, tmp_path / "observers.yaml", 4, results=tmp_path / "results")
    study = Study(tmp_path, file, tmp_path / "results")
    found = json.loads(cyclopean(*asked(study, "--measures", "delta-e-2000", *PHOTOGRAPHS, "--json")).stdout)
    assert [(group["name"], group["photograph"]) for group in found["groups"]] == [
        ("church", "church-0"),
        ("beach", "beach-0"),
    ]
    assert found["measures"][0]["decision"] == "agrees"


@pytest.mark.nightly
def test_a_flat_stimulus_beside_a_photograph_in_stereo_is_measured_as_both_eyes_saw_it(
    tmp_path: Path, cyclopean: Cyclopean
) -> None:
    file = write_study(tmp_path, "{kind: all_pairs, stimuli: all}", scenes=SCENES[:1])
    image = picture(0, 2.0)
    write_exr(tmp_path / "church-4.exr", StereoImage.flat(image.left))
    simulate(file, tmp_path / "observers.yaml", 2, results=tmp_path / "results")
    study = Study(tmp_path, file, tmp_path / "results")
    found = json.loads(
        cyclopean(*asked(study, "--measures", "delta-e-2000", "--photograph", "church-0", "--json")).stdout
    )
    assert any("church-4" in note and "depth" in note for note in found["notes"])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--measures", "delta-e-2000"), "known to be the photograph"),
        (("--measures", "delta-e-2000", "--photograph", "curch-0"), "did you mean 'church-0'?"),
        (("--measures", "delta-e-2001", *PHOTOGRAPHS), "did you mean 'delta-e-2000'?"),
        (("--measures", "delta-e-2000", *PHOTOGRAPHS, "--limit", "flip=0.1"), "a limit is given for 'flip'"),
        (("--measures", "delta-e-2000", *PHOTOGRAPHS, "--limit", "delta-e-2000=nan"), "is no limit of a measure"),
        (("--measures", "delta-e-2000", *PHOTOGRAPHS, "--task", "triads"), "there is no task 'triads'"),
        (("--measures", "delta-e-2000", *PHOTOGRAPHS, "--without", "99"), "99"),
        (("--measures", "delta-e-2000", *PHOTOGRAPHS, "--alpha", "2"), "alpha is 2"),
        (("--measures", "delta-e-2000", *PHOTOGRAPHS, "-o", "page.txt"), "no .html file"),
        (("--measures", "", *PHOTOGRAPHS), "no measure is named"),
    ],
)
def test_wrong_words_end_in_one_message(
    study: Study, cyclopean: Cyclopean, words: tuple[str, ...], message: str, tmp_path: Path
) -> None:
    page = () if "-o" in words else ("-o", tmp_path / "page.html")
    ended = cyclopean(*asked(study, *words), *page, expect=2)
    assert message in ended.stderr
    assert "Traceback" not in ended.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.nightly
def test_pictures_that_were_changed_since_are_refused(
    study: Study, cyclopean: Cyclopean, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "another"))
    words = asked(study, "--measures", "delta-e-2000", *PHOTOGRAPHS)
    missing = cyclopean(*words, expect=2).stderr
    assert "not in the cache, or changed since" in missing
    assert "cyclopean preview" in missing
    # Other pictures under the same names are built, and are not those that were shown.
    other = write_study(tmp_path)
    write_exr(tmp_path / "church-2.exr", picture(5, 1.0))
    simulate(other, tmp_path / "observers.yaml", 1, results=tmp_path / "other")
    assert "not in the cache, or changed since" in cyclopean(*words, expect=2).stderr


def test_another_display_is_refused(study: Study, cyclopean: Cyclopean, tmp_path: Path) -> None:
    display = (ROOT / "configs/displays/asus_vg248qe.yaml").read_text(encoding="utf-8").replace("10.83", "11.83")
    (tmp_path / "display.yaml").write_text(display, encoding="utf-8")
    rig = (ROOT / "configs/rigs/asus_vg248qe_3dvision.yaml").read_text(encoding="utf-8")
    lines = ["display: display.yaml" if line.startswith("display:") else line for line in rig.splitlines()]
    (tmp_path / "rig.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    text = study.experiment.read_text(encoding="utf-8")
    for old, new in (
        (str(ROOT / "configs/rigs/asus_vg248qe_3dvision.yaml"), "rig.yaml"),
        ("recipe.yaml", str(study.folder / "recipe.yaml")),
    ):
        text = text.replace(old, new)
    (tmp_path / "blur.yaml").write_text(text, encoding="utf-8")
    words = ["agreement", study.results, "--experiment", tmp_path / "blur.yaml", "--measures", "delta-e-2000"]
    ended = cyclopean(*words, *PHOTOGRAPHS, expect=2).stderr
    assert "is not that of the sessions" in ended


@pytest.mark.nightly
def test_sessions_from_other_distances_are_refused(
    study: Study, cyclopean: Cyclopean, tmp_path: Path, unchained: Callable[[Path], None]
) -> None:
    changed = tmp_path / "results"
    subprocess.run(["cp", "-r", str(study.results), str(changed)], check=True)
    log = sorted(changed.rglob("session.jsonl"))[1]
    unchained(log)
    head, rest = log.read_text(encoding="utf-8").split("\n", 1)
    header = json.loads(head)
    header["display"]["distance_mm"] = 900.0
    log.write_text(json.dumps(header) + "\n" + rest, encoding="utf-8")
    words = ["agreement", changed, "--experiment", study.experiment, "--measures", "delta-e-2000", *PHOTOGRAPHS]
    ended = cyclopean(*words, expect=2).stderr
    assert "viewing distance in mm of this session is 900" in ended
    del header["display"]["white_XYZ_cd_m2"]
    log.write_text(json.dumps(header) + "\n" + rest, encoding="utf-8")
    assert "does not say how the pictures were seen" in cyclopean(*words, expect=2).stderr


def test_results_that_cannot_be(
    study: Study, cyclopean: Cyclopean, tmp_path: Path, unchained: Callable[[Path], None]
) -> None:
    words = ["--measures", "delta-e-2000", *PHOTOGRAPHS]
    assert "session.jsonl" in cyclopean("agreement", tmp_path, *words, expect=2).stderr
    log = next(iter(sorted(study.results.rglob("session.jsonl"))))
    copied = tmp_path / "copied.jsonl"
    copied.write_bytes(log.read_bytes())
    unchained(copied)
    lines = copied.read_text(encoding="utf-8").splitlines()
    copied.unlink()
    other = tmp_path / "sub-01" / "ses-x"
    other.mkdir(parents=True)
    header = json.loads(lines[0])
    (other / "session.jsonl").write_text(lines[0] + "\n", encoding="utf-8")
    assert "no comparison, choice or rating" in cyclopean("agreement", tmp_path, *words, expect=2).stderr
    header["experiment"] = "another"
    (other / "session.jsonl").write_text("\n".join([json.dumps(header), *lines[1:]]) + "\n", encoding="utf-8")
    both = cyclopean("agreement", study.results, tmp_path, *words, expect=2).stderr
    assert "of 'another'" in both
    ended = cyclopean("agreement", study.results, "--experiment", tmp_path / "no.yaml", *words, expect=2).stderr
    assert "there is no such file" in ended


def test_a_measure_whose_package_is_missing(
    study: Study, cyclopean: Cyclopean, monkeypatch: pytest.MonkeyPatch
) -> None:
    from stimuli.measures import measure_named

    monkeypatch.setattr(type(measure_named("delta-e-2000")), "package", "no_such_package")
    monkeypatch.setattr(type(measure_named("s-cielab")), "extra", "vdp")
    ended = cyclopean(*asked(study, "--measures", "delta-e-2000", *PHOTOGRAPHS), expect=2).stderr
    assert "needs the package no_such_package" in ended


@pytest.mark.nightly
def test_pictures_of_other_sizes(tmp_path: Path, cyclopean: Cyclopean) -> None:
    file = write_study(tmp_path, "{kind: all_pairs, stimuli: all}", scenes=SCENES[:1])
    small = picture(0, 2.0)
    write_exr(tmp_path / "church-4.exr", StereoImage(small.left[:20, :30], small.right[:20, :30]))
    simulate(file, tmp_path / "observers.yaml", 2, results=tmp_path / "results")
    study = Study(tmp_path, file, tmp_path / "results")
    ended = cyclopean(*asked(study, "--measures", "delta-e-2000", "--photograph", "church-0"), expect=2).stderr
    assert "'church-4' was shown with 30 x 20 px" in ended
