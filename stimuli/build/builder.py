"""Makes the pictures of a set that are not there yet, and lets the set appear when all are."""

from __future__ import annotations

import json
import math
import os
import shutil
import threading
from collections.abc import Collection, Iterator, Mapping
from contextvars import copy_context
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from documents import Finding, InputError
from documents.files import read_cached_json, sha256_of_file, unwritable, write_whole
from documents.platform import rename
from stimuli.build.cache import OTHER_CACHE
from stimuli.build.stimulus_set import MANIFEST, SUFFIXES, digest_of, known_hashes
from stimuli.errors import StimulusError
from stimuli.luminance.statistics import picture_statistics
from stimuli.pictures.coded import CodedPicture
from stimuli.pictures.exr_write import write_exr
from stimuli.pictures.stereo_image import StereoImage
from stimuli.recipes.banded_picture import BandedPicture
from stimuli.recipes.build_context import BuildContext, MadePicture, Progress
from stimuli.recipes.recipe import RECIPES
from stimuli.recipes.recipe_kind import RecipeKind
from stimuli.sparkles.find import SparkleThreshold

Entry = dict[str, Any]

_EXPOSED = ("expose", "exposure")
_PACKAGES = ("cyclopean", "numpy", "scipy", "OpenImageIO", "rawpy")


class UnfinishedSet:
    """The folder in which a set is being built: a picture and its entry for each key, until all are there.

    Its name begins with a dot: it is no set. It outlives a killed build, and the next build resumes there.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def picture(self, key: str, suffix: str) -> Path:
        """Return where the picture of ``key`` lies, in a file of ``suffix``."""
        return self.folder / f"{key}{suffix}"

    def record(self, key: str, entry: Entry) -> None:
        """Record that the picture of ``key`` is whole; the record appears after the picture, whole or not at all."""
        write_whole(self._entry_file(key), json.dumps(entry, allow_nan=False))

    def recorded(self, keys: Collection[str]) -> dict[str, Entry]:
        """Return the entries of those ``keys`` whose picture lies here as it was made."""
        hashes = known_hashes(self.folder)
        entries = {}
        for key in keys:
            try:
                entry = read_cached_json(self._entry_file(key))
                if hashes.sha256(self.picture(key, entry["suffix"])) == entry["sha256"]:
                    entries[key] = entry
            except (OSError, InputError, ValueError, KeyError, TypeError):
                continue
        return entries

    def remove(self, keys: Collection[str]) -> None:
        """Remove the pictures of ``keys``, and the folder if nothing else is in it."""
        for key in keys:
            for suffix in SUFFIXES:
                self.picture(key, suffix).unlink(missing_ok=True)
            self._entry_file(key).unlink(missing_ok=True)
        for pattern in (*(f".*{suffix}" for suffix in SUFFIXES), "*.part"):
            for left in self.folder.glob(pattern):
                left.unlink(missing_ok=True)
        if self.folder.is_dir() and not any(self.folder.iterdir()):
            self.folder.rmdir()

    def link(self, key: str, picture: Path, entry: Entry) -> None:
        """Bring in a picture from another set: the same file under another name, where the file system has that."""
        here = self.picture(key, picture.suffix)
        here.unlink(missing_ok=True)
        link_or_copy(picture, here)
        self.record(key, {**entry, "suffix": picture.suffix})

    def _entry_file(self, key: str) -> Path:
        return self.folder / f"{key}.json"


def link_or_copy(file: Path, other: Path) -> None:
    """Give ``file`` the name ``other`` too, or copy it where the file system has one name for each file."""
    try:
        os.link(file, other)
    except OSError:
        shutil.copyfile(file, other)


def pictures_of_sets(cache: Path, keys: Collection[str]) -> Iterator[tuple[str, Path, Entry]]:
    """Yield key, file and entry of pictures in the sets of ``cache`` that have one of ``keys`` and are whole."""
    left = set(keys)
    for manifest in sorted(cache.glob(f"[!.]*/{MANIFEST}")):
        if not left:
            return
        try:
            entries = read_cached_json(manifest)["stimuli"]
            hashes = known_hashes(manifest.parent)
            for entry in entries:
                key, picture = entry.get("key"), manifest.with_name(str(entry["file"]))
                if key in left and picture.is_file() and hashes.sha256(picture) == entry["sha256"]:
                    left.discard(key)
                    yield key, picture, {name: entry[name] for name in entry if name not in ("name", "file", "factors")}
        except (OSError, InputError, ValueError, KeyError, TypeError, AttributeError):
            continue


class Builder:
    """Makes the missing pictures of ``recipe``, in a folder for the unfinished set beside ``folder``."""

    def __init__(
        self, recipe: RecipeKind, context: BuildContext, folder: Path, progress: Progress | None, force: bool
    ) -> None:
        self._recipe, self._context = recipe, context
        self._factors = recipe.factors()
        with RECIPES.blamed(recipe.kind):
            self._tasks = tuple(recipe.tasks(context))
        self._keys = {name: key for task in self._tasks for name, key in task.items()}
        self._folder, self._progress, self._force = folder, progress, force
        self._threshold = recipe.sparkles.threshold() if recipe.sparkles else None
        self.unfinished = UnfinishedSet(folder.with_name(f".{folder.name}"))
        self._entries: dict[str, Entry] = {}
        # Of an earlier build that was killed.
        self._left: frozenset[str] = frozenset()
        self.made = 0
        self._turn = threading.Lock()
        self._stop = threading.Event()

    def build(self, jobs: int) -> list[Entry]:
        """Return the set's entries, in the recipe's order, once all their pictures are in the unfinished set."""
        if self._force:
            shutil.rmtree(self.unfinished.folder, ignore_errors=True)
        self.unfinished.folder.mkdir(exist_ok=True)
        try:
            if not self._force:
                self._reuse()
            missing = self._missing()
            if jobs <= 1 or len(missing) <= 1:
                for names in missing:
                    self._make(names)
            else:
                self._make_in_threads(missing, jobs)
        except InputError:
            self.unfinished.remove(set(self._keys.values()) - self._left)
            raise
        if self._progress is not None:
            self._progress("done", len(self._keys), len(self._keys))
        return [self._entry(name, key) for name, key in self._keys.items()]

    def _reuse(self) -> None:
        wanted = set(self._keys.values())
        self._entries = self.unfinished.recorded(wanted)
        self._left = frozenset(self._entries)
        for key, picture, entry in pictures_of_sets(self._folder.parent, wanted - self._left):
            self.unfinished.link(key, picture, entry)
            self._entries[key] = {**entry, "suffix": picture.suffix}

    def _missing(self) -> list[frozenset[str]]:
        """Return the names that each task is to make: one name for each key."""
        first: dict[str, str] = {}
        for name, key in self._keys.items():
            if key not in self._entries:
                first.setdefault(key, name)
        names = set(first.values())
        return [frozenset(mine) for task in self._tasks if (mine := names & task.keys())]

    def _make(self, names: frozenset[str]) -> None:
        for made in self._pictures(names):
            key = self._keys[made.name]
            try:
                entry = _write(made, key, self.unfinished, self._threshold, str(self._recipe.observer))
            except StimulusError as error:
                if not isinstance(error.__cause__, OSError):
                    raise
                wanted = made.image.width_px * made.image.height_px * (6 if made.image.is_flat else 12)
                cache = self._folder.parent
                what = f"picture of the stimulus '{made.name}'"
                finding = unwritable(error.__cause__, cache, what, wanted_bytes=wanted, elsewhere=OTHER_CACHE)
                raise StimulusError(finding) from error
            with self._turn:
                self._entries[key] = entry
                self.made += 1
            if self._stop.is_set():
                return

    def _pictures(self, names: frozenset[str]) -> Iterator[MadePicture]:
        with RECIPES.blamed(self._recipe.kind):
            yield from self._recipe.make(self._context, self._report, names)

    def _make_in_threads(self, missing: list[frozenset[str]], jobs: int) -> None:
        from concurrent.futures import ThreadPoolExecutor, as_completed

        with ThreadPoolExecutor(jobs, thread_name_prefix="stimuli") as pool:
            # The limit on threads holds in these too.
            futures = [pool.submit(copy_context().run, self._make, names) for names in missing]
            try:
                for future in as_completed(futures):
                    future.result()
            except BaseException:
                # What one thread could not do, or Ctrl-C, ends the others after the picture that they are at.
                self._stop.set()
                for future in futures:
                    future.cancel()
                raise

    def _report(self, doing: str, done: int, total: int) -> None:
        """Report the progress of all tasks, in place of that of one."""
        if self._progress is not None and done < total:
            with self._turn:
                whole = sum(key in self._entries for key in self._keys.values())
                self._progress(doing, whole, len(self._keys))

    def _entry(self, name: str, key: str) -> Entry:
        entry = {**self._entries[key]}
        factors = {**self._factors[name]}
        factors.setdefault("view", "flat" if entry["flat"] else "stereo")
        return {"name": name, "file": f"{name}{entry.pop('suffix')}", "factors": factors, **entry}


def _write(
    made: MadePicture, key: str, unfinished: UnfinishedSet, threshold: SparkleThreshold | None, observer: str
) -> Entry:
    suffix = made.image.suffix if isinstance(made.image, CodedPicture) else ".exr"
    picture = unfinished.picture(key, suffix)
    if isinstance(made.image, BandedPicture):
        if made.image.save(picture, observer):
            return _recorded(made, made.image.luminance(), sha256_of_file(picture), key, suffix, unfinished, threshold)
        assert made.plainly is not None
        return _write(made.plainly(), key, unfinished, threshold, observer)
    if isinstance(made.image, CodedPicture):
        digest = made.image.save(picture)
    else:
        write_exr(picture, made.image, observer, exact=made.exact)
        digest = sha256_of_file(picture)
    return _recorded(made, made.image, digest, key, suffix, unfinished, threshold)


def _recorded(
    made: MadePicture,
    image: StereoImage | CodedPicture,
    digest: str,
    key: str,
    suffix: str,
    unfinished: UnfinishedSet,
    threshold: SparkleThreshold | None,
) -> Entry:
    """Record a picture that was written, with the statistics of its luminance, which ``image`` has."""
    entry = {
        "key": key,
        "suffix": suffix,
        "sha256": digest,
        "flat": made.image.is_flat,
        "size_px": [made.image.width_px, made.image.height_px],
        "statistics": _statistics(made, image, threshold),
        "steps": [dict(step) for step in made.steps],
    }
    unfinished.record(key, entry)
    return entry


def _statistics(
    made: MadePicture, image: StereoImage | CodedPicture, threshold: SparkleThreshold | None
) -> dict[str, Any]:
    """Return the columns of Table 4.3 that the picture and its steps hold."""
    exposures = [step.get("exposure_s", step.get("time_s")) for step in made.steps if step["step"] in _EXPOSED]
    scales = [float(step["luminance_scale"]) for step in made.steps if "luminance_scale" in step]
    exposure_s = float(exposures[0]) if exposures and exposures[0] is not None else None
    scale = math.prod(scales)
    if threshold is not None:
        try:
            return picture_statistics(
                image, exposure_s=exposure_s, luminance_scale=scale, threshold=threshold
            ).to_json()
        except StimulusError as error:
            raise StimulusError([_of_stimulus(finding, made.name) for finding in error.findings]) from error
    return picture_statistics(image, exposure_s=exposure_s, luminance_scale=scale).to_json()


def _of_stimulus(finding: Finding, name: str) -> Finding:
    return replace(finding, message=f"the stimulus '{name}': {finding.message}")


def publish(entries: list[Entry], resolved: Mapping[str, Any], folder: Path, unfinished: UnfinishedSet) -> None:
    """Let the set appear in ``folder``, in one step, in place of what may be broken there."""
    draft, old = folder.with_name(f".{folder.name}-new"), folder.with_name(f".{folder.name}-old")
    for left in (draft, old):
        shutil.rmtree(left, ignore_errors=True)
    draft.mkdir()
    try:
        _fill(draft, entries, resolved, unfinished)
    except BaseException:
        shutil.rmtree(draft, ignore_errors=True)
        raise
    if folder.exists():
        # A process that reads its pictures meanwhile misses them only between these two renames.
        rename(folder, old)
    rename(draft, folder)
    shutil.rmtree(old, ignore_errors=True)
    shutil.rmtree(unfinished.folder)


def _fill(draft: Path, entries: list[Entry], resolved: Mapping[str, Any], unfinished: UnfinishedSet) -> None:
    """Bring the pictures and their manifest into ``draft``."""
    for entry in entries:
        link_or_copy(unfinished.picture(entry["key"], Path(entry["file"]).suffix), draft / entry["file"])
    manifest = {
        "schema_version": 2,
        **resolved,
        "versions": _versions(),
        "stimuli": entries,
        "digest": digest_of(entries),
    }
    (draft / MANIFEST).write_text(json.dumps(manifest, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def _versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that are installed."""
    import platform

    numbers = {"python": platform.python_version()}
    for package in _PACKAGES:
        try:
            numbers[package] = version(package)
        except PackageNotFoundError:
            continue
    return numbers
