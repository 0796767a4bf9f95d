"""Faults in a file are all found at once, placed, and answered with the nearest valid spelling."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, RootModel

from devices.camera import read_camera
from devices.display import read_display, read_rig, read_verification
from documents import InputError, load_document
from documents.yaml import KIND_BY_KEY, OneOf, Strict
from runner.check.files import _CHECKS
from runner.protocol import read_experiment
from stimuli.comparison import read_regions
from stimuli.recipes import read_recipe


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


def _findings(tmp_path: Path, text: str) -> list[str]:
    path = tmp_path / "f.yaml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        load_document(path, _File)
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
    path = tmp_path / "f.yaml"
    path.write_text("words: hello\nkind: txt\n")
    with pytest.raises(InputError, match=r"f.yaml:2:7: 'kind' is 'txt' \(did you mean 'text'\?\)"):
        load_document(path, _OneOf)


def test_a_file_that_is_no_mapping(tmp_path: Path) -> None:
    (finding,) = _findings(tmp_path, "- just\n- a list\n")
    assert finding.startswith("f.yaml:1:1: the file is ['just', 'a list']")


CONFIGS = Path("configs")
FILES = {
    "a display file": CONFIGS / "displays/asus_vg248qe.yaml",
    "a rig file": CONFIGS / "rigs/asus_vg248qe_3dvision.yaml",
    "a camera file": CONFIGS / "cameras/nikon_d800.yaml",
    "a file of areas to compare": CONFIGS / "regions/plate.yaml",
    "a recipe": CONFIGS / "stimuli/manitoba_gray.yaml",
    "an experiment": Path("experiments/dynamic_range.yaml"),
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


@pytest.mark.parametrize("given", FILES)
@pytest.mark.parametrize("wanted", READERS)
def test_one_finding_says_what_it_is_and_what_is_wanted(given: str, wanted: str) -> None:
    if given == wanted:
        READERS[wanted](FILES[given])
        return
    with pytest.raises(InputError) as caught:
        READERS[wanted](FILES[given])
    (finding,) = caught.value.findings
    called = "a recipe or observers file" if given == "a recipe" else given
    assert finding.message == f"this is {called}, not {wanted}"
    assert finding.file == str(FILES[given])
    assert finding.line


def test_every_kind_that_a_key_tells_can_be_checked() -> None:
    assert set(KIND_BY_KEY.values()) == set(_CHECKS)


def test_a_file_of_several_kinds_builds_its_checks_when_one_is_read(tmp_path: Path) -> None:
    class First(Strict):
        kind: Literal["first"]

    class Second(Strict):
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

    path = tmp_path / "f.yaml"
    path.write_text("names: [{kind: text, words: 1}]\n")
    with pytest.raises(InputError) as caught:
        load_document(path, Names)
    assert [finding.message for finding in caught.value.findings] == ["'names.1.words' is 1"]


@pytest.mark.parametrize(("words", "shown"), [("CIE names only", "CIE names only"), ("A name", "a name")])
def test_words_of_a_model_begin_small_unless_with_an_abbreviation(words: str, shown: str, tmp_path: Path) -> None:
    def refuse(text: str) -> str:
        raise ValueError(words)

    class Named(BaseModel):
        observer: Annotated[str, AfterValidator(refuse)]

    (tmp_path / "file.yaml").write_text("observer: me\n")
    with pytest.raises(InputError, match=f"'observer' is 'me' \\({shown}\\)"):
        load_document(tmp_path / "file.yaml", Named)


def test_an_empty_list(tmp_path: Path) -> None:
    class _Some(BaseModel):
        names: Annotated[list[str], Field(min_length=2)]

    path = tmp_path / "f.yaml"
    path.write_text("names: []\n")
    with pytest.raises(InputError, match=r"f.yaml:1:8: 'names' holds nothing \(give it at least 2 entries\)"):
        load_document(path, _Some)


@pytest.mark.parametrize(("pattern", "text"), [(r"^[a-z0-9][a-z0-9_-]*$", "My plates"), (r"^[a-z][a-z0-9_]*$", "1st")])
def test_the_pattern_of_a_name_is_told_in_words(pattern: str, text: str, tmp_path: Path) -> None:
    class _Named(BaseModel):
        name: Annotated[str, Field(pattern=pattern)]

    path = tmp_path / "f.yaml"
    path.write_text(f"name: {text}\n")
    with pytest.raises(InputError) as caught:
        load_document(path, _Named)
    (finding,) = caught.value.findings
    assert finding.message == f"'name' is '{text}'"
    assert str(finding.remedy).startswith("use small letters a to z, digits")


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
