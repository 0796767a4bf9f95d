"""What proves a recipe: ours keep the promises, one that breaks a promise is found out; another package's is used."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cyclopean.testing import BrokenPromiseError, prove_recipe
from documents import InputError
from stimuli.build import build_set
from stimuli.errors import StimulusError
from stimuli.pictures import StereoImage, write_exr
from stimuli.recipes import RECIPES, RecipeKind

STIMULI = "[{name: a, file: a.exr}, {name: b, file: b.exr}]"
PICTURES = f"{{schema_version: 1, kind: pictures, luminance: {{scale: %s}}, stimuli: {STIMULI}}}"
RECIPE = "{schema_version: 1, kind: grey, levels_cd_m2: %s, file: light.txt}"
KIND = """
from typing import Literal
import numpy as np
from stimuli.errors import StimulusError
from stimuli.pictures import StereoImage
from stimuli.recipes import MadePicture, RecipeKind

CYCLOPEAN_INTERFACE = 1

class Grey(RecipeKind):
    kind: Literal["grey"]
    levels_cd_m2: tuple[str, ...]
    file: str

    def factors(self):
        return {f"grey-{level}": {"level": level} for level in self.levels_cd_m2}

    def faults(self):
        return []

    def inputs(self):
        return {self.file: ("file",)}

    def tasks(self, context):
        for level, name in zip(self.levels_cd_m2, self.factors()):
            yield {name: context.key(self.sparkles, level=level, file=context.file_hashes[self.file])}

    def make(self, context, report, names):
        held = (context.folder / self.file).read_text()
        if not held.endswith("."):
            raise StimulusError("it is no light")
        for level, name in zip(self.levels_cd_m2, self.factors()):
            if name in names:
                light = np.full((8, 8, 3), float(level) * float(held[:-1]), np.float32)
                yield MadePicture(name, StereoImage.flat(light), self.factors()[name], ())
"""
BROKEN = {
    "if name in names": ("if True", "second build"),
    "level=level, file=context.file_hashes[self.file]": ("level=level", "other keys"),
    "level=level, file": ("file", "what changed"),
    "level=level": ("level=[*self.factors()].index(name)", "what changed"),
    "context.key(self.sparkles, level=level, file=context.file_hashes[self.file])": (
        "level + context.file_hashes[self.file][:20]",
        "other keys",
    ),
    "float(level) *": ("np.random.default_rng().random() *", "equal pictures"),
    'raise StimulusError("it is no light")': ("raise ValueError", "InputError"),
    "self.factors()[name], ())": ("self.factors()[name], ()); break", "it names"),
}


def _kind(old: str = "", new: str = "") -> type[RecipeKind]:
    held: dict[str, type[RecipeKind]] = {}
    exec(compile(KIND.replace(old, new, 1) if old else KIND, "grey", "exec", dont_inherit=True), held)
    return held["Grey"]


def test_our_kinds_keep_the_promises(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stimuli.recipes.banded_picture.LEAST_PX", 0)
    light = np.random.default_rng(1).uniform(1, 9, (40, 60, 3)).astype(np.float32)
    for name, picture in (("a", StereoImage(light, light[::-1])), ("b", StereoImage.flat(light))):
        write_exr(tmp_path / f"{name}.exr", picture)
    others = [PICTURES % 0.25, PICTURES.replace("a, file", "c, file") % 0.5]
    assert "a picture made in bands is that made whole" in prove_recipe(PICTURES % 0.5, tmp_path, others)
    monkeypatch.setattr("stimuli.recipes.banded_picture.scaled", lambda pixels, factor: pixels * (0.9 * factor))
    with pytest.raises(BrokenPromiseError, match="in bands"):
        prove_recipe(PICTURES % 0.4, tmp_path)


@pytest.mark.parametrize("old", BROKEN)
def test_a_broken_promise_is_found(old: str, tmp_path: Path) -> None:
    (tmp_path / "light.txt").write_text("2.")
    others = [RECIPE % "['1', '3']", RECIPE % "['5', '3', '1']"]
    assert prove_recipe(RECIPE % "['1', '2']", tmp_path, others, kind=_kind())
    new, said = BROKEN[old]
    (tmp_path / "light.txt").write_text("2.")
    (tmp_path / "again").mkdir()
    (tmp_path / "again/light.txt").write_text("2.")
    with pytest.raises(BrokenPromiseError, match=said):
        prove_recipe(RECIPE % "['1', '2']", tmp_path / "again", others, kind=_kind(old, new))


def test_another_packages_kind_is_built_anew_by_a_new_version_and_named(
    install: Callable[..., None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(RECIPES, "_loaded", {})
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    recipe, light = tmp_path / "recipe.yaml", tmp_path / "light.txt"
    recipe.write_text(RECIPE % "['1', '2']")
    light.write_text("2.")
    for version, made in (("1.0", 2), ("1.0", 0), ("2.0", 2), ("2.0", 0)):
        install("greys", KIND, version, group=RECIPES.group, grey="Grey")
        built = build_set(recipe, 0.25)
        assert built.rendered == made
        assert built.manifest["extension"] == {"greys": version}
    light.write_text("dark.")
    with pytest.raises(StimulusError, match=r"greys 2\.0.*ValueError"):
        build_set(recipe, 0.25)
    recipe.write_text("{schema_version: 1, kind: grey}")
    with pytest.raises(InputError, match="levels_cd_m2"):
        build_set(recipe, 0.25)
