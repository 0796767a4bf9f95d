"""An experiment file with everything it names: rig, display, recipe, blocks."""

from __future__ import annotations

import difflib
import hashlib
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from devices.rig_file import Rig, read_rig
from documents import Finding, InputError, load_document
from documents.yaml_source import Path_, YamlSource
from runner.aperture import LoadPart, through_aperture
from runner.blocks.all_pairs import AllPairs, PairLayout
from runner.blocks.message import Message
from runner.blocks.steps import Block
from runner.errors import SessionError
from runner.layout import pair_layout
from runner.presenter.dithering import Dithering
from runner.presenter.modes.mode import Mode
from runner.presenter.modes.options import ModeOptions
from runner.presenter.modes.registry import find_mode
from runner.presenter.scene import Offset
from runner.protocol.schema import AllPairsSpec, ExperimentSpec
from stimuli.names import stimulus_names
from stimuli.recipe import read_recipe
from stimuli.stereo_image import StereoImage

_BIDS_LABEL = re.compile(r"[A-Za-z0-9]+")


@dataclass(frozen=True, slots=True)
class Experiment:
    """An experiment file, read and checked."""

    file: Path
    spec: ExperimentSpec
    rig: Rig
    recipe_file: Path
    stimulus_names: tuple[str, ...]
    area_px: tuple[int, int]
    layout: PairLayout

    @property
    def mode(self) -> Mode:
        """The stereo mode, adjusted as the rig says."""
        return find_mode(self.rig.mode, ModeOptions.parse(self.rig.mode_options))

    def shown(self, load: LoadPart) -> Callable[[str], StereoImage]:
        """Return ``load`` with its pictures cropped to what the layout's aperture shows of them."""
        area = self.mode.areas(self.rig.display.panel.resolution_px)[0]
        return through_aperture(load, self.layout.aperture_px, area)

    @property
    def dithering(self) -> Dithering | None:
        """How pictures are dithered, None if they are rounded."""
        return None if self.rig.dither == "none" else Dithering(self.rig.dither)

    @property
    def places_px(self) -> tuple[Offset, ...]:
        """Where pictures are shown, as offsets from the middle of each eye's view."""
        return self.layout.first_px, self.layout.second_px

    @property
    def digest(self) -> str:
        """SHA-256 of what the file says, whatever its comments and layout."""
        return hashlib.sha256(self.spec.model_dump_json().encode()).hexdigest()

    def stimuli(self, block: AllPairsSpec) -> tuple[str, ...]:
        """Return the names that ``block`` compares."""
        return self.stimulus_names if block.stimuli == "all" else tuple(block.stimuli)

    def blocks(self, observer: str) -> tuple[Block, ...]:
        """Return the blocks as ``observer`` will meet them: the order is drawn from experiment and observer."""
        number = _number(observer)
        blocks: list[Block] = []
        for index, spec in enumerate(self.spec.blocks):
            if isinstance(spec, AllPairsSpec):
                # Two neighbouring observers share an orientation and take opposite sides of it.
                seed = f"{self.spec.seed}/{self.spec.name}/{index}/{number // 2}"
                blocks.append(
                    AllPairs(
                        self.stimuli(spec),
                        self.spec.question,
                        self.layout,
                        seed,
                        order_seed=f"{seed}/{observer}",
                        flip_sides=bool(number % 2),
                        repeats=spec.repeats,
                        break_every=spec.break_every,
                        fixation_s=spec.fixation_s,
                        exposure_s=spec.exposure_s,
                        blank_s=spec.blank_s,
                    )
                )
            else:
                blocks.append(Message(spec.kind, spec.text))
        return tuple(blocks)


def _number(observer: str) -> int:
    """Return the observer's number if the label is one, else a number drawn from it."""
    if observer.isdecimal():
        return int(observer)
    return int.from_bytes(hashlib.sha256(observer.encode()).digest()[:8])


def check_observer(observer: str) -> str:
    """Return ``observer`` if it is a BIDS label (letters and digits only), which also keeps it out of other folders."""
    if not _BIDS_LABEL.fullmatch(observer) or len(observer) > 64:
        plain = re.sub(r"[^A-Za-z0-9]", "", observer)
        raise SessionError(
            Finding(
                f"the observer id {observer!r} is no BIDS label",
                remedy="use up to 64 letters and digits only" + (f", such as '{plain[:64]}'" if plain else ""),
            )
        )
    return observer


def read_experiment(file: Path, mode: str | None = None, *, allow_uncharacterised: bool = False) -> Experiment:
    """Read the experiment ``file`` and everything it names; ``mode`` replaces the rig's stereo mode.

    ``allow_uncharacterised`` is `devices.rig_file.read_rig`'s.

    Raises
    ------
    InputError
        With every fault found, in the experiment and in the files it names.
    """
    spec, source = load_document(file, ExperimentSpec)
    findings: list[Finding] = []
    rig: Rig | None = None
    names: tuple[str, ...] = ()
    area_px: tuple[int, int] | None = None
    layout: PairLayout | None = None
    recipe_file = file.parent / spec.stimuli
    try:
        rig_file = _existing(file.parent / spec.rig, "rig", spec.rig, source)
        rig = read_rig(rig_file, mode, allow_uncharacterised=allow_uncharacterised)
        mode_options = ModeOptions.parse(rig.mode_options)
        area_px = find_mode(rig.mode, mode_options).areas(rig.display.panel.resolution_px)[0].view_px
    except InputError as error:
        findings += _placed(error, source, ("rig",))
    if rig and area_px:
        try:
            layout = pair_layout(spec.layout, rig.display.panel, area_px)
        except InputError as error:
            findings += _placed(error, source, ("layout", "size_mm"))
    try:
        recipe, _ = read_recipe(_existing(recipe_file, "stimuli", spec.stimuli, source))
        names = stimulus_names(recipe)
    except InputError as error:
        findings += error.findings
    for index, block in enumerate(spec.blocks):
        if isinstance(block, AllPairsSpec) and names:
            findings += _stimuli_findings(block, names, source, ("blocks", index, "stimuli"))
    if findings or rig is None or area_px is None or layout is None:
        raise SessionError(findings)
    return Experiment(file, spec, rig, recipe_file, names, area_px, layout)


def _existing(path: Path, key: str, value: str, source: YamlSource) -> Path:
    if not path.is_file():
        raise SessionError(_finding(f"there is no such file: {value}", source, (key,), "check the path"))
    return path


def _finding(message: str, source: YamlSource, path: Path_, remedy: str) -> Finding:
    place = source.place(path)
    return Finding(message, source.file, place.line if place else None, place.column if place else None, remedy)


def _placed(error: InputError, source: YamlSource, path: Path_) -> list[Finding]:
    """Return the findings, those without a file of their own placed at ``path``."""
    return [f if f.file else _finding(f.message, source, path, f.remedy or "") for f in error.findings]


def _stimuli_findings(block: AllPairsSpec, known: Sequence[str], source: YamlSource, path: Path_) -> list[Finding]:
    if block.stimuli == "all":
        few = len(known) < 2
        return [_finding("the recipe makes one stimulus only", source, path[:-1], "pairs need two")] if few else []
    findings = []
    for index, name in enumerate(block.stimuli):
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            remedy = f"did you mean '{near[0]}'?" if near else "the recipe makes: " + ", ".join(known)
            findings.append(_finding(f"the recipe makes no stimulus '{name}'", source, (*path, index), remedy))
        elif name in block.stimuli[:index]:
            findings.append(_finding(f"the stimulus '{name}' stands twice", source, (*path, index), "remove one"))
    return findings
