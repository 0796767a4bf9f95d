"""What people get wrong, and what they are told: `typical_mistakes.yaml` holds it all to be read in one place."""

from __future__ import annotations

import math
import re
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
import yaml

from documents import InputError
from documents.yaml import checked, parse_yaml
from runner.check import CheckOptions, check_file
from runner.protocol import KINDS, FileKind, file_model
from tests.runner.every_kind import OF_EXTENSIONS

Study = Any  # tests/conftest.py
ROOT = Path(__file__).parents[2]
MISTAKES = yaml.safe_load((Path(__file__).parent / "typical_mistakes.yaml").read_text(encoding="utf-8"))
# What pydantic, Python and JSON Schema call things, which no person should have to read.
FORBIDDEN = re.compile(
    r"instance of|\w*Spec\b|union_tag|[Ii]nput should|_type\b|valid (dictionary|integer|number|string|tuple|list)"
    r"|discriminator|Traceback|NoneType|validation error|\bdict\b|\bstr\b|\btuple\b"
)


def told(study: Study, mistake: Mapping[str, Any]) -> list[str]:
    """Return what is said of a mistake, without the folder's path."""
    if "type" in mistake:
        done = study.cyclopean(*mistake["type"].split()[1:], expect=None)
        said = [line for line in done.stderr.splitlines() if line.startswith(("error", "Error", "cyclopean:"))]
    else:
        path = study.folder / mistake["file"]
        text = path.read_text(encoding="utf-8")
        assert mistake["was"] in text, mistake
        path.write_text(text.replace(mistake["was"], mistake["write"], 1), encoding="utf-8")
        if path.suffix == ".csv":
            said = study.cyclopean("scores", path, expect=2).stderr.splitlines()
        else:
            first = study.experiment if path.name in ("rig.yaml", "display.yaml", "recipe.yaml") else path
            options = CheckOptions(results=study.results, screen=False, pictures=False)
            said = [str(error) for error in check_file(first, options).errors]
    return [line.replace(f"{study.folder}/", "").replace(str(study.folder), "") for line in said]


@pytest.fixture
def files(study: Study, monkeypatch: pytest.MonkeyPatch) -> Study:
    """The small study, with a file of every other kind beside it."""
    monkeypatch.chdir(study.folder)
    monkeypatch.delenv("DISPLAY", raising=False)
    shutil.copy(ROOT / "configs/cameras/nikon_d800.yaml", study.folder / "camera.yaml")
    shutil.copy(ROOT / "configs/regions/plate.yaml", study.folder / "regions.yaml")
    (study.folder / "table.csv").write_text("winner,loser\na,b\nb,c\nc,a\n", encoding="utf-8")
    return study


@pytest.mark.parametrize(
    "mistake",
    [
        pytest.param(
            one,
            marks=[pytest.mark.extensions] if any(kind in str(one) for kind in (*OF_EXTENSIONS, "sparkle_")) else [],
        )
        for one in MISTAKES
    ],
    ids=lambda one: str(one.get("type") or one["write"])[:60],
)
def test_a_typical_mistake_is_answered_with_what_to_write(files: Study, mistake: Mapping[str, Any]) -> None:
    said = told(files, mistake)
    assert said == mistake["says"]
    assert said
    assert not FORBIDDEN.search("\n".join(said))


def test_there_are_a_hundred_and_more() -> None:
    assert len(MISTAKES) >= 100
    assert {one["file"] for one in MISTAKES if "file" in one} >= {
        "small.yaml",
        "rig.yaml",
        "display.yaml",
        "recipe.yaml",
        "observers.yaml",
        "camera.yaml",
        "regions.yaml",
        "table.csv",
    }


SHIPPED: Mapping[FileKind, str] = {
    "experiment": "experiments/*.yaml",
    "rig": "configs/rigs/*.yaml",
    "display": "configs/displays/*.yaml",
    "stimuli": "configs/stimuli/**/*.yaml",
    "observers": "configs/observers/*.yaml",
    "camera": "configs/cameras/*.yaml",
    "regions": "configs/regions/*.yaml",
}
WRONG: tuple[Any, ...] = (None, "red", -1, 10**90, [1], {"a": 1})
MORE_WRONG: tuple[Any, ...] = (*WRONG, 2.2, [], {}, True, "", [["x", "y"]], "x" * 5000, 1e300, math.nan)


def places(data: Any, above: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    yield above
    if isinstance(data, dict | list):
        inner = list(data.items())[:16] if isinstance(data, dict) else list(enumerate(data))[:2]
        for key, value in inner:
            yield from places(value, (*above, key))


def _field(data: Any, place: tuple[str | int, ...]) -> tuple[object, ...]:
    """Return which field of a schema a place is: the keys on the way, the kinds of what they are in, and the type."""
    on_the_way: list[object] = []
    for step in place:
        on_the_way.append((data.get("kind") if isinstance(data, dict) else None, step))
        data = data[step]
    return (*on_the_way, type(data))


def changed(data: Any, place: tuple[str | int, ...], value: object) -> Any:
    if not place:
        return value
    copy: Any = dict(data) if isinstance(data, dict) else list(data)
    copy[place[0]] = changed(copy[place[0]], place[1:], value)
    return copy


@pytest.mark.parametrize("kind", SHIPPED)
@pytest.mark.parametrize(
    "wrong_values", [WRONG, pytest.param(MORE_WRONG, marks=pytest.mark.stress)], ids=["few", "all"]
)
def test_no_value_anywhere_is_answered_in_the_words_of_a_library(kind: FileKind, wrong_values: tuple[Any, ...]) -> None:
    """Every value of every shipped file is made wrong in some ways, each field in the first file that has it."""
    assert set(KINDS) - set(SHIPPED) <= {"verification"}
    said: set[str] = set()
    met: set[tuple[object, ...]] = set()
    for file in sorted(ROOT.glob(SHIPPED[kind])):
        data = yaml.safe_load(file.read_text(encoding="utf-8"))
        by_field = {_field(data, place): place for place in reversed(list(places(data)))}
        new = {field: place for field, place in by_field.items() if field not in met}
        met.update(new)
        for place in new.values():
            for value in wrong_values:
                source = parse_yaml("a: 1", "f.yaml")
                wrong = type(source)("f.yaml", changed(data, place, value), {}, {})
                try:
                    checked(wrong, file_model(kind))
                except InputError as error:
                    said.update(map(str, error.findings))
    assert len(said) > 20
    assert not [one for one in said if FORBIDDEN.search(one)]
