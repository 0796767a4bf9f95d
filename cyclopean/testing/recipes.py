"""The promises of every kind of recipe, tried on one: what is in the cache is not made again, what changed is."""

from __future__ import annotations

import os
import shutil
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import get_args
from unittest.mock import patch

from cyclopean.testing.promises import kept
from documents import InputError
from documents.files import read_regular, sha256_of_file
from stimuli.build import StimulusSet, build_set
from stimuli.pictures import CodedPicture, write_exr
from stimuli.recipes import RECIPES, BandedPicture, BuildContext, DisplaySetup, MadePicture, RecipeKind, read_recipe


def prove_recipe(
    recipe: str,
    folder: str | Path,
    changed: Sequence[str] = (),
    *,
    kind: type[RecipeKind] | None = None,
    pixel_pitch_mm: float = 0.2768,
    setup: DisplaySetup | None = None,
) -> tuple[str, ...]:
    """Prove that a kind of recipe keeps what the program promises of every kind.

    It makes the pictures that it names, each alone as among the others, and equal ones each time. A second build makes
    nothing; another version of the program, another file or another recipe makes what changed. Pictures that it makes
    some rows at a time are those that it makes whole. Files that it cannot read are refused by an InputError.

    Parameters
    ----------
    recipe
        A recipe of that kind, as YAML.
    folder
        A folder with the files that it names, in which the proof is made.
    changed
        Recipes that differ from it, as YAML, such as one for each key.
    kind
        The kind, where its package is not installed.
    pixel_pitch_mm, setup
        The display that the pictures are for, as `stimuli.build.build_set` takes them.

    Returns
    -------
    tuple of str
        The promises that it kept.

    Raises
    ------
    BrokenPromiseError
        If a promise is not kept.
    InputError
        If the recipe is wrong.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> text = Path("configs/stimuli/manitoba_gray.yaml").read_text()
    >>> with TemporaryDirectory() as folder:
    ...     "a second build makes nothing" in prove_recipe(text, folder)
    True
    """
    (name,) = get_args(kind.model_fields["kind"].annotation) if kind else ("",)
    with RECIPES.trying(name, kind):
        tried = _Tried(Path(folder), recipe, changed, pixel_pitch_mm, setup)
        return kept(
            {
                "it makes the pictures that it names": tried.named,
                "a second build makes nothing": tried.cached,
                "equal recipes make equal pictures": tried.again,
                "another version or file has other keys": tried.keyed,
                "what changed is made": tried.changes,
                "a picture alone is as among others": tried.alone,
                "a picture made in bands is that made whole": tried.banded,
                "a file that it cannot read is refused by an InputError": tried.refused,
            }
        )


class _Tried:
    """A recipe in a folder, and the set that is built of it; each attempt returns what broke."""

    def __init__(
        self, folder: Path, text: str, changed: Sequence[str], pitch_mm: float, setup: DisplaySetup | None
    ) -> None:
        self._folder, self._text, self._changed, self._pitch_mm, self._setup = folder, text, changed, pitch_mm, setup
        self._file = folder / "proved_recipe.yaml"
        self._caches = (folder / f"cache-{number}" for number in count())
        self._file.write_text(text, encoding="utf-8")
        self._recipe = read_recipe(self._file)[0]
        files = {file: sha256_of_file(folder / file) for file in self._recipe.inputs()}
        self._context = BuildContext(folder, files, pitch_mm, setup, 1)
        self._cache = next(self._caches)
        self._set = self._built(self._cache)

    def _built(self, cache: Path) -> StimulusSet:
        with patch.dict(os.environ, CYCLOPEAN_CACHE=str(cache)):
            return build_set(self._file, self._pitch_mm, setup=self._setup)

    def _keys(self, context: BuildContext) -> dict[str, str]:
        return {name: key for task in self._recipe.tasks(context) for name, key in task.items()}

    def _made(self, names: Collection[str], context: BuildContext | None = None) -> Iterator[MadePicture]:
        return self._recipe.make(context or self._context, lambda *_: None, frozenset(names))

    def _written(self, made: MadePicture, file: str) -> str:
        """Write a picture as a build does, and return its SHA-256."""
        path = self._folder / file
        if isinstance(made.image, CodedPicture):
            return str(made.image.save(path))
        if isinstance(made.image, BandedPicture):
            if made.image.save(path, str(self._recipe.observer)):
                return sha256_of_file(path)
            assert made.plainly is not None
            return self._written(made.plainly(), file)
        write_exr(path, made.image, str(self._recipe.observer), exact=made.exact)
        return sha256_of_file(path)

    def named(self) -> str | None:
        names, made = self._recipe.names(), tuple(picture.name for picture in self._made(self._recipe.names()))
        keys = tuple(self._keys(self._context))
        return None if names == made == keys else f"it names {names}, makes {made} and has keys of {keys}"

    def cached(self) -> str | None:
        wanted, made = len({entry["key"] for entry in self._set.manifest["stimuli"]}), self._set.rendered
        after = self._built(self._cache).rendered
        return None if (made, after) == (wanted, 0) else f"{made} of {wanted} made, then {after}"

    def again(self) -> str | None:
        return _differing(self._set, self._built(next(self._caches)))

    def alone(self) -> str | None:
        for name in self._recipe.names():
            found = [(made.name, self._written(made, "alone.exr")) for made in self._made([name])]
            if found != [(name, self._set.entry(name)["sha256"])]:
                return f"'{name}' is another alone" if [made for made, _ in found] == [name] else f"{name}: {found}"
        return None

    def keyed(self) -> str | None:
        before, files = self._keys(self._context), self._context.file_hashes
        newer = self._keys(replace(self._context, generator_version=2))
        if same := [name for name in before if newer[name] == before[name]]:
            return f"'{same[0]}' has the same key for another version"
        for file in files:
            if self._keys(replace(self._context, file_hashes={**files, file: "0" * 64})) == before:
                return f"no key is another when {file} is"
        return None

    def changes(self) -> str | None:
        try:
            for number, other in enumerate(self._changed):
                self._file.write_text(other, encoding="utf-8")
                fresh, here = self._built(next(self._caches)), self._built(self._cache)
                if differs := _differing(fresh, here):
                    return f"changed recipe {number}: {differs}"
        finally:
            self._file.write_text(self._text, encoding="utf-8")
        return None

    def banded(self) -> str | None:
        for made in self._made(self._recipe.names()):
            if made.plainly is not None and self._written(made, "bands.exr") != self._written(
                made.plainly(), "whole.exr"
            ):
                return f"'{made.name}' differs"
        return None

    def refused(self) -> str | None:
        for file in self._recipe.inputs():
            content = read_regular(self._folder / file, 2**30)
            for cut in (0, len(content) // 3, len(content) - 1):
                with self._beside(file, content[:cut]) as context, suppress(InputError):
                    list(self._made(self._recipe.names(), context))
        return None

    @contextmanager
    def _beside(self, file: str, content: bytes) -> Iterator[BuildContext]:
        """Have the recipe's files in a folder of their own, one of them with another content."""
        folder = self._folder / "harmed"
        for name in self._recipe.inputs():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(self._folder / name, folder / name)
        (folder / file).write_bytes(content)
        yield replace(self._context, folder=folder)
        shutil.rmtree(folder)


def _differing(one: StimulusSet, other: StimulusSet) -> str | None:
    if one.digest == other.digest:
        return None
    names = [name for name in one.names if name not in other.names or one.entry(name) != other.entry(name)]
    return f"{', '.join(names) or 'its pictures'} differ"
