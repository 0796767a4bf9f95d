"""The group of commands: quick, complete, and clear about mistakes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from runner.cli.main import group
from runner.commands import COMMANDS


def test_every_command_s_line_in_the_group_is_its_own_short_help() -> None:
    context = group.make_context("cyclopean", ["--help"], resilient_parsing=True)
    for name, line in COMMANDS.items():
        command = group.get_command(context, name)
        assert command is not None
        assert command.get_short_help_str(limit=200) == line
        assert command.help
        assert command.help.startswith(line.rstrip("."))


def test_the_help_imports_nothing_heavy() -> None:
    code = (
        "import sys\nfrom runner.cli.main import main\nsys.argv = ['cyclopean', '--help']\n"
        "try: main()\nexcept SystemExit: pass\n"
        "print(sorted({name.partition('.')[0] for name in sys.modules}), file=sys.stderr)"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    imported = told.stderr
    heavy = {"numpy", "scipy", "pydantic", "moderngl", "glfw", "OpenImageIO", "matplotlib", "colour", "rich", "yaml"}
    heavy |= {"dask", "distributed"}
    assert "'click'" in imported
    assert [name for name in heavy if f"'{name}'" in imported] == []


def test_a_start_looks_for_no_plugins_and_seldom_for_cycles() -> None:
    code = (
        "import gc, importlib.metadata, sys\nimportlib.metadata.entry_points = None\n"
        "from runner.cli.main import main\nsys.argv = ['cyclopean', 'schema', 'rig']\n"
        "try: main()\nfinally: print(gc.get_threshold()[0], file=sys.stderr)"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (told.returncode, told.stderr) == (0, "10000\n")


@pytest.mark.parametrize(
    ("words", "option"),
    [
        (("power", "x.yaml", "--observers", "10", "--observers", "20"), "--observers"),
        (("scores", "x.csv", "--alpha", ".05", "--alpha=.1"), "--alpha"),
        (("display", "fit", "x.csv", "-o", "a", "--output", "b"), "--output"),
    ],
)
def test_a_value_given_twice_is_refused(words: tuple[str, ...], option: str) -> None:
    done = CliRunner().invoke(group, words)
    assert done.exit_code == 2
    assert f"{option} is given twice" in done.output


@pytest.mark.parametrize("words", [("display", "convert", "x.csv"), ("agreement", "results"), ("preview", "x.yaml")])
def test_an_option_that_must_be_given_is_asked_for(words: tuple[str, ...]) -> None:
    done = CliRunner().invoke(group, words)
    assert (done.exit_code, "Missing option" in done.output) == (2, True)


def test_what_may_be_repeated_is_not_refused() -> None:
    words = ("power", "missing.yaml", "--pair", "a", "b", "--pair", "b", "c", "--json", "--json")
    assert "twice" not in CliRunner().invoke(group, words).output


TOOL = """
CYCLOPEAN_INTERFACE = 1
import click

@click.command()
@click.option("--size", default=1)
def jug(size): click.echo(f"a jug of {size}")
"""


def test_a_command_of_another_package_runs_and_is_listed_and_takes_none_of_ours(tmp_path: Path) -> None:
    facts = tmp_path / "pottery-1.0.dist-info"
    facts.mkdir()
    (tmp_path / "pottery.py").write_text(TOOL)
    (facts / "METADATA").write_text("Metadata-Version: 2.1\nName: pottery\nVersion: 1.0\n")
    (facts / "entry_points.txt").write_text(
        "[cyclopean.commands]\njug = pottery:jug\nrun = pottery:jug\ncamera.jug = pottery:jug\n"
    )
    places = {"PYTHONPATH": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache")}

    def typed(*words: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "cyclopean", *words]
        return subprocess.run(command, capture_output=True, text=True, check=False, env={**os.environ, **places})

    assert typed("jug", "--size", "2").stdout == typed("camera", "jug", "--size", "2").stdout == "a jug of 2\n"
    assert "no command 'camera.jug'" in typed("camera.jug").stderr
    assert typed("jug", "--size", "2", "--size", "3").returncode == 2
    assert "  camera jug  of pottery 1.0" in typed("help").stdout
    assert "jug" not in typed("run", "--help").stdout
    (tmp_path / "pottery.py").write_text("raise OSError('no clay')")
    broken = typed("jug")
    assert broken.returncode == 2
    assert "OSError: no clay" in broken.stderr
    assert typed("schema", "rig").returncode == 0
