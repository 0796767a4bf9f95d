"""Whether two gamma tables are the same, when drivers round them: wrong verdicts beside those of simpler rules.

A table is drawn (the identity, a power, a night light, a calibration with ripples) and read back by a driver of 256,
1024 or 4096 entries of 8, 10, 12 or 16 bits, cut or rounded, and written to 16 bits in one of three ways. The error is
the share of wrong verdicts: tables refused that another driver returned of the same, or changes of 1, 2 or 4 codes of 8
bits missed. What is wrongly refused is read by drivers of one size and number of bits: one cuts, the other rounds.
Under Xvfb it also times what a session does at each answer: to read the table of its monitor.
"""

from __future__ import annotations

import os
import shutil
import subprocess

import numpy as np
from curves import Row, is_quick, program, seconds, sized
from promises import Promise, worst

from devices.display import GammaTable
from documents.arrays import Floats

TABLES = sized(400, 8)
RULES = ("steps of the table's bits", "equal bytes", "within half a code of 8 bits", "within two codes of 8 bits")


def drawn(rng: np.random.Generator, size: int) -> Floats:
    """Return a table of ``size`` entries, shape (size, 3), as calibrations and night lights load them."""
    at = np.linspace(0.0, 1.0, size)[:, None]
    kind = rng.integers(4)
    if kind == 0:
        return np.repeat(at, 3, axis=1)
    if kind == 1:
        return np.asarray(at ** rng.uniform(0.8, 1.3, 3))
    if kind == 2:
        return at * np.array([1.0, rng.uniform(0.6, 1.0), rng.uniform(0.4, 1.0)])
    ripple = rng.uniform(-0.02, 0.02, 3) * np.sin(2 * np.pi * rng.integers(1, 4, 3) * at)
    return np.clip(at ** rng.uniform(0.9, 1.1, 3) * rng.uniform(0.9, 0.97, 3) + ripple, 0.0, 1.0)


def read_back(rng: np.random.Generator, shares: Floats, bits: int) -> GammaTable:
    """Return ``shares`` as a driver with hardware of ``bits`` bits returns them."""
    highest = 2**bits - 1
    value = np.floor(shares * highest + (0.5 if rng.integers(2) else 1e-9)).astype(np.int64)
    ways = (value << (16 - bits), value << (16 - bits) | value >> (2 * bits - 16), np.rint(value * (65535 / highest)))
    return GammaTable(ways[rng.integers(3)].astype(np.uint16))


def same(rule: str, one: GammaTable, two: GammaTable) -> bool:
    """Return what ``rule`` says of two tables."""
    if rule == RULES[0]:
        return bool(one.same_as(two))
    if rule == RULES[1]:
        return np.array_equal(np.asarray(one.entries), np.asarray(two.entries))
    return one.difference_codes(two) < (0.5 if rule == RULES[2] else 2.0)


def wrong(rule: str, change_codes: float, tables: int, seed: int = 1) -> float:
    """Return the share of wrong verdicts of ``rule`` on ``tables`` that changed by so many codes, or not at all.

    Unchanged tables come from any two drivers; changed ones are read by the driver that read them before.
    """
    rng = np.random.default_rng(seed)
    errors = 0
    for _ in range(tables):
        sizes, bits = rng.choice([256, 1024, 4096], 2), rng.choice([8, 10, 12, 16], 2)
        shape = np.random.default_rng(rng.integers(2**32))
        state = shape.bit_generator.state
        before = drawn(shape, int(sizes[0]))
        if change_codes:
            after = before + change_codes / 255.0 * np.where(before.max(axis=0) > 0.5, -1.0, 1.0) * before.clip(0, 1)
            verdict = same(rule, *(read_back(rng, shares.clip(0, 1), int(bits[0])) for shares in (before, after)))
            errors += verdict
        else:
            shape.bit_generator.state = state
            again = drawn(shape, int(sizes[1]))
            errors += not same(rule, read_back(rng, before, int(bits[0])), read_back(rng, again, int(bits[1])))
    return errors / tables


def run() -> dict[str, object]:
    """Judge tables by each rule, and read a monitor's."""
    rows: list[Row] = []
    one, two = (GammaTable.from_shares(np.linspace(0, 1, 1024) ** power) for power in (1.2, 1.21))
    for rule in RULES:
        taken = seconds(lambda rule=rule: same(rule, one, two))
        for change in (0.0, 1.0, 2.0, 4.0):
            what = "unchanged, another driver" if not change else f"changed by {change:g} codes"
            row: Row = {"series": rule, "parameter": what, "seconds": taken, "error": wrong(rule, change, TABLES)}
            rows.append(row)
    rows += _read_times()
    changed = [row for row in rows if row["series"] == RULES[0] and str(row["parameter"]).startswith("changed")]
    promises = [Promise("share of changes by a code or more that are missed", worst(changed), 0.0, "error", "exactly")]
    return {"promises": promises, "title": "Gamma tables: the same, or another?", "rows": rows}


def _read_times() -> list[Row]:
    if shutil.which("Xvfb") is None or is_quick():
        return []
    read, write_to = os.pipe()
    command = ["Xvfb", "-displayfd", str(write_to), "-screen", "0", "640x480x24", "-nolisten", "tcp", "-noreset"]
    with subprocess.Popen(command, pass_fds=[write_to], stderr=subprocess.DEVNULL) as server:
        os.close(write_to)
        try:
            with os.fdopen(read) as told:
                os.environ["DISPLAY"] = f":{told.readline().strip()}"
            os.environ.pop("WAYLAND_DISPLAY", None)
            from runner.presenter.surfaces.opening import open_surface

            with open_surface("window", (320, 240), windowed=True) as surface:
                taken = seconds(surface.gamma_tables, repeats=50)
        finally:
            server.terminate()
    return [{"series": "read the table of the window's monitor", "parameter": "256", "seconds": taken, "error": 0.0}]


if __name__ == "__main__":
    program("gamma_table", run)
