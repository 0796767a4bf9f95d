"""Packages that are wrong, each in one of many ways, put beside Python's own."""

from __future__ import annotations

from itertools import cycle
from pathlib import Path

# Each group of entry points, with a name that is ours.
GROUPS = {
    **{"blocks": "all_pairs", "records": "all_pairs", "report_parts": "series", "recipes": "pictures"},
    **{"measures": "flip", "scalings": "davidson", "models": "srgb", "readers": "csv", "instruments": "pr655"},
    **{"marks": "serial", "listeners": "", "exporters": "bids", "methods": "pwcmp", "scale_parts": "factors"},
    "diagnostics": "observer_metamerism",
    "commands": "scores",
}
SOUND = "CYCLOPEAN_INTERFACE = 1\nThing = 1"
SPITEFUL = """
CYCLOPEAN_INTERFACE = 1
class Spite:
    def __getattribute__(self, name):
        raise RuntimeError(name)
Thing = Spite()
"""
# What the module holds, and what is offered.
WAYS = (
    ("raise OSError('no such table')", "{name} = {package}:Thing"),
    ("raise SystemExit(3)", "{name} = {package}:Thing"),
    (SOUND.replace("1\n", "99\n"), "{name} = {package}:Thing"),
    (SOUND.replace("1\n", "[1]\n"), "{name} = {package}:Thing"),
    ("Thing = 1", "{name} = {package}:Thing"),
    (SOUND, "{ours} = {package}:Thing"),
    (SOUND, "twice = {package}:Thing"),
    (SOUND, "{name} = {package}:Thing"),
    ("def (:", "{name} = {package}:Thing"),
    ("\0", "{name} = {package}:Thing"),
    (SOUND, "x" * 50_000 + "{name} = {package}:Thing"),
    ("raise OSError('\\x1b[2J\\u202e\\r\\n\\ud800')", "{name}\x1b[31m\u202e = {package}:Thing"),
    (SOUND, "{name} = {package}_gone:Thing"),
    (SOUND, "{name} = {package}:Other"),
    (SOUND, "{name} ="),
    (SOUND, "{name} = ..:..:yaml [x]"),
    (SOUND, "{name} = {package}:none.yaml"),
    (SPITEFUL, "{name} = {package}:Thing"),
    ("import sys\nprint('hello', flush=True)\nraise OSError", "{name} = {package}:Thing"),
    ("def again(): again()\nagain()", "{name} = {package}:Thing"),
    ("raise OSError('long ' * 50_000)", "{name} = {package}:Thing"),
)


def install_broken(site: Path, number: int = 200) -> list[str]:
    """Put so many packages into the folder ``site``, beside some of which nobody can say the name; return the names."""
    site.mkdir()
    for odd, facts in (("nameless", "Version: 1.0\n"), ("empty", ""), ("bytes", "Name: \udcff\n")):
        (site / f"{odd}.dist-info").mkdir()
        (site / f"{odd}.dist-info" / "METADATA").write_text(facts, "utf-8", "surrogateescape")
        (site / f"{odd}.dist-info" / "entry_points.txt").write_text("[cyclopean.blocks]\nodd = odd:Odd\n", "utf-8")
    (site / "file.dist-info").write_text("no folder")
    names = [f"broken_{at}" for at in range(number)]
    for at, (package, (text, offered), group) in enumerate(zip(names, cycle(WAYS), cycle(GROUPS), strict=False)):
        group = "blocks" if "twice" in offered else group
        folder = site / f"{package}.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text(f"Name: {package}\n" + "Version: \x1b[31m1.0\n" * (at % 3 > 0), "utf-8")
        line = offered.format(name=f"thing{at}", package=package, ours=GROUPS[group] or f"thing{at}")
        (folder / "entry_points.txt").write_text(f"[cyclopean.{group}]\n{line}\n", "utf-8")
        (site / f"{package}.py").write_text(text, "utf-8")
    return names
