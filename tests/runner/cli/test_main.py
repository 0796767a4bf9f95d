"""The group of commands: quick, complete, and clear about mistakes."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner

from runner.cli.examples import EXAMPLES
from runner.cli.main import group
from runner.cli.options import Whole, Within
from runner.commands import COMMANDS
from tests.choice import nightly
from tests.runner.cli.every_command import commands, offered


def test_every_command_s_line_in_the_group_is_its_own_short_help() -> None:
    context = group.make_context("cyclopean", ["--help"], resilient_parsing=True)
    for name, line in COMMANDS.items():
        if not offered(name):
            continue
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
        (("run", "x.yaml", "--observer", "10", "--observer", "20"), "--observer"),
        (("scores", "x.csv", "--alpha", ".05", "--alpha=.1"), "--alpha"),
        (("display", "fit", "x.csv", "-o", "a", "--output", "b"), "--output"),
    ],
)
def test_a_value_given_twice_is_refused(words: tuple[str, ...], option: str) -> None:
    done = CliRunner().invoke(group, words)
    assert done.exit_code == 2
    assert f"{option} is given twice" in done.output


@pytest.mark.parametrize("words", [("display", "new"), ("export", "results"), ("preview", "x.yaml")])
def test_an_option_that_must_be_given_is_asked_for(words: tuple[str, ...]) -> None:
    done = CliRunner().invoke(group, words)
    assert (done.exit_code, "Missing option" in done.output) == (2, True)


def test_what_may_be_repeated_is_not_refused() -> None:
    words = ("check", "missing.yaml", "--observers", "10", "--observers", "20", "--json", "--json")
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


# Help texts end with examples that the commands themselves can read; shells can complete at Tab.


ROOT = Path(__file__).parents[3]
LINES = [line for called, lines in EXAMPLES.items() if offered(called) for line in lines]
# What takes a moment, and writes at most into the current folder.
QUICK = [
    line
    for line in LINES
    if "--from" not in line  # tests/extensions/sparkle
    and re.search(
        r"^cyclopean (schema|help|stimuli list|scores|display new)|completion|patches .*--list|check configs",
        line,
    )
]


def _words(line: str) -> list[str]:
    """Return a line's words for the program: what a shell does with its output is left out."""
    match = re.search(r"cyclopean [^)|>]*", line)
    assert match
    return shlex.split(match[0])[1:]


def test_every_command_has_examples_and_there_are_no_others() -> None:
    assert set(filter(offered, EXAMPLES)) == {
        called for called, each in commands(group) if not isinstance(each, click.Group)
    }


@pytest.mark.parametrize("line", LINES)
def test_the_command_itself_can_read_its_example(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    context, words = click.Context(group, info_name="cyclopean"), _words(line)
    command: click.Command = group
    while isinstance(command, click.Group):
        name, below, words = command.resolve_command(context, words)
        assert below is not None
        command = below
        if not isinstance(command, click.Group):
            command.make_context(name, list(words), parent=context)
    named = [word for word in _words(line) if re.match(r"(experiments|configs)/", word)]
    assert all(Path(word).exists() for word in named)


@pytest.mark.parametrize("line", QUICK)
def test_quick_examples_run(line: str, tmp_path: Path, cyclopean: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    for folder in ("experiments", "configs"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    (tmp_path / "table.csv").write_text("winner,loser\na,b\nb,c\nc,a\na,c\n", encoding="utf-8")
    assert cyclopean(*_words(line)).stdout


def test_help_prints_what_the_option_prints(cyclopean: Any) -> None:
    for words in (["check"], ["display", "fit"], ["display"]):
        assert cyclopean("help", *words).stdout == cyclopean(*words, "--help").stdout
    assert cyclopean("help").stdout == cyclopean("--help").stdout
    assert "Examples:\n    cyclopean check experiments/dynamic_range.yaml\n" in cyclopean("help", "check").stdout
    assert "Did you mean 'check'?" in cyclopean("help", "chek", expect=2).stderr
    assert "has no commands of its own" in cyclopean("help", "check", "it", expect=2).stderr


@pytest.mark.parametrize(
    ("typed", "completed"),
    [("cyclopean display ver", ["verify"]), *nightly(("cyclopean di", ["display"]), ("cyclopean schema ri", ["rig"]))],
)
def test_a_shell_completes_commands_and_values(typed: str, completed: list[str]) -> None:
    code = "from runner.cli.main import main; main()"
    environment = {
        **os.environ,
        "COMP_WORDS": typed,
        "COMP_CWORD": str(len(typed.split()) - 1),
        "_CYCLOPEAN_COMPLETE": "bash_complete",
    }
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    assert [line.split(",")[1] for line in done.stdout.splitlines()] == completed


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_each_shell_gets_its_lines(shell: str, cyclopean: Any) -> None:
    assert f"_CYCLOPEAN_COMPLETE={shell}_complete" in cyclopean("completion", shell).stdout


# Every option of every command says what it is for.


def test_every_option_has_help() -> None:
    options = [
        (called, one)
        for called, each in commands(group, "cyclopean")
        for one in each.params
        if isinstance(one, click.Option)
    ]
    assert ("cyclopean run", "results") in [(called, one.name) for called, one in options]
    assert [f"{called} {one.opts[0]}" for called, one in options if not one.help] == []


def _numbers() -> Iterator[tuple[str, click.Option, click.ParamType[Any]]]:
    """Yield each number that an option takes, those of several at once too."""
    for called, each in commands(group, "cyclopean"):
        for one in each.params:
            if isinstance(one, click.Option):
                for kind in one.type.types if isinstance(one.type, click.Tuple) else (one.type,):
                    if isinstance(kind, click.types.IntParamType | click.types.FloatParamType):
                        yield called, one, kind


def test_every_number_of_an_option_has_a_range() -> None:
    numbers = list(_numbers())
    assert len(numbers) > 50
    assert [f"{called} {one.opts[0]}" for called, one, kind in numbers if not _has_range(kind)] == []


def _has_range(kind: click.ParamType[Any]) -> bool:
    limits = (kind.min, kind.max) if isinstance(kind, click.IntRange) else (None,)
    return isinstance(kind, Within | Whole) or None not in limits


@pytest.mark.parametrize("word", ["nan", "inf", "-inf", "1e999", "9" * 5000, "-" + "9" * 5000, "x"])
def test_what_is_no_number_that_anybody_means_is_refused(word: str) -> None:
    kinds = {id(kind): kind for _, _, kind in _numbers()}
    for kind in kinds.values():
        with pytest.raises(click.BadParameter):
            kind.convert(word, None, None)


def test_numbers_within_the_range_are_taken() -> None:
    above, seed = Within(0, 1e12, min_open=True), Whole(0, 10**40)
    assert (above.convert("1e-9", None, None), seed.convert(str(2**64), None, None)) == (1e-9, 2**64)
    for kind, word in ((above, "0"), (seed, "-1")):
        with pytest.raises(click.BadParameter):
            kind.convert(word, None, None)
