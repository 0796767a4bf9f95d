"""YAML: faults are all found at once and placed; scalars, places, and both parsers alike."""

from __future__ import annotations

import math
import random
import runpy
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
import yaml
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, RootModel

from devices.camera import read_camera
from devices.display import read_display, read_rig, read_verification
from documents import InputError, load_document
from documents.extensions import Environment, Registry, of_base
from documents.yaml import KIND_BY_KEY, ByKind, FileModel, OneOf, parse_yaml, read_yaml, source
from documents.yaml.source import Loader, QuickLoader, can_be_quick
from runner.check.files import _CHECKS
from runner.protocol import read_experiment
from stimuli.comparison import read_regions
from stimuli.recipes import read_recipe
from tests.conftest import write_study
from tests.kept import known


# Faults in a file are all found at once, placed, and answered with the nearest valid spelling.
class _Text(BaseModel):
    model_config = ConfigDict(extra="forbid")
    kind: Literal["text"]
    words: str


class _Number(BaseModel):
    model_config = ConfigDict(extra="forbid")
    kind: Literal["number"]
    value: float


class _File(BaseModel):
    model_config = ConfigDict(extra="forbid")
    name: str
    size_mm: tuple[float, float]
    blocks: list[Annotated[_Text | _Number, Field(discriminator="kind")]]


def _findings(tmp_path: Path, text: str, model: type[BaseModel] = _File) -> list[str]:
    path = tmp_path / "f.yaml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        load_document(path, model)
    return [str(finding).replace(str(path), "f.yaml") for finding in caught.value.findings]


def test_a_right_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "f.yaml"
    path.write_text("name: a\nsize_mm: [1, 2]\nblocks: [{kind: text, words: hello}]\n")
    model, source = load_document(path, _File)
    assert model.size_mm == (1.0, 2.0)
    assert source.file == str(path)


def test_a_fault_says_for_programs_which_it_is_and_whose(tmp_path: Path) -> None:
    path = tmp_path / "f.yaml"
    path.write_text("nam: a\nsize_mm: [1, wide]\nblocks:\n  - {kind: txt}\n  - {kind: text, word: hello}\n")
    with pytest.raises(InputError) as caught:
        load_document(path, _File)
    assert sorted((found.path, found.code) for found in caught.value.findings) == [
        (("blocks", 0), "union_tag_invalid"),
        (("blocks", 1, "word"), "extra_forbidden"),
        (("blocks", 1, "words"), "missing"),
        (("nam",), "extra_forbidden"),
        (("name",), "missing"),
        (("size_mm", 1), "float_parsing"),
    ]


def test_all_faults_are_found_at_once_in_order(tmp_path: Path) -> None:
    found = _findings(
        tmp_path,
        "nam: a\nsize_mm: [1, wide]\nblocks:\n  - {kind: txt, words: hello}\n  - {kind: text, word: hello}\n",
    )
    assert found == [
        "f.yaml:1:1: the key 'name' is missing (add 'name:')",
        "f.yaml:1:1: unknown key 'nam' (did you mean 'name'?)",
        "f.yaml:2:14: 'size_mm.2' is 'wide' (write a number)",
        "f.yaml:4:12: 'blocks.1.kind' is 'txt' (did you mean 'text'?)",
        "f.yaml:5:5: the key 'blocks.2.words' is missing (add 'words:')",
        "f.yaml:5:18: unknown key 'blocks.2.word' (did you mean 'words'?)",
    ]


def test_a_block_without_a_kind(tmp_path: Path) -> None:
    found = _findings(tmp_path, "name: a\nsize_mm: [1, 2]\nblocks: [{words: hello}]\n")
    assert found == ["f.yaml:3:10: 'blocks.1' has no 'kind' (add 'kind:', text or number)"]


class _OneOf(RootModel[Annotated[_Text | _Number, Field(discriminator="kind")]]):
    pass


def test_a_wrong_kind_of_the_whole_file(tmp_path: Path) -> None:
    found = _findings(tmp_path, "words: hello\nkind: txt\n", _OneOf)
    assert found == ["f.yaml:2:7: 'kind' is 'txt' (did you mean 'text'?)"]


class _Lit(FileModel):
    lamp: Annotated[BaseModel, ByKind(Registry("cyclopean.lamps", {}, of_base(BaseModel), Environment([])))]


def test_a_kind_that_no_package_here_offers(tmp_path: Path) -> None:
    (found,) = _findings(tmp_path, "lamp: {kind: led}\n", _Lit)
    assert "'lamp.kind' is 'led' (install the package that adds it" in found


def test_a_file_that_is_no_mapping(tmp_path: Path) -> None:
    (finding,) = _findings(tmp_path, "- just\n- a list\n")
    assert finding.startswith("f.yaml:1:1: the file is ['just', 'a list']")


CONFIGS = Path("configs")
FILES = {
    "a display file": CONFIGS / "displays/asus_vg248qe.yaml",
    "a rig file": CONFIGS / "rigs/asus_vg248qe_3dvision.yaml",
    "a camera file": CONFIGS / "cameras/nikon_d800.yaml",
    "a file of areas to compare": CONFIGS / "regions/plate.yaml",
    "a recipe": Path("recipe.yaml"),
    "an experiment": Path("small.yaml"),
}
READERS: dict[str, Callable[[Path], Any]] = {
    "a display file": read_display,
    "a rig file": read_rig,
    "a camera file": read_camera,
    "a file of areas to compare": read_regions,
    "a recipe": read_recipe,
    "an experiment": read_experiment,
    "a photodiode's record": read_verification,
}


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a recipe and an experiment."""
    return Path(write_study(tmp_path_factory.mktemp("study")).folder)


@pytest.mark.parametrize("given", FILES)
@pytest.mark.parametrize("wanted", READERS)
def test_one_finding_says_what_it_is_and_what_is_wanted(given: str, wanted: str, study: Path) -> None:
    file = FILES[given] if FILES[given].parent.name else study / FILES[given]
    if given == wanted:
        READERS[wanted](file)
        return
    with pytest.raises(InputError) as caught:
        READERS[wanted](file)
    (finding,) = caught.value.findings
    called = "a recipe or observers file" if given == "a recipe" else given
    assert finding.message == f"this is {called}, not {wanted}"
    assert finding.file == str(file)
    assert finding.line


def test_every_kind_that_a_key_tells_can_be_checked() -> None:
    assert set(KIND_BY_KEY.values()) == set(_CHECKS)


def test_a_file_of_several_kinds_builds_its_checks_when_one_is_read(tmp_path: Path) -> None:
    class First(FileModel):
        kind: Literal["first"]

    class Second(FileModel):
        kind: Literal["second"]

    class Either(OneOf[Annotated[First | Second, Field(discriminator="kind")]]):
        pass

    assert not Either.__pydantic_complete__
    (tmp_path / "either.yaml").write_text("kind: second\n", encoding="utf-8")
    document, _ = load_document(tmp_path / "either.yaml", Either)
    assert isinstance(document.root, Second)
    assert Either.__pydantic_complete__


def test_a_list_whose_entries_are_all_wrong_is_not_called_too_short(tmp_path: Path) -> None:
    class Names(BaseModel):
        names: Annotated[tuple[_Text, ...], Field(min_length=1)]

    (found,) = _findings(tmp_path, "names: [{kind: text, words: 1}]\n", Names)
    assert found.partition(": ")[2].startswith("'names.1.words' is 1 (")


@pytest.mark.parametrize(("words", "shown"), [("CIE names only", "CIE names only"), ("A name", "a name")])
def test_words_of_a_model_begin_small_unless_with_an_abbreviation(words: str, shown: str, tmp_path: Path) -> None:
    def refuse(text: str) -> str:
        raise ValueError(words)

    class Named(BaseModel):
        observer: Annotated[str, AfterValidator(refuse)]

    assert _findings(tmp_path, "observer: me\n", Named) == [f"f.yaml:1:11: 'observer' is 'me' ({shown})"]


def test_an_empty_list(tmp_path: Path) -> None:
    class _Some(BaseModel):
        names: Annotated[list[str], Field(min_length=2)]

    found = _findings(tmp_path, "names: []\n", _Some)
    assert found == ["f.yaml:1:8: 'names' holds nothing (give it at least 2 entries)"]


@pytest.mark.parametrize(("pattern", "text"), [(r"^[a-z0-9][a-z0-9_-]*$", "My plates"), (r"^[a-z][a-z0-9_]*$", "1st")])
def test_the_pattern_of_a_name_is_told_in_words(pattern: str, text: str, tmp_path: Path) -> None:
    class _Named(BaseModel):
        name: Annotated[str, Field(pattern=pattern)]

    (found,) = _findings(tmp_path, f"name: {text}\n", _Named)
    assert f": 'name' is '{text}' (use small letters a to z, digits" in found


def test_a_file_with_the_telling_key_of_its_kind_has_faults_of_its_own(tmp_path: Path) -> None:
    for text, read, fault in (
        ("schema_version: 1\nkind: pictures\nmode: x\nstimuli: []\n", read_recipe, "unknown key 'mode'"),
        ("schema_version: 1\ndisplay: d.yaml\nmode: x\nmodes: {}\n", read_rig, "unknown key 'modes'"),
    ):
        (tmp_path / "f.yaml").write_text(text)
        with pytest.raises(InputError) as caught:
            read(tmp_path / "f.yaml")
        assert fault in str(caught.value)
        assert "this is" not in str(caught.value)


# The parser of libyaml reads what PyYAML's own reads, or leaves it to that.

ROOT = Path(__file__).parents[3]
SHIPPED = sorted([*ROOT.glob("experiments/**/*.yaml"), *ROOT.glob("configs/**/*.yaml")])
PIECES = ["\t", "'", '"', ":", ": ", "- ", "#", " #", "&a ", "*a", "!", "!!str ", "|", "|-\n", ">", "\n", "{", "}"]
PIECES += ["[", "]", ",", "?", "? ", "%", "@", "`", "\\", "é", "µ", "😀", "\u2028", "\x85", "\r\n", "\r", "---\n"]
PIECES += ["...\n", "\ufeff", "~", "0x1F", "  ", "<<: ", "\x00", "\x07", "\u200f", "\\u0041"]
without_libyaml = pytest.mark.skipif(not yaml.__with_libyaml__, reason="PyYAML was built without libyaml")


def read(kind: type[Loader], text: str) -> Any:
    """Return what is read and where, or the error."""
    try:
        parsed = source._parsed(kind, text, "f.yaml")
    except (InputError, ValueError) as error:
        return str(error)
    return repr(parsed.data), parsed.keys, parsed.values  # not a number equals none


def damaged(rng: random.Random, texts: list[str]) -> str:
    """Return a piece of one of the texts, in which up to three places are changed."""
    text = rng.choice(texts)
    begin = rng.randrange(len(text))
    text = text[begin : begin + rng.randrange(20, 1500)]
    for _ in range(rng.randrange(4)):
        at = rng.randrange(len(text) + 1)
        if rng.random() < 0.7:
            text = text[:at] + rng.choice(PIECES) + text[at:]
        else:
            text = text[:at] + text[at + rng.randrange(1, 6) :]
    return text


@without_libyaml
@pytest.mark.parametrize("file", SHIPPED, ids=lambda file: file.stem)
def test_shipped_files_are_read_by_libyaml(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    assert can_be_quick(text)
    quick = read(QuickLoader, text)
    assert not isinstance(quick, str)
    assert quick == read(Loader, text)


@without_libyaml
@pytest.mark.parametrize("count", [300, pytest.param(30_000, marks=pytest.mark.stress)])
def test_damaged_files_are_read_alike(count: int) -> None:
    rng = random.Random(count)
    texts = [file.read_text(encoding="utf-8") for file in SHIPPED]
    compared = 0
    for _ in range(count):
        text = damaged(rng, texts)
        quick = read(QuickLoader, text) if can_be_quick(text) else ""
        if not isinstance(quick, str):
            compared += 1
            assert quick == read(Loader, text), text
    assert compared > count / 10


@pytest.mark.parametrize(
    "text",
    [
        "a: {b: 1,\t c: 2}\n",
        "a: 'b'\t\n",
        "- {b\ufeff: 1}\n",
        "--- a\n",
        "a: |# b\n",
        "a: ! b\n",
        "a: {b: }\n",
        "? a\n",
        "a: {b: why? so}\n",
        "a: [why?]\n",
        "[" * 400,
        "- " * 400 + "a",
        "a: 1\na: 2\n",
        "a: \ud800\n",
    ],
)
def test_what_the_parsers_take_otherwise_is_read_by_the_one_in_python(
    text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def outcome() -> Any:
        try:
            parsed = parse_yaml(text, "f.yaml")
        except InputError as error:
            return str(error)
        return parsed.data, parsed.keys, parsed.values

    with_libyaml = outcome()
    monkeypatch.setattr(source, "can_be_quick", lambda _: False)
    assert with_libyaml == outcome()


def test_no_libyaml_is_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(yaml, "__with_libyaml__", False)
    monkeypatch.setitem(sys.modules, "yaml._yaml", None)
    without = runpy.run_path(str(Path(source.__file__)))
    assert not without["can_be_quick"]("a: 1\n")
    monkeypatch.setattr(source, "QuickLoader", None)
    assert parse_yaml("a: [1, b]\n", "f.yaml").data == {"a": [1, "b"]}


# YAML 1.2 scalars, places, and hostile files.
@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("NO", "NO"),
        ("yes", "yes"),
        ("on", "on"),
        ("true", True),
        ("12:30", "12:30"),
        ("1e-3", 1e-3),
        ("1E3", 1e3),
        ("017", 17),
        ("0o17", 15),
        ("0x1F", 31),
        ("2024-01-01", "2024-01-01"),
        ("~", None),
        ("", None),
        (".5", 0.5),
        ("-.inf", -math.inf),
        ("1_000", "1_000"),
        ("'1.1'", "1.1"),
    ],
)
def test_scalars_are_read_as_yaml_1_2(text: str, value: object) -> None:
    read = parse_yaml(f"key: {text}\n", "f.yaml").data["key"]
    assert read == value
    assert type(read) is type(value)


def test_places_count_from_one() -> None:
    source = parse_yaml("a: 1\nblocks:\n  - {kind: x, text: y}\n", "f.yaml")
    place = known(source.place(("blocks", 0, "text")))
    key = known(source.place(("blocks", 0, "text"), key=True))
    assert (place.line, place.column) == (3, 21)
    assert (key.line, key.column) == (3, 15)
    nearest = known(source.place(("blocks", 0, "missing")))
    assert nearest.line == 3


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("a: 1\na: 2\n", "stands twice"),
        ("a: !!python/object/apply:os.system [ls]\n", "is not allowed"),
        ("a: !!timestamp 2024-01-01\n", "is not allowed"),
        ("", "0 YAML documents"),
        ("a: 1\n---\nb: 2\n", "2 YAML documents"),
        ("[a]: 1\n", "a key must be a plain word"),
        ("[" * 300 + "]" * 300, "nested"),
        pytest.param("[" * 5000 + "]" * 5000, "nested", marks=pytest.mark.nightly),
    ],
)
def test_hostile_text_is_one_located_finding(text: str, part: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_yaml(text, "f.yaml")
    assert len(caught.value.findings) == 1
    assert part in str(caught.value)
    assert str(caught.value).startswith("f.yaml:")


def test_exploding_aliases_are_refused_quickly(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("documents.yaml.source.MAX_NODES", 1000)  # those of the shipped limit take a second
    text = "a: &a [x, x, x, x, x, x, x, x, x]\n"
    for name, previous in zip("bcdefghi", "abcdefgh", strict=True):
        text += f"{name}: &{name} [{', '.join([f'*{previous}'] * 9)}]\n"
    with pytest.raises(InputError, match="expands to more than"):
        parse_yaml(text, "bomb.yaml")


def test_missing_large_and_binary_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_yaml(tmp_path / "none.yaml")
    large = tmp_path / "large.yaml"
    large.write_bytes(b"a: " + b"x" * 10_000_000)
    with pytest.raises(InputError, match="larger than"):
        read_yaml(large)
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(b"a: \xff\xfe")
    with pytest.raises(InputError, match="not UTF-8"):
        read_yaml(binary)


@pytest.mark.parametrize(
    ("text", "line", "remedy"),
    [
        ("a: 1\nb:\n\tc: 1\n", 3, "a tab stands there"),
        ("a: 1\nb:\t2\n", 2, "a tab stands there"),
        ("question: Which one: left or right?\n", 1, "text that holds a colon in quotes"),
        ("a: 1\n b: 2\n", 2, "begin below one another"),
        ("a: 1\nb: [1, 2\nc: 3\n", 3, "the '[' of line 2 is not closed"),
        (
            "blocks:\n  - {kind: all_pairs, stimuli: all\nanalysis: {alpha: 0.05}\n",
            3,
            "the '{' of line 2 is not closed",
        ),
        ("a: {b: 1}}\n", 1, "too many"),
        ("a: 1\nb: 'x\nc: 1\n", 4, "the quotation mark of line 2 is not closed"),
        ("a: 'it's'\n", 1, "continues after its quotation mark"),
        ("a:\n  - 1\n - 2\n", 3, "begin below one another"),
        ("a: 1\nb\nc: 2\n", 3, "with a space after the colon"),
        ("a: @x\n", 1, "in quotes"),
        ("a: *x\n", 1, "in quotes"),
        ('a: "c:\\dir"\n', 1, "single quotes"),
        ("# nothing yet\n", 1, "it is empty"),
        ("a: 1\n---\na: 2\n", 1, "take out the '---'"),
    ],
)
def test_what_the_parser_cannot_read_comes_with_a_remedy(text: str, line: int, remedy: str) -> None:
    with pytest.raises(InputError) as error:
        parse_yaml(text, "f.yaml")
    (finding,) = error.value.findings
    assert finding.line == line
    assert remedy in str(finding.remedy)


def test_where_nobody_can_tell_nothing_is_said() -> None:
    with pytest.raises(InputError) as error:
        parse_yaml("a: &\n", "f.yaml")
    assert error.value.findings[0].remedy is None
