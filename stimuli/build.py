"""From a recipe to a stimulus set, built once: the cache is keyed by everything that the pictures depend on.

A set is found by the key of all its pictures together. Where there is none, each picture whose own key another set has
is taken from there, so that changing one stimulus makes one picture. A build works in a folder of its own, whose name
begins with a dot, and the set appears as a whole when all is there. What a killed build had finished stays in that
folder, and the next one goes on from it; what a build had finished before it met wrong input is removed.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from documents import Finding, InputError
from documents.yaml_source import YamlSource
from stimuli.display_setup import DisplaySetup
from stimuli.errors import StimulusError
from stimuli.exr import write_exr
from stimuli.known_hashes import KnownHashes
from stimuli.luminance.statistics import picture_statistics
from stimuli.make_pictures import Made
from stimuli.names import stimulus_factors
from stimuli.pictures_kept import Entry, Workshop, link_or_copy, pictures_of_sets
from stimuli.plan import Surroundings, Task, input_files, needed_setup, plan
from stimuli.recipe import AnyRecipe, read_recipe
from stimuli.sparkle_measures.find import Threshold
from stimuli.stimulus_set import (
    MANIFEST,
    StimulusSet,
    digest_of,
    read_stimulus_set,
    sha256_of_file,
    sha256_of_json,
)
from stimuli.versions import versions

__all__ = ["Progress", "StimulusSet", "build", "cache_folder"]

# Raise it when the same recipe makes other pictures than before, or a manifest holds other things.
GENERATOR_VERSION = 2
_EXPOSED = ("expose", "exposure")

Progress = Callable[[str, int, int], None]


def cache_folder() -> Path:
    """Return where stimulus sets are kept: ``CYCLOPEAN_CACHE``, else ``cyclopean/stimuli`` in the user's cache."""
    own = os.environ.get("CYCLOPEAN_CACHE")
    if own:
        return Path(own)
    home = os.environ.get("XDG_CACHE_HOME")
    return (Path(home) if home else Path.home() / ".cache") / "cyclopean" / "stimuli"


def build(
    recipe_path: Path,
    pixel_pitch_mm: float,
    progress: Progress | None = None,
    *,
    setup: DisplaySetup | None = None,
    jobs: int = 1,
    force: bool = False,
    verify: bool = False,
) -> StimulusSet:
    """Build the stimuli of the recipe at ``recipe_path`` for a display, or find them built.

    Parameters
    ----------
    progress
        Called with what is being done, and how many pictures of how many are done; by one thread at a time.
    setup
        What the display can show, and from where it is seen: needed by recipes that fit pictures to a display's range,
        and used by those that align or resample, to say what their steps mean to an eye.
    jobs
        How many threads make pictures.
    force
        Whether to make all pictures anew.
    verify
        Whether to read all pictures of a set that is found, instead of those that were touched since they were hashed.

    Raises
    ------
    InputError
        If the recipe or a picture is wrong, or the cache cannot be written.
    """
    recipe_path = Path(recipe_path)
    if not (math.isfinite(pixel_pitch_mm) and pixel_pitch_mm > 0):
        raise StimulusError(f"pixel_pitch_mm is {pixel_pitch_mm}; it must be a finite number above 0")
    recipe, source = read_recipe(recipe_path)
    cache = cache_folder()
    hashes = KnownHashes(cache / f".inputs-{sha256_of_json(str(recipe_path.absolute()))[:16]}.json", verify=verify)
    inputs = _inputs(recipe, source, recipe_path, hashes)
    resolved = {
        "generator_version": GENERATOR_VERSION,
        "recipe": recipe.model_dump(mode="json"),
        "pixel_pitch_mm": float(pixel_pitch_mm),
        "inputs": inputs,
        **needed_setup(recipe, setup),
    }
    folder = cache / sha256_of_json(resolved)[:32]
    found = None if force else read_stimulus_set(folder, recipe_path, verify=verify)
    if found is not None:
        hashes.keep()
        return found
    from filelock import FileLock

    around = Surroundings(recipe_path.parent, inputs, float(pixel_pitch_mm), setup, GENERATOR_VERSION, recipe.sparkles)
    try:
        cache.mkdir(parents=True, exist_ok=True)
        with FileLock(folder.with_name(f"{folder.name}.lock")):
            found = None if force else read_stimulus_set(folder, recipe_path, verify=verify)
            if found is None:
                builder = _Builder(recipe, plan(recipe, around), folder, progress or _silent, force)
                entries = builder.build(jobs)
                _publish(entries, resolved, folder, builder.workshop)
                found = read_stimulus_set(folder, recipe_path)
                if found is None:
                    raise StimulusError(Finding("the stimuli were written but read back otherwise", str(folder)))
                found = replace(found, rendered=builder.made)
            hashes.keep()
            return found
    except OSError as error:
        raise StimulusError(Finding(f"the stimuli cannot be kept: {error.strerror or error}", str(cache))) from error


def _inputs(recipe: AnyRecipe, source: YamlSource, recipe_path: Path, hashes: KnownHashes) -> dict[str, str]:
    """Return the SHA-256 of each file that the recipe names, refusing those that are not there."""
    contents: dict[str, str] = {}
    findings = []
    for file, where in input_files(recipe).items():
        try:
            contents[file] = hashes.sha256(recipe_path.parent / file)
        except OSError as error:
            place = source.place(where)
            line, column = (place.line, place.column) if place else (None, None)
            what = "picture" if where[0] == "stimuli" else "file"
            message = f"the {what} '{file}' cannot be read: {error.strerror}"
            findings.append(Finding(message, source.file, line, column, "check the path, relative to the recipe"))
    if findings:
        raise StimulusError(findings)
    return contents


def _silent(doing: str, done: int, total: int) -> None:
    pass


class _Builder:
    """Makes what is not there yet of the pictures of ``tasks``, in a workshop beside ``folder``."""

    def __init__(
        self, recipe: AnyRecipe, tasks: tuple[Task, ...], folder: Path, progress: Progress, force: bool
    ) -> None:
        self._factors = stimulus_factors(recipe)
        self._keys = {name: key for task in tasks for name, key in task.keys.items()}
        self._tasks, self._folder, self._progress, self._force = tasks, folder, progress, force
        self._threshold = recipe.sparkles.threshold() if recipe.sparkles else None
        self.workshop = Workshop(folder.with_name(f".{folder.name}"))
        self._entries: dict[str, Entry] = {}
        # Of an earlier build that was killed.
        self._left: frozenset[str] = frozenset()
        self.made = 0
        self._turn = threading.Lock()
        self._stop = threading.Event()

    def build(self, jobs: int) -> list[Entry]:
        """Return the set's entries, in the recipe's order, once all their pictures lie in the workshop."""
        if self._force:
            shutil.rmtree(self.workshop.folder, ignore_errors=True)
        self.workshop.folder.mkdir(exist_ok=True)
        try:
            if not self._force:
                self._reuse()
            tasks = self._missing()
            if jobs <= 1 or len(tasks) <= 1:
                for task, names in tasks:
                    self._make(task, names)
            else:
                self._make_in_threads(tasks, jobs)
        except InputError:
            self.workshop.forget(set(self._keys.values()) - self._left)
            raise
        self._progress("done", len(self._keys), len(self._keys))
        return [self._entry(name, key) for name, key in self._keys.items()]

    def _reuse(self) -> None:
        wanted = set(self._keys.values())
        self._entries = self.workshop.kept(wanted)
        self._left = frozenset(self._entries)
        for key, picture, entry in pictures_of_sets(self._folder.parent, wanted - self._left):
            self.workshop.take(key, picture, entry)
            self._entries[key] = entry

    def _missing(self) -> list[tuple[Task, frozenset[str]]]:
        """Return the tasks, each with the names that it is to make: one name for each key."""
        first: dict[str, str] = {}
        for name, key in self._keys.items():
            if key not in self._entries:
                first.setdefault(key, name)
        names = set(first.values())
        tasks = [(task, frozenset(names & task.keys.keys())) for task in self._tasks]
        return [(task, mine) for task, mine in tasks if mine]

    def _make(self, task: Task, names: frozenset[str]) -> None:
        for made in task.make(self._report, names):
            key = task.keys[made.name]
            entry = _write(made, key, self.workshop, self._threshold)
            with self._turn:
                self._entries[key] = entry
                self.made += 1
            if self._stop.is_set():
                return

    def _make_in_threads(self, tasks: list[tuple[Task, frozenset[str]]], jobs: int) -> None:
        from concurrent.futures import ThreadPoolExecutor, as_completed

        with ThreadPoolExecutor(jobs, thread_name_prefix="stimuli") as pool:
            futures = [pool.submit(self._make, task, names) for task, names in tasks]
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
        """Tell the progress of all tasks, in place of that of one."""
        if done < total:
            with self._turn:
                whole = sum(key in self._entries for key in self._keys.values())
                self._progress(doing, whole, len(self._keys))

    def _entry(self, name: str, key: str) -> Entry:
        entry = self._entries[key]
        factors = {**self._factors[name]}
        factors.setdefault("view", "flat" if entry["flat"] else "stereo")
        return {"name": name, "file": f"{name}.exr", "factors": factors, **entry}


def _write(made: Made, key: str, workshop: Workshop, threshold: Threshold | None) -> Entry:
    write_exr(workshop.picture(key), made.image)
    entry = {
        "key": key,
        "sha256": sha256_of_file(workshop.picture(key)),
        "flat": made.image.is_flat,
        "size_px": [made.image.width_px, made.image.height_px],
        "statistics": _statistics(made, threshold),
        "steps": [dict(step) for step in made.steps],
    }
    workshop.keep(key, entry)
    return entry


def _statistics(made: Made, threshold: Threshold | None) -> dict[str, Any]:
    """Return the columns of Table 4.3 that the picture and its steps hold."""
    exposures = [step.get("exposure_s", step.get("time_s")) for step in made.steps if step["step"] in _EXPOSED]
    scales = [float(step["luminance_scale"]) for step in made.steps if "luminance_scale" in step]
    exposure_s = float(exposures[0]) if exposures and exposures[0] is not None else None
    scale = math.prod(scales)
    if threshold is not None:
        try:
            return picture_statistics(
                made.image, exposure_s=exposure_s, luminance_scale=scale, threshold=threshold
            ).to_json()
        except StimulusError as error:
            raise StimulusError([_of_stimulus(one, made.name) for one in error.findings]) from error
    return picture_statistics(made.image, exposure_s=exposure_s, luminance_scale=scale).to_json()


def _of_stimulus(finding: Finding, name: str) -> Finding:
    return replace(finding, message=f"the stimulus '{name}': {finding.message}")


def _publish(entries: list[Entry], resolved: Mapping[str, Any], folder: Path, workshop: Workshop) -> None:
    """Let the set appear in ``folder``, in one step, in place of what may be broken there."""
    draft, old = folder.with_name(f".{folder.name}-new"), folder.with_name(f".{folder.name}-old")
    for left in (draft, old):
        shutil.rmtree(left, ignore_errors=True)
    draft.mkdir()
    for entry in entries:
        link_or_copy(workshop.picture(entry["key"]), draft / entry["file"])
    manifest = {
        "schema_version": 2,
        **resolved,
        "versions": versions(),
        "stimuli": entries,
        "digest": digest_of(entries),
    }
    (draft / MANIFEST).write_text(json.dumps(manifest, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    if folder.exists():
        # Who reads pictures of it meanwhile finds them there all but for the moment between these two.
        folder.rename(old)
    draft.rename(folder)
    shutil.rmtree(old, ignore_errors=True)
    shutil.rmtree(workshop.folder)
