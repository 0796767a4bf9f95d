"""The group of commands: quick, complete, and clear about mistakes."""

from __future__ import annotations

import subprocess
import sys

import pytest
from click.testing import CliRunner

from runner.cli.main import COMMANDS, group


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
    heavy = (
        "numpy",
        "scipy",
        "pydantic",
        "moderngl",
        "glfw",
        "OpenImageIO",
        "matplotlib",
        "colour",
        "rich",
        "yaml",
        "dask",
        "distributed",
    )
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


def test_an_unknown_command_is_answered_with_the_nearest() -> None:
    result = CliRunner().invoke(group, ["shew"])
    assert result.exit_code == 2
    assert "There is no command 'shew'. Did you mean 'show'?" in result.output


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help(name: str) -> None:
    result = CliRunner().invoke(group, [name, "--help"])
    assert result.exit_code == 0
    assert "Usage:" in result.output
