"""Readings that make no sense stop `display measure`, are set aside and read again; those of odd displays do not."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from devices.readings import (
    KeptReading,
    Patch,
    PatchOnScreen,
    PatchTurn,
    Reading,
    Simulated,
    find_patches,
    read_measurements,
    read_session,
    steps,
)
from documents.arrays import Floats
from runner.cli.main import group
from runner.measuring.judge import Judge
from tests.choice import nightly

Fault = Callable[[Floats, PatchOnScreen], Floats]
DISPLAY = """\
schema_version: 1
panel: {{resolution_px: [64, 48], pixel_pitch_mm: 0.25}}
modes:
  side-by-side:
    black_XYZ_cd_m2: {black}
    primaries_XYZ_cd_m2: {{red: {red}, green: {green}, blue: {blue}}}
    curve: {{kind: gog, red: {{gamma: 2.1}}, green: {{gamma: 2.2}}, blue: {{gamma: 2.3}}}}
    source: made up for tests
"""
RED, GREEN, BLUE = np.array([41.2, 21.3, 1.9]), np.array([35.8, 71.5, 11.9]), np.array([18.0, 7.2, 95.1])
BLACK = np.array([0.1, 0.1, 0.15])
SIMULATED = ("--instrument", "simulated", "--backend", "null", "--settle", "0", "--mode", "side-by-side")
LATE = 12
LEVELS = (51, 204, 255)


def display(folder: Path, black: Floats, *primaries: Floats) -> None:
    red, green, blue, dark = (json.dumps(np.round(each, 9).tolist()) for each in (*primaries, black))
    (folder / "display.yaml").write_text(DISPLAY.format(red=red, green=green, blue=blue, black=dark))
    lit = {"red": (1, 0, 0), "green": (0, 1, 0), "blue": (0, 0, 1), "yellow": (1, 1, 0), "cyan": (0, 1, 1)}
    lit |= {"magenta": (1, 0, 1), "grey": (1, 1, 1)}
    rows = [f"{name}{level},{r * level},{g * level},{b * level}" for name, (r, g, b) in lit.items() for level in LEVELS]
    (folder / "own.csv").write_text("# codes: 0..255\nname,red,green,blue\n" + "\n".join(rows) + "\n")


def measure(folder: Path, *more: str) -> Result:
    words = ["display", "measure", str(folder / "display.yaml"), "-o", str(folder / "m.jsonl"), *SIMULATED]
    words += ["--set", str(folder / "own.csv"), "--repeat-every", "6", *more]
    return CliRunner().invoke(group, words)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    display(tmp_path, BLACK, RED, GREEN, BLUE)
    return tmp_path


@pytest.fixture
def play(monkeypatch: pytest.MonkeyPatch) -> Callable[[Fault | None], None]:
    """Let a fault change what the simulated instrument reads; None takes it away."""
    honest = Simulated.read

    def make(fault: Fault | None) -> None:
        def read(self: Simulated, showing: PatchOnScreen) -> Reading:
            if fault is swapped_codes:
                showing = replace(showing, codes=(showing.codes[1], showing.codes[0], showing.codes[2]))
            reading = honest(self, showing)
            X, Y, Z = map(float, fault(np.array(reading.XYZ_cd_m2), showing) if fault else reading.XYZ_cd_m2)
            return Reading((X, Y, Z))

        monkeypatch.setattr(Simulated, "read", read)

    return make


def swapped_codes(XYZ: Floats, showing: PatchOnScreen) -> Floats:
    return XYZ


def late(change: Callable[[Floats], Floats]) -> Fault:
    return lambda XYZ, showing: change(XYZ) if showing.position >= LATE else XYZ


WHITE = BLACK + RED + GREEN + BLUE
FAULTS: dict[str, tuple[Fault, str]] = {
    "stuck": (lambda XYZ, showing: np.array([5.0, 6.0, 7.0]), "does not see the patch"),
    "all zero": (lambda XYZ, showing: 0.0 * XYZ, "does not see the patch"),
    "a cap on": (lambda XYZ, showing: 1e-5 * XYZ, "does not see the patch"),
    "aimed beside": (lambda XYZ, showing: 0.002 * XYZ + 3.0, "does not see the patch"),
    "all negative": (lambda XYZ, showing: -XYZ, "does not see the patch"),
    "a wrong dark level": (lambda XYZ, showing: XYZ - 3.0, "below zero"),
    "another unit": (lambda XYZ, showing: 1e7 * XYZ, "brighter than any display"),
    "one reading of 1e9": (
        lambda XYZ, showing: XYZ + (1e9 if showing.position == LATE else 0.0),
        "brighter than any display",
    ),
    "Z Y X": (lambda XYZ, showing: XYZ[::-1], "do not read as the colours"),
    "red and green exchanged": (swapped_codes, "red and green do not read"),
    "blue first": (lambda XYZ, showing: XYZ[[2, 0, 1]], "do not read as the colours"),
    "stuck later": (late(lambda XYZ: np.array([50.0, 60.0, 70.0])), "all read exactly"),
    "dimmed later": (late(lambda XYZ: 0.6 * XYZ), "let the display warm up"),
    "a cap on later": (late(lambda XYZ: 0.0 * XYZ), "does not see the patch"),
    "slipped off later": (late(lambda XYZ: 0.2 + 0.0001 * XYZ), "does not see the patch"),
    "saturated": (lambda XYZ, showing: np.minimum(XYZ, 0.5 * WHITE), "is exactly .*saturated"),
}
# One for each of what is said.
MECHANISMS = (
    "stuck",
    "a wrong dark level",
    "one reading of 1e9",
    "red and green exchanged",
    "stuck later",
    "saturated",
)


@pytest.mark.parametrize("name", [*MECHANISMS, *nightly(*(name for name in FAULTS if name not in MECHANISMS))])
def test_readings_without_sense_stop_it_and_are_read_again(
    folder: Path, play: Callable[[Fault | None], None], name: str
) -> None:
    fault, says = FAULTS[name]
    play(fault)
    result = measure(folder)
    assert result.exit_code == 1
    words = " ".join(str(result.exception).split())
    assert re.search(says, words), words
    assert "--accept-readings" in words
    session = read_session(folder / "m.jsonl")
    taken = len([line for line in (folder / "m.jsonl").read_text().splitlines() if '"reading"' in line])
    assert len(session.readings) < taken  # what was doubted does not count
    play(None)
    result = measure(folder, "--resume")
    assert result.exit_code == 0, result.output[-500:]
    table = read_measurements(folder / "m.jsonl")
    assert len(table) == len(session.steps)
    white = table.XYZ[[name == "white" for name in table.name]]
    np.testing.assert_allclose(white, np.broadcast_to(WHITE, white.shape), rtol=0.02)


def test_who_knows_better_keeps_them_and_the_log_the_table_and_the_fit_say_so(
    folder: Path, play: Callable[[Fault | None], None]
) -> None:
    play(late(lambda XYZ: 0.7 * XYZ))
    assert measure(folder).exit_code == 1
    result = measure(folder, "--resume", "--accept-readings", "--json")
    assert result.exit_code == 0, result.output[-500:]
    done = json.loads(result.stdout)
    assert not done["missing"]
    assert len(done["accepted"]) == 1  # said once, not at every white
    assert "white read" in done["accepted"][0]
    notes = [line for line in map(json.loads, (folder / "m.jsonl").read_text().splitlines()) if "accepted" in line]
    assert [note["accepted"] for note in notes] == done["accepted"]
    assert any("doubted while they were taken" in said for said in read_measurements(folder / "m.jsonl").assumptions)
    assert "doubted while they were taken" in (folder / "m.csv").read_text()


def test_a_display_that_stays_changed_is_not_resumed_in_silence(
    folder: Path, play: Callable[[Fault | None], None]
) -> None:
    dimmed = late(lambda XYZ: 0.7 * XYZ)
    play(dimmed)
    assert measure(folder).exit_code == 1
    again = measure(folder, "--resume")
    assert again.exit_code == 1
    assert "begin again" in str(again.exception)


@pytest.mark.usefixtures("egl")
def test_a_verification_is_judged_too(folder: Path, play: Callable[[Fault | None], None]) -> None:
    play(FAULTS["stuck"][0])
    words = ["display", "verify", "--display", str(folder / "display.yaml"), *SIMULATED[:2], "--backend", "egl"]
    words += ["--settle", "0", "--mode", "side-by-side", "-o", str(folder / "v.jsonl")]
    result = CliRunner().invoke(group, words)
    assert result.exit_code == 1
    assert "does not see the patch" in str(result.exception)
    assert CliRunner().invoke(group, [*words, "--resume", "--accept-readings"]).exit_code == 0


def behind(*light: Floats) -> Fault:
    """Return the light of four colours, black first, whatever the display file says of them, without any noise."""
    return lambda XYZ, showing: light[0] + np.array(showing.codes) ** 2.2 @ np.array(light[1:])


ODD: dict[str, tuple[Sequence[Floats], Sequence[str]]] = {
    "healthy": ((BLACK, RED, GREEN, BLUE), ()),
    "noisy": ((BLACK, RED, GREEN, BLUE), ("noise=0.02",)),
    "a dark projector through glasses": ((1e-4 * BLACK, 3e-3 * RED, 3e-3 * GREEN, 3e-3 * BLUE), ("floor_cd_m2=0.003",)),
    "an OLED with no black light": ((0 * BLACK, RED, GREEN, BLUE), ("floor_cd_m2=0.002",)),
    "an OLED read without noise": ((0 * BLACK, RED, GREEN, BLUE), ("noise=0",)),
    "through the cyan filter": ((0.1 * BLACK, 0.004 * RED, 0.3 * GREEN, 0.5 * BLUE), ()),
    "a strong leak": ((BLACK, RED, GREEN, BLUE), ("crosstalk=0.5",)),
    "in a lit room": ((50 * BLACK, 0.08 * RED, 0.08 * GREEN, 0.08 * BLUE), ()),
    "very bright": ((50 * BLACK, 50 * RED, 50 * GREEN, 50 * BLUE), ()),
    "limited in full white": ((BLACK, RED, GREEN, BLUE), ("picture_level_limit=0.5", "dynamic_contrast=0.4")),
    "a white segment": ((BLACK, RED, GREEN, BLUE), ("white_segment=0.8", "additivity_loss=0.3")),
}


FILTERED: dict[str, Sequence[Floats]] = {
    "a perfect red filter": (0.1 * BLACK, 0.5 * RED, 0 * GREEN, 0 * BLUE),
    "a dark blue filter": (0.01 * BLACK, 1e-4 * RED, 0.004 * BLUE, 0.02 * BLUE),
}


@pytest.mark.parametrize("name", ["a perfect red filter", *nightly("a dark blue filter")])
def test_what_a_filter_takes_is_not_missed(folder: Path, play: Callable[[Fault | None], None], name: str) -> None:
    play(behind(*FILTERED[name]))
    result = measure(folder, "--eye", "left")
    assert result.exit_code == 0, result.output[-500:]
    assert not read_session(folder / "m.jsonl").accepted


@pytest.mark.stress
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("name", [*ODD, *FILTERED])
def test_odd_displays_in_every_set_of_patches(
    tmp_path: Path, play: Callable[[Fault | None], None], name: str, seed: int
) -> None:
    light, faults = ODD.get(name, ((BLACK, RED, GREEN, BLUE), ()))
    display(tmp_path, *light)
    if name in FILTERED:
        play(behind(*FILTERED[name]))
    options = [word for fault in faults for word in ("--instrument-option", fault)]
    options += [word for each in ("table_c1", "dark", "additivity") for word in ("--set", each)]
    result = measure(tmp_path, "--eye", "left", "--seed", str(seed), *options)
    assert result.exit_code == 0, result.output[-500:]


def _judged(levels: Sequence[float], name: str = "white", code: float = 1.0, **patch: float) -> list[str]:
    judge, kinds = Judge(), []
    for position, level in enumerate(levels):
        step = PatchTurn(position, f"{name}#{position}", Patch(name, (code, code, code), **patch))  # type: ignore[arg-type]  # wait_s alone
        doubt = judge.doubt(step, Reading((level, level, level)))
        kinds.append(doubt.kind if doubt else "")
    return kinds


def test_white_may_change_as_much_as_a_display_that_warms_up() -> None:
    warming = 100 * (1 - 0.4 * np.exp(-np.arange(0, 3600, 120) / 480))  # from cold, black and white every two minutes
    assert not any(_judged(warming.tolist()))
    assert _judged([100.0, 79.0]) == ["", "drift"]
    assert _judged([100.0, 81.0]) == ["", ""]
    assert not any(_judged([100.0, 50.0], wait_s=60.0))  # the warm-up is what such patches are for
    assert not any(_judged([0.05, 0.08]))  # noise near what an instrument can read
    assert not any(_judged([0.0, 0.0, 0.0], "black", 0.0))


def test_all_that_was_read_since_the_last_right_white_is_set_aside() -> None:
    order = steps(find_patches("grey"), 1)
    judge = Judge()
    for step in order[:16]:
        level = (60.0 if step.position > 5 else 100.0) * step.patch.codes[0] ** 2.2
        doubt = judge.doubt(step, Reading((level, level, level)))
    assert doubt is not None
    assert [step.label for step in order[:2]] == ["black", "white"]
    assert doubt.labels == tuple(step.label for step in order[2:16])
    assert doubt.labels[-2:] == ("black#2", "white#2")


def test_what_was_measured_before_counts_on_resuming() -> None:
    order = steps(find_patches("grey"), 1)
    before = [KeptReading(0, 0.0, Reading((0.1, 0.1, 0.1))), KeptReading(1, 1.0, Reading((95.0, 100.0, 109.0)))]
    white = next(step for step in order if step.label == "white#2")
    doubt = Judge(before, order).doubt(white, Reading((47.0, 50.0, 55.0)))
    assert doubt is not None
    assert (doubt.kind, doubt.labels) == ("drift", ("white#2",))  # those from before stay


def wrong_lens(*eyes: str, own: float = 1.0) -> Fault:
    """Read through the other eye's lens, which passes ``own`` of the light that the right one does, for these eyes."""

    def read(XYZ: Floats, showing: PatchOnScreen) -> Floats:
        assert showing.patch is not None
        if showing.patch.eye not in eyes or showing.patch.other is None:
            return XYZ
        return np.asarray(BLACK + own * (np.array(showing.patch.other) ** 2.2 @ np.array([RED, GREEN, BLUE])))

    return read


@pytest.mark.parametrize(
    ("eyes", "own"), [("left", 1.0), ("right", 0.05), *nightly(("left right", 1.0), ("left", 0.05))]
)
def test_a_lens_that_passes_the_other_eye_s_picture_is_the_wrong_one(
    folder: Path, play: Callable[[Fault | None], None], eyes: str, own: float
) -> None:
    """However much of its own eye's picture it passes beside: a tenth here."""
    leaky = wrong_lens(*eyes.split(), own=own)
    play(lambda XYZ, showing: leaky(XYZ, showing) + 0.1 * own * (XYZ - BLACK))
    result = measure(folder, "--set", "crosstalk", "--unattended")
    assert result.exit_code == 1
    words = " ".join(str(result.exception).split())
    assert f"put the {eyes.split()[0]} eye's lens before the instrument" in words, words[-1000:]
    play(None)
    result = measure(folder, "--set", "crosstalk", "--unattended", "--resume")
    assert result.exit_code == 0, result.output[-500:]
    assert not read_session(folder / "m.jsonl").accepted


@pytest.mark.parametrize("crosstalk", ["0.5", *nightly("0", "0.03")])
def test_a_lens_that_leaks_is_not_the_wrong_one(folder: Path, crosstalk: str) -> None:
    leak = ("--instrument-option", f"crosstalk={crosstalk}", "--instrument-option", "noise=0.02")
    result = measure(folder, "--set", "crosstalk", "--unattended", *leak)
    assert result.exit_code == 0, result.output[-500:]
    assert not read_session(folder / "m.jsonl").accepted
