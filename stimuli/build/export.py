"""A built set as OpenEXR files and a recipe that shows them as they are: from here a careful user goes on."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

from devices.colour_matching import DEFAULT_OBSERVER
from documents.files import whole_folder, writing
from stimuli.build.stimulus_set import StimulusSet
from stimuli.pictures.coded import SUFFIXES as CODED
from stimuli.pictures.exr_write import write_exr
from stimuli.recipes.build_context import Factors

RECIPE = "recipe.yaml"
# Set by the recipe itself.
_OWN_FACTORS = ("image", "view", "series")


def export_exr(built: StimulusSet, folder: Path, report: Callable[[int, int], None] = lambda done, total: None) -> None:
    """Write each stimulus of a built set to ``folder`` as OpenEXR in XYZ, both views, with a recipe of kind pictures.

    Codes of ordinary pictures become single precision; half floats stay what they are. The folder appears as a whole.

    Parameters
    ----------
    built
        The set, from `build_set`.
    folder
        A new or empty folder.
    report
        Called with how many pictures of how many are written.

    Raises
    ------
    InputError
        If it cannot be written.

    Examples
    --------
    >>> import numpy as np
    >>> from tempfile import TemporaryDirectory
    >>> from PIL import Image
    >>> from stimuli.build import build_set
    >>> recipe = "schema_version: 1\\nkind: pictures\\ncolour_space: srgb\\nwhite_luminance_cd_m2: 100\\n"
    >>> with TemporaryDirectory() as folder:
    ...     Image.fromarray(np.full((4, 6, 3), 99, np.uint8)).save(Path(folder, "grey.png"))
    ...     _ = Path(folder, "r.yaml").write_text(recipe + "stimuli: [{name: grey, file: grey.png}]")
    ...     export_exr(build_set(Path(folder, "r.yaml"), 0.25), Path(folder, "light"))
    ...     sorted(path.name for path in Path(folder, "light").iterdir())
    ['grey.exr', 'recipe.yaml']
    """
    observer = str(built.manifest["recipe"].get("observer", DEFAULT_OBSERVER))
    with writing(folder, "exported pictures"), whole_folder(folder) as draft:
        for done, name in enumerate(built.names):
            report(done, len(built.names))
            if built.path(name).suffix in CODED:
                write_exr(draft / f"{name}.exr", built.load(name), observer, exact=True)
            else:
                shutil.copyfile(built.path(name), draft / f"{name}.exr")
        (draft / RECIPE).write_text(_recipe(built, observer), encoding="utf-8")
        report(len(built.names), len(built.names))


def _recipe(built: StimulusSet, observer: str) -> str:
    lines = ["# XYZ in cd/m², as `cyclopean stimuli build` made them.", "schema_version: 1", "kind: pictures"]
    if observer != DEFAULT_OBSERVER:
        lines.append(f"observer: {observer}")
    lines.append("stimuli:")
    for name in built.names:
        factors = _factors(built.factors(name))
        more = f", factors: {json.dumps(factors, ensure_ascii=False)}" if factors else ""
        lines.append(f"  - {{name: {json.dumps(name)}, file: {json.dumps(name + '.exr')}{more}}}")
    return "\n".join(lines) + "\n"


def _factors(factors: Factors) -> dict[str, str | float]:
    return {key: value for key, value in factors.items() if key not in _OWN_FACTORS}
