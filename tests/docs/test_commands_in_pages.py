"""Commands and names that pages give are right, and the index lists every page."""

from __future__ import annotations

import importlib
import re
import shlex
from pathlib import Path

import click
import pytest

from runner.blocks import BLOCKS
from runner.check import REGISTRIES
from runner.cli.main import group
from runner.presenter import MODES

# Every command that a page tells the reader to type exists, with every option it names.

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
_COMMAND = re.compile(r"^(?:\.venv/bin/)?cyclopean(?: \S|$)")


def _block_commands(page: Path) -> list[str]:
    """Return the commands that stand on lines of their own in code blocks; a backslash continues a line."""
    lines = page.read_text(encoding="utf-8").splitlines()
    commands, fenced, number = [], False, 0
    while number < len(lines):
        line = lines[number]
        fenced ^= line.startswith("```")
        if (fenced or line.startswith("    ")) and _COMMAND.match(line.strip()):
            words = line.strip()
            while words.endswith("\\"):
                number += 1
                words = words[:-1] + " " + lines[number].strip()
            commands.append(words)
        number += 1
    return commands


def _inline_commands(page: Path) -> list[str]:
    """Return the commands between backticks."""
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    return [words.replace("\n", " ") for words in re.findall(r"`((?:\.venv/bin/)?cyclopean [-a-z][^`]*)`", text)]


def _find(words: list[str]) -> tuple[click.Command, list[str]]:
    """Return the command that ``words`` name, and the words after its name."""
    command: click.Command = group
    rest = words[1:]
    while isinstance(command, click.Group) and rest and not rest[0].startswith("-"):
        found = command.get_command(click.Context(command), rest[0])
        assert found is not None, f"there is no command '{rest[0]}'"
        command, rest = found, rest[1:]
    return command, rest


def _check_options(command: click.Command, words: list[str]) -> None:
    known = {"--help", *(name for one in command.params for name in (*one.opts, *one.secondary_opts))}
    for word in words:
        if re.match(r"^--?[a-zA-Z]", word):
            assert word.split("=")[0] in known, f"'{command.name}' has no option '{word}'"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_exist(page: Path) -> None:
    for text in _block_commands(page):
        words = shlex.split(re.split(r"[|<>]", text)[0], comments=True)
        command, rest = _find(words)
        _check_options(command, rest)
        if not isinstance(command, click.Group):
            command.make_context("cyclopean", list(rest))
    for text in _inline_commands(page):
        words = text.replace("[", "").replace("]", "").split()
        command, rest = _find(words)
        _check_options(command, rest)


def test_the_pages_name_commands() -> None:
    assert sum(len(_block_commands(page)) for page in PAGES) > 30
    assert sum(len(_inline_commands(page)) for page in PAGES) > 20


# Every module, function and file that a page or a docstring names exists, and every link leads somewhere.

NAMES_PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
_NAME = re.compile(r"\b(?:documents|devices|stimuli|analysis|runner|extensions|cyclopean)(?:\.[A-Za-z_0-9]+)+")
_FILE = re.compile(
    r"\b(?:documents|devices|stimuli|analysis|runner|extensions|cyclopean|configs|experiments|tests|benchmarks|examples"
    r"|docs|tools)/[\w./-]*\w"
)
_GROUPS = {registry.group for registry in REGISTRIES}  # of entry points
_LINK = re.compile(r"\]\(([^)#\s]*)(#[^)\s]*)?\)")
# Made by a benchmark, in the cache folder of the user, and in a wheel only.
_NOT_HERE = ("benchmarks/out", "cyclopean/stimuli", "runner/shipped")
_PLACEHOLDER = re.compile(r"[A-Z]{2,}")  # experiments/NAME.yaml


def _prose(page: Path) -> str:
    return re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)


def _exists(name: str) -> bool:
    """Whether a dotted name is a module, or what hangs on one."""
    parts = name.split(".")
    for end in range(len(parts), 0, -1):
        try:
            value: object = importlib.import_module(".".join(parts[:end]))
        except ModuleNotFoundError:
            continue
        for part in parts[end:]:
            fields = getattr(value, "__annotations__", {})
            if not hasattr(value, part) and part not in fields:
                return False
            value = getattr(value, part, None)
        return True
    return False


def _wrong_names(text: str) -> list[str]:
    """Return the dotted names between backticks that do not exist."""
    code = " ".join(re.findall(r"`([^`\n]+)`", text))
    names = {name for name in _NAME.findall(code) if not name.endswith((".py", ".md", ".yaml", ".json"))}
    return sorted(name for name in names - _GROUPS if not _exists(name))


@pytest.mark.parametrize("page", NAMES_PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_names_exist(page: Path) -> None:
    wrong = _wrong_names(_prose(page))
    assert not wrong, f"{page.name} names {', '.join(wrong)}"


@pytest.mark.parametrize(
    "package", ["documents", "devices", "stimuli", "analysis", "runner", "extensions", "cyclopean"]
)
def test_names_in_docstrings_and_comments_exist(package: str) -> None:
    files = sorted((ROOT / package).rglob("*.py"))
    wrong = {str(file.relative_to(ROOT)): _wrong_names(file.read_text(encoding="utf-8")) for file in files}
    assert not any(wrong.values()), {file: names for file, names in wrong.items() if names}


@pytest.mark.parametrize("page", NAMES_PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_files_exist(page: Path) -> None:
    code = " ".join(re.findall(r"`([^`]+)`", _prose(page)))
    files = {file for file in _FILE.findall(code) if not file.startswith(_NOT_HERE)}
    wrong = sorted(file for file in files if not ((ROOT / file).exists() or _PLACEHOLDER.search(file)))
    assert not wrong, f"{page.name} names {', '.join(wrong)}"


def _anchors(page: Path) -> set[str]:
    """Return the anchors of the page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", _prose(page), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", NAMES_PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    wrong = []
    for target, anchor in set(_LINK.findall(_prose(page))):
        if "://" in target:
            continue
        file = page.parent / target if target else page
        if not file.exists() or (anchor and anchor[1:] not in _anchors(file)):
            wrong.append(target + anchor)
    assert not wrong, f"{page.name} links to {', '.join(sorted(wrong))}"


def test_a_wrong_name_is_seen() -> None:
    assert _exists("devices.display.display_file.read_display")
    assert _exists("cyclopean.scores")
    assert not _exists("devices.display.display_file.no_such_function")
    assert not _exists("devices.no_such_module")
    assert _wrong_names("`devices.no_such_module.at_all` and `devices.display`") == ["devices.no_such_module.at_all"]


# README.md fits one screen and leads to docs/index.md, which lists every page of docs/; pages name all kinds.

DOCS = ROOT / "docs"
_INDEX_LINK = re.compile(r"\]\(([^)#\s]+)")
ONE_SCREEN = 62


def _links(page: Path) -> set[Path]:
    """Return the files that a page links to."""
    targets = _INDEX_LINK.findall(page.read_text(encoding="utf-8"))
    return {(page.parent / target).resolve() for target in targets if "://" not in target}


def test_the_index_lists_every_page() -> None:
    pages = {page.resolve() for page in DOCS.glob("*.md") if page.name != "index.md"}
    missing = sorted(page.name for page in pages - _links(DOCS / "index.md"))
    assert not missing, f"docs/index.md does not list {', '.join(missing)}"


def test_the_readme_fits_one_screen_and_leads_to_the_index() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= ONE_SCREEN
    assert (DOCS / "index.md").resolve() in _links(ROOT / "README.md")


def test_the_pages_name_every_kind_of_block_and_every_mode() -> None:
    kinds = BLOCKS.own()
    assert len(kinds) >= 10
    for page, names in (("session.md", kinds), ("display.md", list(MODES)), ("modes.md", list(MODES))):
        text = (DOCS / page).read_text(encoding="utf-8")
        assert [name for name in names if f"`{name}`" not in text] == [], page
