"""A built set of stimuli: pictures on disk, and the facts on each of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from documents import Finding, InputError
from documents.files import read_cached_json, sha256_of_json
from documents.text import did_you_mean
from stimuli.build.known_hashes import KnownHashes
from stimuli.errors import StimulusError
from stimuli.pictures.coded import SUFFIXES as CODED
from stimuli.pictures.coded import read_coded
from stimuli.pictures.exr_read import read_exr
from stimuli.pictures.exr_write import LEAST_PX, bands_of_blocks
from stimuli.pictures.region import Part, Region
from stimuli.pictures.stereo_image import StereoImage
from stimuli.recipes.build_context import Factors

MANIFEST = "manifest.json"
SUFFIXES = (".exr", *CODED)  # of the pictures


@dataclass(frozen=True, slots=True)
class StimulusSet:
    """Stimuli in the recipe's order, read from a folder of the cache.

    ``digest`` is the SHA-256 of names, factors and the files' own SHA-256: equal digests show equal pictures.
    ``rendered`` counts the pictures that this build made; 0 if all of them were there.
    """

    recipe_path: Path
    folder: Path
    names: tuple[str, ...]
    digest: str
    manifest: Mapping[str, Any]
    rendered: int = 0

    @property
    def manifest_path(self) -> Path:
        """The manifest: every step, its parameters and statistics, and the SHA-256 of each file."""
        return self.folder / MANIFEST

    def entry(self, name: str) -> Mapping[str, Any]:
        """Return the manifest's entry of the stimulus ``name``.

        Raises
        ------
        StimulusError
            If there is no such stimulus.
        """
        for entry in self.manifest["stimuli"]:
            if entry["name"] == name:
                found: Mapping[str, Any] = entry
                return found
        remedy = did_you_mean(name, self.names)
        raise StimulusError(Finding(f"there is no stimulus '{name}'", str(self.recipe_path), remedy=remedy))

    def factors(self, name: str) -> Factors:
        """Return the stimulus's factors, such as ``image``, ``view``, ``exposure_s`` and ``luminance_scale``."""
        factors: Factors = self.entry(name)["factors"]
        return factors

    def path(self, name: str) -> Path:
        """Return the stimulus's file: OpenEXR, or codes or own files of an ordinary picture that no step changed."""
        return self.folder / str(self.entry(name)["file"])

    def size_px(self, name: str) -> tuple[int, int]:
        """Return the stimulus's width and height."""
        width, height = self.entry(name)["size_px"]
        return int(width), int(height)

    def load(self, name: str, part: Part | None = None) -> StereoImage:
        """Read the stimulus, in absolute XYZ: whole, or the ``part`` that is chosen by its size."""
        region = None if part is None else part(self.size_px(name))
        path = self.path(name)
        if path.suffix in CODED:
            return read_coded(path).image(region)
        return read_exr(path, region=region, observer=None)

    def bands(self, name: str) -> list[Callable[[], StereoImage]]:
        """Return what reads the stimulus, in absolute XYZ, a band of rows at a time from the top; a small one whole.

        Each may be called by a thread of its own, and takes the memory of about two megapixels.
        """
        width, height = self.size_px(name)
        if width * height < LEAST_PX:
            return [partial(self.load, name)]
        path = self.path(name)
        regions = [Region(0, rows.start, width, rows.stop - rows.start) for rows in bands_of_blocks(height, width)]
        if path.suffix in CODED:
            coded = read_coded(path)
            return [partial(coded.image, region) for region in regions]
        return [partial(read_exr, path, region=region, observer=None) for region in regions]


def digest_of(entries: list[dict[str, Any]]) -> str:
    """Return the SHA-256 over names, factors and file contents of manifest entries."""
    return sha256_of_json([{key: entry[key] for key in ("name", "factors", "sha256")} for entry in entries])


def known_hashes(folder: Path, *, verify: bool = False) -> KnownHashes:
    """Return the hashes of the set in ``folder``; their record lies beside it, so that a set never changes."""
    return KnownHashes(folder.with_name(f".{folder.name}-hashes.json"), verify=verify)


def read_stimulus_set(
    folder: Path, recipe_path: Path, *, verify: bool = False, just_built: bool = False
) -> StimulusSet | None:
    """Return the set in ``folder``, built of the recipe at ``recipe_path``, or None if it is not as it was built.

    Of a set that was ``just_built``, each picture was hashed as it was written or brought in; it is not read again.

    Pictures that lie untouched since they were last hashed are not read again, unless ``verify`` asks for it: see
    `stimuli.build.known_hashes`.
    """
    try:
        manifest = read_cached_json(folder / MANIFEST)
        entries = manifest["stimuli"]
        if any(Path(entry["file"]).name != entry["file"] for entry in entries):
            return None
        hashes = known_hashes(folder, verify=verify)
        whole = just_built or all(hashes.sha256(folder / entry["file"]) == entry["sha256"] for entry in entries)
        if not whole or manifest["digest"] != digest_of(entries):
            return None
        hashes.keep()
        return StimulusSet(recipe_path, folder, tuple(entry["name"] for entry in entries), manifest["digest"], manifest)
    except (OSError, InputError, ValueError, KeyError, TypeError):
        return None
