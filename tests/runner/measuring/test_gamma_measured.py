"""The gamma table that readings were taken with: kept, carried into the display file, held against what is loaded."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from devices.display import EYES, GammaTable, read_display
from devices.errors import MeasuringError
from devices.readings import find_patches, read_measurements, read_session
from documents import InputError
from runner import measuring
from tests.invoked import invoked
from tests.runner.measuring.displays import DISPLAY, write_rig

Load = Callable[[float], None]
pytestmark = pytest.mark.window

SIMULATED = measuring.InstrumentOptions("simulated")
IN_A_WINDOW = measuring.ShowPatches(settle_s=0.0, windowed=True)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_rig(tmp_path)
    greys = "".join(f"{code},{code},{code}\n" for code in range(20, 260, 40))
    (tmp_path / "some.csv").write_text("# codes: 0..255\nred,green,blue\n" + greys)
    return tmp_path


def measured(
    folder: Path,
    name: str = "m.jsonl",
    patches: str = "some.csv",
    dialogue: measuring.Dialogue | None = None,
    **more: Any,
) -> Any:
    """Read some greys in a window."""
    shown = measuring.PatchOptions((str(folder / patches),))
    options = measuring.MeasureOptions(
        output=folder / name, instrument=SIMULATED, patches=shown, show=IN_A_WINDOW, **more
    )
    return measuring.measure_display(folder / "rig.yaml", options, dialogue)


def measure(folder: Path, name: str = "m.jsonl", **more: Any) -> dict[str, Any]:
    """Read some greys in a window, and return the log's header."""
    return dict(measured(folder, name, **more).session.header)


def power(exponent: float) -> GammaTable:
    return GammaTable.from_shares(np.linspace(0, 1, 256) ** exponent)


display_command = partial(invoked, "display")


def test_readings_keep_the_table_through_every_file(folder: Path, load_table: Load) -> None:
    header = measure(folder, tables=(folder / "m.csv", folder / "m.ti3"))
    assert header["gamma_table"] == power(1.1).to_json()
    for name in ("m.jsonl", "m.csv"):
        table = read_measurements(folder / name).gamma_table
        assert table is not None
        assert np.array_equal(np.asarray(table.entries), np.asarray(power(1.1).entries))
    # In a .ti3 a table stands for codes that went through it, which hold with the identity.
    of_ti3, plain = read_measurements(folder / "m.ti3"), read_measurements(folder / "m.jsonl")
    assert of_ti3.gamma_table is not None
    assert of_ti3.gamma_table.is_identity
    np.testing.assert_allclose(of_ti3.codes, power(1.1).at(plain.codes), atol=1e-5)


@pytest.mark.nightly
def test_a_fit_carries_the_table_into_the_display_file(folder: Path, load_table: Load) -> None:
    codes = [patch.codes for patch in find_patches("table_c1").patches][::3]  # a third of them tells as much here
    rows = "".join(",".join(f"{255 * code:g}" for code in one) + "\n" for one in codes)
    (folder / "own.csv").write_text("# codes: 0..255\nred,green,blue\n" + rows)
    measured(folder, patches="own.csv")
    new = folder / "new.yaml"
    told = display_command("fit", folder / "m.jsonl", "--model", "gog", "--brief", "-o", new)
    assert told.exit_code == 0, told.output
    assert "hold with the gamma table that was loaded, which is not the identity: off by up to 8.9" in told.output
    held = yaml.safe_load(new.read_text())["modes"]["row-interleaved"]["gamma_table"]
    assert held == power(1.1).to_json()
    display = read_display(new)
    assert all(display.gamma_table("row-interleaved", eye).same_as(power(1.1)) for eye in EYES)
    # Readings that say nothing of a table take what the readings before said away.
    bare = "".join(line for line in (folder / "m.csv").read_text().splitlines(True) if "gamma_table" not in line)
    (folder / "bare.csv").write_text(bare)
    told = display_command("fit", folder / "bare.csv", "--model", "gog", "--brief", "-o", new, "--replace")
    assert told.exit_code == 0, told.output
    assert not read_display(new).gamma_table("row-interleaved", "left").known


@pytest.mark.nightly
def test_a_measurement_is_resumed_with_its_own_table_alone(folder: Path, load_table: Load) -> None:
    measure(folder)
    lines = (folder / "m.jsonl").read_text().splitlines(True)
    (folder / "m.jsonl").write_text("".join(lines[:6]))
    load_table(1.0)
    with pytest.raises(MeasuringError, match="began with another gamma table"):
        measure(folder, resume=True)
    load_table(1.1)
    measure(folder, resume=True)
    assert not read_session(folder / "m.jsonl").missing


@pytest.mark.nightly
def test_a_change_stops_the_measurement_without_the_reading_that_it_spoilt(folder: Path, load_table: Load) -> None:
    def change(words: str) -> None:
        if words.startswith("5/"):
            load_table(0.9)

    file = folder / "m.jsonl"
    report = measured(folder, dialogue=measuring.Dialogue(say=change))
    assert "the gamma table on 'screen' changed" in report.outcome.stopped
    assert len(report.session.readings) == report.outcome.taken == 5
    stopped = [line for line in map(json.loads, file.read_text().splitlines()) if line["record"] == "note"]
    assert "changed" in stopped[-1]["stopped"]
    load_table(1.1)
    measure(folder, resume=True)
    assert not read_session(file).missing


def test_without_a_window_the_readings_say_why_the_table_is_unknown(folder: Path) -> None:
    told = display_command("measure", folder / "rig.yaml", "-o", folder / "m.jsonl", "--set", "grey", "--settle", "0",
                           "--instrument", "simulated", "--backend", "egl")  # fmt: skip
    if told.exit_code:
        pytest.skip(str(told.exception))
    table = read_measurements(folder / "m.csv").gamma_table
    assert table is not None
    assert table.unknown == "it was drawn without a window"


@pytest.mark.parametrize(
    ("held", "words"),
    [
        ("{size: 256}", "size and hash"),
        ("{hash: abc, size: 256, departure_codes: 12.0}", "needs its entries"),
        ("{unknown: nobody looked, size: 256}", "no other key"),
        ("{loaded: identity}", "loaded"),
    ],
)
def test_a_wrong_table_in_a_display_file_is_found_at_its_place(folder: Path, held: str, words: str) -> None:
    text = DISPLAY.rstrip("\n") + f"\n    gamma_table: {held}\n"
    (folder / "display.yaml").write_text(text)
    with pytest.raises(InputError, match=words) as raised:
        read_display(folder / "display.yaml")
    (finding,) = raised.value.findings
    assert finding.line == len(text.splitlines())


@pytest.mark.nightly
def test_patches_shown_for_another_instrument_name_their_table(folder: Path, load_table: Load) -> None:
    shown = folder / "shown.csv"
    command = ["patches", folder / "rig.yaml", "--set", "grey", "--windowed", "--settle", "0", "--each", "0.001"]
    told = display_command(*command, "-o", shown)
    assert told.exit_code == 0, told.output
    filled = shown.read_text().replace(",,,,", ",1,1,1,")
    shown.write_text(filled)
    table = read_measurements(shown).gamma_table
    assert table is not None
    assert table.same_as(power(1.1))


def test_a_wrong_table_in_a_csv_is_found_at_its_line(tmp_path: Path) -> None:
    text = "# codes: 0..255\n# gamma_table: hash=abc size=256 departure_codes=30\nred,green,blue,X,Y,Z\n0,0,0,1,1,1\n"
    (tmp_path / "m.csv").write_text(text)
    with pytest.raises(InputError, match="needs its entries") as raised:
        read_measurements(tmp_path / "m.csv")
    assert raised.value.findings[0].line == 2
