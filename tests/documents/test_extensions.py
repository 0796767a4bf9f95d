"""Kinds that other packages offer: found, kept, loaded when they are asked for, and refused alone where they fail."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import pytest

from documents import FileModel
from documents.extensions import Environment, ExtensionError, Registry, of_base
from runner.check import REGISTRIES
from tests.choice import nightly

GROUP = "cyclopean.things"
Install = Callable[..., None]


class Thing(FileModel):
    kind: str


class Cup(Thing):
    kind: Literal["cup"]


SOUND = """
CYCLOPEAN_INTERFACE = 1
from typing import Literal
from documents import FileModel
from tests.documents.test_extensions import Thing

class Jug(Thing):
    kind: Literal["jug"]
"""


def _registry(tmp_path: Path) -> Registry[type[Thing]]:
    own = {"cup": f"{__name__}:Cup"}
    return Registry(GROUP, own, of_base(Thing), Environment([str(tmp_path / "site")]))


def test_a_kind_of_another_package_is_as_good_as_ours(install: Install, tmp_path: Path) -> None:
    install("pottery", SOUND, "2.1", jug="Jug")
    things = _registry(tmp_path)
    assert things.names() == ("cup", "jug")
    assert things["cup"] is Cup
    assert things["jug"](kind="jug").kind == "jug"
    offer = things.offer("jug")
    assert offer is not None
    assert (offer.package, offer.version) == ("pottery", "2.1")
    assert things.get("bowl") is None


def test_only_changed_packages_are_looked_through_for_an_unknown_name(install: Install, tmp_path: Path) -> None:
    install("pottery", SOUND, jug="Jug")
    assert _registry(tmp_path).get("jug") is not None

    class Blind(Environment):
        def scan(self) -> tuple[()]:
            raise AssertionError("looked through the environment")

    things: Registry[type[Thing]] = Registry(
        GROUP, {"cup": f"{__name__}:Cup"}, of_base(Thing), Blind([str(tmp_path / "site")])
    )
    assert things.get("cup") is Cup
    assert things.names() == ("cup", "jug")
    assert things.get("bowl") is None
    install("bakery", SOUND, bowl="Jug")
    things = Registry(GROUP, {"cup": f"{__name__}:Cup"}, of_base(Thing), Blind([str(tmp_path / "site")]))
    assert things.get("jug") is not None
    with pytest.raises(AssertionError):
        things.get("bowl")


def test_what_the_cache_says_is_looked_up_again_where_it_is_out_of_date(install: Install, tmp_path: Path) -> None:
    install("pottery", SOUND, jug="Jug")
    _registry(tmp_path).get("jug")
    install("pottery", SOUND.replace("Jug", "Pitcher"), "2.0", jug="Pitcher")
    sys.modules.pop("pottery")
    assert _registry(tmp_path)["jug"].__name__ == "Pitcher"
    for file in (tmp_path / "site").rglob("*"):
        if file.is_file():
            file.unlink()
    sys.modules.pop("pottery")
    importlib.invalidate_caches()
    with pytest.raises(ExtensionError):
        _registry(tmp_path).get("jug")
    assert _registry(tmp_path).get("jug") is None


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("raise OSError('no such table')", "OSError: no such table"),
        (SOUND.replace("CYCLOPEAN_INTERFACE = 1", ""), "does not say"),
        (SOUND.replace("INTERFACE = 1", "INTERFACE = 99"), "interface 99"),
        (SOUND.replace("Jug(Thing)", "Jug(FileModel)"), "Thing"),
        (SOUND.replace('"jug"', '"mug"'), "mug"),
        ("CYCLOPEAN_INTERFACE = 1", "Jug"),
        ("raise SystemExit(3)", "SystemExit: 3"),
        (f"{SOUND}    __class_getitem__ = None\nJug.model_fields = None", "cannot be looked at"),
    ],
    ids=[
        "raises",
        "no interface",
        "another interface",
        "no such kind",
        "another name",
        "nothing there",
        "leaves",
        "odd",
    ],
)
def test_one_that_cannot_be_used_costs_nobody_else_anything(
    text: str, said: str, install: Install, tmp_path: Path
) -> None:
    install("broken", text, jug="Jug")
    install("pottery", SOUND.replace("jug", "bowl").replace("Jug", "Bowl"), bowl="Bowl")
    things = _registry(tmp_path)
    with pytest.raises(ExtensionError) as raised:
        things.get("jug")
    assert raised.value.findings[0].code == "extension"
    assert "broken 1.0" in raised.value.findings[0].message
    assert said in raised.value.findings[0].message
    assert things.names() == ("cup", "bowl")
    assert len(list(things.problems())) == 1


def test_a_package_whose_own_files_are_broken_hides_nobody(install: Install, tmp_path: Path) -> None:
    install("pottery", SOUND, jug="Jug")
    install("rubble", SOUND, bowl="Jug")
    (tmp_path / "site/rubble-0.dist-info/METADATA").unlink()
    (tmp_path / "site/rubble-0.dist-info/entry_points.txt").write_bytes(b"[cyclopean.things\xff")
    install("nameless", SOUND, bowl="Jug")
    (tmp_path / "site/nameless-0.dist-info/METADATA").write_text("Version: 1.0\n")
    assert _registry(tmp_path).names() == ("cup", "jug")


def test_a_name_that_is_taken_is_refused(install: Install, tmp_path: Path) -> None:
    install("pottery", SOUND, jug="Jug")
    install("rival", SOUND, jug="Jug")
    install("shadow", SOUND.replace("jug", "cup"), cup="Jug")
    things = _registry(tmp_path)
    with pytest.raises(ExtensionError):
        things.get("jug")
    assert things["cup"] is Cup
    assert things.names() == ("cup",)
    assert [problem.findings[0].message.split()[2] for problem in things.problems()] == ["pottery", "rival", "shadow"]


@pytest.mark.parametrize("registry", [REGISTRIES[0], *nightly(*REGISTRIES[1:])], ids=lambda registry: registry.group)
def test_a_wrong_extension_of_any_group_costs_nobody_else_anything(
    registry: Registry[Any], install: Install, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(registry, "_loaded", {})
    own = registry.own()
    wrong = {
        "raising": "raise OSError('no such table')",
        "elsewhere": "CYCLOPEAN_INTERFACE = 99\nJug = 1",
        "unlike": "CYCLOPEAN_INTERFACE = 1\nJug = 1",
    }
    for package, text in wrong.items():
        install(package, text, group=registry.group, **{package: "Jug"})
        with pytest.raises(ExtensionError) as refused:
            registry.get(package)
        assert f"{package} 1.0" in refused.value.findings[0].message
    for first in own[:1]:
        install("shadow", "CYCLOPEAN_INTERFACE = 1\nJug = 1", group=registry.group, **{first: "Jug"})
    problems = {problem.offer.package for problem in registry.problems()}
    assert problems >= {*wrong, *(["shadow"] if own else [])}
    assert registry.names()[: len(own)] == own
    assert not {*wrong} & {*registry.names()}
    assert all(registry[name] is not None for name in own[:1])


def test_a_kind_of_our_own_extensions_is_ours_wherever_it_is_offered(install: Install, tmp_path: Path) -> None:
    install("ours_of_things", SOUND, jug="Jug")
    install("pottery", SOUND, jug="Jug", bowl="Jug")
    ours = tmp_path / "site" / "ours_of_things-0.dist-info" / "METADATA"
    ours.write_text(ours.read_text().replace("ours_of_things", "cyclopean"))
    things = _registry(tmp_path)
    assert things.own() == ("cup", "jug")
    assert things.offer("jug") is None
    assert things["jug"].__module__ == "ours_of_things"
    assert sorted(problem.offer.name for problem in things.problems()) == ["bowl", "jug"]


def test_an_extension_of_ours_that_was_taken_out_is_named_alone(install: Install, tmp_path: Path) -> None:
    install("ours_of_things", SOUND, jug="Jug")
    site = tmp_path / "site"
    facts = site / "ours_of_things-0.dist-info" / "METADATA"
    facts.write_text(facts.read_text().replace("ours_of_things", "cyclopean"))
    (site / "ours_of_things.py").unlink()
    things = _registry(tmp_path)
    assert things.names() == ("cup",)
    with pytest.raises(ExtensionError) as error:
        things["jug"]
    assert "ModuleNotFoundError" in error.value.reason
    assert "pip uninstall" not in str(error.value.findings[0].remedy)
