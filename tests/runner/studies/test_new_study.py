"""`new_study`: whatever it writes passes the check and runs; what it cannot use leaves nothing behind."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest
from PIL import Image

from analysis.records import read_results
from analysis.series import summarise_series
from devices.display import PanelSpec, ReportedMonitor
from documents import InputError
from documents.yaml import read_yaml
from runner.check import CheckOptions, check_file
from runner.presenter import MODES, find_mode
from runner.protocol import read_experiment
from runner.session import simulate
from runner.studies import Kind, NewStudy, StudyOptions, copy_shipped, new_study, shipped_studies, typed
from runner.studies.contents import KINDS
from runner.studies.plan import GAP_MM, plan_sizes
from runner.views import LayoutSpec, Style
from runner.views.layout import LayoutError, pair_layout, single_layout
from stimuli.pictures.resampling import display_pixels
from tests.runner.studies.drawn_pictures import draw, draw_flat, draw_pairs

ROOT = Path(__file__).parents[3]
PANEL = PanelSpec(resolution_px=(640, 480), pixel_pitch_mm=0.5)
NAMES = ("old_church_dim", "old_church_bright", "beach_dim", "beach_bright")


def _errors(study: NewStudy, *, pictures: bool = True) -> list[str]:
    report = check_file(study.experiment, CheckOptions(screen=False, pictures=pictures))
    return [str(error) for error in report.errors]


@pytest.mark.parametrize(
    ("kind", "stereo"),
    [
        pytest.param(kind, stereo, marks=[] if stereo == (kind == "pairs") else pytest.mark.nightly)
        for kind in KINDS
        for stereo in (False, True)
    ],
)
def test_a_new_study_passes_the_check_and_runs(tmp_path: Path, kind: Kind, stereo: bool) -> None:
    pictures = (draw_pairs if stereo else draw_flat)(tmp_path / "photos", NAMES)
    study = new_study(tmp_path / "my_study", [pictures], StudyOptions(kind, panel=PANEL))
    assert study.mode == ("anaglyph-red-cyan" if stereo else "flat")
    assert study.pictures == 4
    assert _errors(study) == []
    done = simulate(study.experiment, study.folder / "simulated.yaml", 1, results=tmp_path / "results")
    assert len(done.folders) == 1
    assert (done.folders[0] / "session.jsonl").read_text(encoding="utf-8").count('"nominal"') >= study.trials


@pytest.mark.nightly
def test_choices_of_a_new_study_are_scored_by_the_quality_that_is_asked(tmp_path: Path) -> None:
    pictures = draw_flat(tmp_path / "photos", NAMES)
    study = new_study(tmp_path / "my_study", [pictures], StudyOptions("best", panel=PANEL))
    simulate(study.experiment, study.folder / "simulated.yaml", 2, results=tmp_path / "results")
    series = summarise_series(read_results(tmp_path / "results"))
    assert series.weight == "quality"
    assert set(series.ratings) == {"quality", "difficulty"}
    assert all(level.score is not None for level in series.levels)


@pytest.mark.parametrize("fit", [None, pytest.param(False, marks=pytest.mark.nightly)])
def test_pictures_of_several_sizes_are_brought_to_one_or_warned_of(tmp_path: Path, fit: bool | None) -> None:
    folder = draw_flat(tmp_path / "photos", ("small",), (60, 40))
    draw_flat(folder, ("large",), (240, 160))
    study = new_study(tmp_path / "my_study", [folder], StudyOptions(panel=PANEL, fit=fit))
    report = check_file(study.experiment, CheckOptions(screen=False, pictures=True))
    assert not report.errors
    assert report.facts["size_ratio"] == (1.0 if fit is None else 4.0)
    assert any("differ in size" in str(warning) for warning in report.warnings) == (fit is False)


@pytest.mark.parametrize(
    ("kind", "reference"),
    [
        pytest.param(kind, reference, marks=[] if kind == "best" and reference == "another" else pytest.mark.nightly)
        for kind in KINDS
        for reference in ("physical", "old_church_dim", "another")
    ],
)
def test_pictures_are_compared_with_a_reference(tmp_path: Path, kind: Kind, reference: str) -> None:
    names = (*NAMES, "old_church_mid")
    folder = draw_flat(tmp_path / "photos", names)
    draw_flat(tmp_path / "beside", ("another",))
    file = {"old_church_dim": folder, "another": tmp_path / "beside"}.get(reference)
    named = reference if file is None else str(file / f"{reference}.png")
    study = new_study(tmp_path / "my_study", [folder], StudyOptions(kind, panel=PANEL, reference=named))
    assert _errors(study) == []
    design = read_experiment(study.experiment)
    assert design.spec.layout.reference == reference
    assert design.stimuli.reference == (None if file is None else reference)
    assert set(design.stimuli.names) == set(names) - {reference}
    assert "reference" in design.spec.question
    if kind != "best":
        return
    simulate(study.experiment, study.folder / "simulated.yaml", 1, results=tmp_path / "results")
    assert summarise_series(read_results(tmp_path / "results")).weight == "similarity"


@pytest.mark.parametrize(
    "mode", [pytest.param(mode, marks=[] if mode == "side-by-side-half" else pytest.mark.nightly) for mode in MODES]
)
def test_sizes_and_modes(tmp_path: Path, mode: str) -> None:
    folder = draw_flat(tmp_path / "photos", ("small",), (16, 16))
    draw_flat(folder, ("portrait",), (300, 700))
    draw_flat(folder, ("wide",), (2000, 100))
    study = new_study(tmp_path / "my_study", [folder], StudyOptions(mode=mode, panel=PANEL, fit=False))
    assert _errors(study, pictures=False) == []
    design = read_experiment(study.experiment)
    assert design.rig.mode == mode
    recipe = read_yaml(study.folder / "stimuli.yaml").data
    assert ["resample" in entry for entry in recipe["stimuli"]] == [True, False, True]
    assert "small" in {entry["name"] for entry in recipe["stimuli"]}


def test_pictures_are_copied_byte_for_byte_under_plain_names(tmp_path: Path) -> None:
    folder = draw_pairs(tmp_path / "photos", ("Blümchen 1.2", "b"))
    study = new_study(tmp_path / "Mine & yours", [folder], StudyOptions(panel=PANEL))
    copies = {file.read_bytes() for file in (study.folder / "pictures").iterdir()}
    assert copies == {file.read_bytes() for file in folder.iterdir()}
    assert all(file.name.isascii() and " " not in file.name for file in (study.folder / "pictures").iterdir())
    assert "Blümchen 1.2_L.jpg" in (study.folder / "stimuli.yaml").read_text(encoding="utf-8")
    assert read_experiment(study.experiment).spec.name == "mine_yours"
    moved = study.folder.rename(tmp_path / "moved")
    assert not check_file(moved / "experiment.yaml", CheckOptions(screen=False)).errors


def test_the_panel_is_asked_of_the_monitor(tmp_path: Path) -> None:
    folder = draw_flat(tmp_path / "photos", ("a", "b"))

    def panel(name: str, monitor: ReportedMonitor | None) -> tuple[PanelSpec, str]:
        study = new_study(tmp_path / name, [folder], ask_monitor=lambda wanted: monitor)
        return read_experiment(study.experiment).rig.display.panel, " ".join(study.notes)

    measured, words = panel("known", ReportedMonitor("DP-1", (2560, 1440), (597, 336), 75.0))
    assert (measured.resolution_px, measured.refresh_hz) == ((2560, 1440), 75.0)
    assert measured.pixel_pitch_mm == pytest.approx(0.2333, abs=0.001)
    assert "DP-1" in words
    assert "ASSUMED" not in words
    guessed, words = panel("silent", ReportedMonitor("DP-2", (1280, 1024), (0, 0), None))
    assert guessed.resolution_px == (1280, 1024)
    assert "ASSUMED: the pixel pitch" in words
    _, words = panel("none", None)
    assert "ASSUMED: no monitor" in words


def test_the_monitor_is_chosen(tmp_path: Path) -> None:
    folder = draw_flat(tmp_path / "photos", ("a", "b"))
    screens = {(): (640, 480), ("DP-2",): (2560, 1440)}

    def ask(wanted: tuple[str, ...]) -> ReportedMonitor:
        return ReportedMonitor("a monitor", screens[wanted], (0, 0))

    study = new_study(tmp_path / "my_study", [folder], StudyOptions(monitors=("DP-2",)), ask_monitor=ask)
    rig = read_experiment(study.experiment).rig
    assert (rig.monitors, rig.display.panel.resolution_px) == (("DP-2",), (2560, 1440))
    options = StudyOptions(display=ROOT / "configs/rigs/asus_vg248qe_3dvision.yaml", monitors=("2",))
    assert read_experiment(new_study(tmp_path / "measured", [folder], options).experiment).rig.monitors == ("2",)


def test_a_measured_display_goes_with_the_study(tmp_path: Path) -> None:
    folder = draw_pairs(tmp_path / "photos", ("a", "b"))
    rig = ROOT / "configs/rigs/asus_vg248qe_3dvision.yaml"
    study = new_study(tmp_path / "by_rig", [folder], StudyOptions(display=rig))
    design = read_experiment(study.experiment)
    assert (design.rig.nominal, design.rig.mode, design.rig.spec.glasses) == (None, "side-by-side", "Nvidia 3D Vision")
    assert design.rig.spec.distance_mm == 700
    assert (study.folder / "display.yaml").is_file()
    white = read_yaml(study.folder / "stimuli.yaml").data["white_luminance_cd_m2"]
    shown = design.rig.models.left.shown_white_XYZ_cd_m2[1]
    assert 0 <= shown - white < 0.1  # that of the display, not 100
    assert "not measured" not in " ".join(study.notes)
    display = ROOT / "configs/displays/asus_vg248qe.yaml"
    by_display = new_study(tmp_path / "by_display", [folder], StudyOptions(mode="quad-buffered", display=display))
    assert _errors(by_display, pictures=False) == []
    with pytest.raises(InputError, match="not measured in the mode 'top-bottom'"):
        new_study(tmp_path / "wrong", [folder], StudyOptions(mode="top-bottom", display=display))


def test_groups_are_folders_or_the_names_before_the_last_underscore(tmp_path: Path) -> None:
    def factors(name: str, *paths: Path) -> dict[str, tuple[str, str]]:
        study = new_study(tmp_path / name, paths, StudyOptions("within-groups", panel=PANEL))
        assert study.trials == 2  # a pair in each of two groups
        stimuli = read_yaml(study.folder / "stimuli.yaml").data["stimuli"]
        return {entry["name"]: (entry["factors"]["group"], entry["factors"]["version"]) for entry in stimuli}

    by_name = draw_flat(tmp_path / "flat", NAMES)
    expected = {name: tuple(name.rsplit("_", 1)) for name in NAMES}
    assert factors("by_name", by_name) == expected
    by_folder = draw_flat(tmp_path / "scenes", ["/".join(name.rsplit("_", 1)) for name in NAMES])
    assert factors("by_folder", by_folder) == expected
    assert factors("by_files", *sorted(by_folder.glob("*/*"))) == expected
    with pytest.raises(InputError, match="one picture only, such as 'lonely'"):
        factors("alone", by_name, draw(tmp_path / "flat" / "lonely_one.png"))


@pytest.mark.parametrize(("count", "kind"), [(27, "all_pairs"), (28, "active_pairs")])
def test_many_pictures_are_not_all_compared(tmp_path: Path, count: int, kind: str) -> None:
    folder = draw_flat(tmp_path / "photos", [f"p{number}" for number in range(count)], (16, 16))
    study = new_study(tmp_path / "my_study", [folder], StudyOptions(panel=PANEL))
    assert read_experiment(study.experiment).spec.blocks[-1].kind == kind
    assert _errors(study, pictures=False) == []


def test_words_that_yaml_would_read_as_something_else(tmp_path: Path) -> None:
    folder = draw_flat(tmp_path / "photos", ("1e-3", "no", "0x10", "null", "~t", "1.10", "12", "con"))
    question = 'Is it "real": 50 % #| or {not}? \n- yes'
    study = new_study(tmp_path / "- [x]: #y", [folder], StudyOptions(question=question, panel=PANEL))
    design = read_experiment(study.experiment)
    assert set(design.stimulus_names) == {"1e-3", "no", "0x10", "null", "t", "1.10", "12", "picture-con"}
    assert design.spec.question == " ".join(question.split())
    assert _errors(study, pictures=False) == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (StudyOptions(mode="flat"), "shows both eyes the same"),
        (StudyOptions(mode="anaglyph"), "no stereo mode 'anaglyph'"),
        (StudyOptions(white_cd_m2=0), "white of 0"),
        (StudyOptions(distance_mm=0), "distance_mm"),
        (StudyOptions(question="why " * 100), "question"),
        (StudyOptions("rating", question="why is it so " * 22, mode="side-by-side"), "drawn over a picture"),
        (StudyOptions(display=Path("none.yaml")), "none.yaml"),
    ],
)
def test_wrong_options_leave_nothing(tmp_path: Path, options: StudyOptions, message: str) -> None:
    folder = draw_pairs(tmp_path / "photos", ("a", "b"))
    with pytest.raises(InputError, match=message) as caught:
        new_study(tmp_path / "my_study", [folder], options)
    assert ".part" not in str(caught.value)
    assert [file.name for file in tmp_path.iterdir()] == ["photos"]


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    folder = draw_flat(tmp_path / "photos", ("a", "b"))
    (tmp_path / "my_study").mkdir()
    new_study(tmp_path / "my_study", [folder], StudyOptions(panel=PANEL))
    before = (tmp_path / "my_study" / "experiment.yaml").read_bytes()
    with pytest.raises(InputError, match="there already"):
        new_study(tmp_path / "my_study", [folder], StudyOptions("rating", panel=PANEL))
    assert (tmp_path / "my_study" / "experiment.yaml").read_bytes() == before


def test_one_picture_is_rated_or_refused(tmp_path: Path) -> None:
    picture = draw(tmp_path / "a.png")
    study = new_study(tmp_path / "rated", [picture], StudyOptions("rating", panel=PANEL))
    assert _errors(study) == []
    with pytest.raises(InputError, match="nothing to compare"):
        new_study(tmp_path / "pairs", [picture], StudyOptions(panel=PANEL))


def test_profiles_are_kept(tmp_path: Path) -> None:
    from PIL import ImageCms

    folder = draw_flat(tmp_path / "photos", ("a", "b"))
    srgb = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    Image.open(folder / "a.png").save(folder / "a.png", icc_profile=srgb)
    study = new_study(tmp_path / "my_study", [folder], StudyOptions(panel=PANEL))
    assert "1 picture does not say which colour space" in " ".join(study.notes)
    assert _errors(study) == []


@pytest.mark.nightly
def test_shipped_experiments_are_copied_whole(tmp_path: Path) -> None:
    for name in shipped_studies():
        copied = copy_shipped(name, tmp_path / name)
        report = check_file(copied.experiment, CheckOptions(screen=False, pictures=False))
        assert not report.errors
        assert all(file.is_relative_to(tmp_path / name) for file in copied.files)
    with pytest.raises(InputError, match="dynamic_range"):
        copy_shipped("dynamic_rang", tmp_path / "wrong")


def test_commands_are_quoted() -> None:
    assert typed(("cyclopean", "check", "my study/experiment.yaml")).count("my study/") == 1
    assert "my study/experiment.yaml cyclopean" not in typed(("my study/experiment.yaml", "cyclopean"))


# Sizes of a new study: they fit the mode, no picture is enlarged, and what the recipe makes has the planned pixels.


FULL_HD = PanelSpec(resolution_px=(1920, 1080), pixel_pitch_mm=0.2768)
SIZES = {
    "one": [(640, 480)],
    "landscape": [(4000, 3000)] * 3,
    "portrait": [(3000, 4000)],
    "mixed": [(16, 16), (6000, 400), (300, 5000), (1200, 800)],
    "tall": [(90, 16000)],
    "wide": [(16000, 3)],
}


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("sizes", SIZES.values(), ids=SIZES)
@pytest.mark.parametrize("pairs", [True, False], ids=["pairs", "single"])
def test_the_sizes_fit_the_mode(mode: str, sizes: list[tuple[int, int]], pairs: bool) -> None:
    plan = plan_sizes(sizes, find_mode(mode), FULL_HD, pairs=pairs)
    layout = LayoutSpec(arrangement=plan.arrangement, size_mm=plan.window_mm, gap_mm=GAP_MM)
    placed = (pair_layout if pairs else single_layout)(layout, FULL_HD, Style(plan.view_px))
    assert placed.aperture_px == plan.window_px
    for number, picture in enumerate(plan.pictures):
        (width, height), (across, down) = picture.size_px, picture.shown_px
        assert 1 <= across <= min(width, plan.window_px[0])
        assert 1 <= down <= min(height, plan.window_px[1])
        if picture.is_pixel_for_pixel:
            continue
        # As `stimuli.recipes.picture_steps` resamples: the width is given, the height follows.
        width_mm = plan.width_mm(number)
        made = tuple(display_pixels(mm, FULL_HD.pixel_pitch_mm) for mm in (width_mm, width_mm * height / width))
        assert made == (across, down)


@pytest.mark.parametrize("mode", MODES)
def test_a_picture_that_is_made_smaller_fills_the_room(mode: str) -> None:
    plan = plan_sizes([(4000, 3000)], find_mode(mode), FULL_HD, pairs=True)
    for more_px in (12, 0), (0, 12):
        size_mm = tuple((px + more) * FULL_HD.pixel_pitch_mm for px, more in zip(plan.window_px, more_px, strict=True))
        larger = LayoutSpec(arrangement=plan.arrangement, size_mm=(size_mm[0], size_mm[1]), gap_mm=GAP_MM)
        try:
            pair_layout(larger, FULL_HD, Style(plan.view_px))
        except LayoutError:
            return
    pytest.fail("a larger window would have fitted too")


@pytest.mark.parametrize("pairs", [True, False])
def test_pictures_are_brought_to_one_size_where_they_differ(pairs: bool) -> None:
    def shown(sizes: Sequence[tuple[int, int]], fit: bool | None, *groups: Sequence[int]) -> list[tuple[int, int]]:
        plan = plan_sizes(sizes, find_mode("flat"), FULL_HD, pairs=pairs, fit=fit, compared=groups)
        return [each.shown_px for each in plan.pictures]

    assert shown([(100, 80), (400, 320)], None) == [(100, 80), (100, 80)]
    assert shown([(100, 80), (400, 320)], False) == [(100, 80), (400, 320)]
    assert shown([(100, 80), (102, 82)], None) == [(100, 80), (102, 82)]
    assert shown([(100, 100), (400, 100)], True) == [(100, 100), (200, 50)]
    assert shown([(100, 80), (400, 320), (50, 40), (100, 80)], None, [0, 1], [2, 3]) == [
        (100, 80),
        (100, 80),
        (50, 40),
        (50, 40),
    ]


def test_the_arrangement_lets_pictures_be_larger() -> None:
    half = find_mode("side-by-side")
    assert plan_sizes([(4000, 3000)], half, FULL_HD, pairs=True).arrangement == "vertical"
    assert plan_sizes([(3000, 4000)], half, FULL_HD, pairs=True).arrangement == "horizontal"


def test_the_sentence_says_what_is_made_smaller() -> None:
    def sentence(*sizes: tuple[int, int]) -> str:
        return plan_sizes(sizes, find_mode("flat"), FULL_HD, pairs=True).sentence

    assert sentence((640, 480), (16, 16)) == "Every picture is shown pixel for pixel."
    assert sentence((1884, 1412)) == "Every picture is made smaller to fit, 2 times, in linear light."
    both = sentence((1884, 1412), (16, 16))
    assert both == (
        "1 of 2 pictures is made smaller to fit, 2 times, in linear light; the others are shown pixel for pixel."
    )


def test_a_screen_without_room_is_refused() -> None:
    tiny = PanelSpec(resolution_px=(64, 4), pixel_pitch_mm=0.3)
    with pytest.raises(LayoutError, match="no room for pictures"):
        plan_sizes([(10, 10)], find_mode("side-by-side"), tiny, pairs=True)


def test_a_picture_that_would_vanish_is_refused() -> None:
    with pytest.raises(LayoutError, match="less than a pixel wide"):
        plan_sizes([(3, 16000)], find_mode("flat"), FULL_HD, pairs=True)
