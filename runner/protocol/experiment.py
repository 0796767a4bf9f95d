"""An experiment file with everything it names: rig, display, recipe, blocks."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, StringConstraints, create_model

from analysis.report import METHODS_ITEMS
from devices.display import AskMonitor, Rig, read_rig
from documents import Finding, InputError, load_document
from documents.files import beside, looked_for, no_file_name
from documents.text import did_you_mean
from documents.yaml import FileModel, Path_, Seed, YamlSource
from runner.blocks.block import Block, BlockKind, Fault, Named
from runner.blocks.context import BlockContext, Draw, Factors, Stimuli
from runner.blocks.registry import AnyBlock
from runner.errors import SessionError
from runner.presenter.dithering import Dithering
from runner.presenter.ground import Ground
from runner.presenter.modes.mode import Mode, visible_part
from runner.presenter.modes.options import ModeOptions
from runner.presenter.modes.registry import find_mode
from runner.presenter.surfaces.screens import primary_monitor
from runner.protocol.appearance import (
    OwnKeys,
    OwnStyle,
    OwnWords,
    StyleSpec,
    font_faults,
    interface_faults,
    interface_of,
    key_clashes,
    light_faults,
)
from runner.scene import Offset
from runner.views.field_types import Line
from runner.views.layout import NO_REFERENCE, PHYSICAL, LayoutError, LayoutSpec, aperture_px
from runner.views.style import Style
from stimuli.build import other_observer
from stimuli.pictures import Part
from stimuli.recipes import read_recipe

MOST_TRIALS = 100_000
# More than the textures of any graphics card, and than any screen.
MOST_PX = 65_536
_BIDS_LABEL = re.compile(r"[A-Za-z0-9]+")


def _margin(text: str) -> str:
    from analysis.scaling import parse_margin

    try:
        parse_margin(text)
    except InputError as error:
        raise ValueError(error.findings[0].remedy or str(error)) from error
    return text


def _folder_name(name: str) -> str:
    if why := no_file_name(name):
        raise ValueError(f"sessions lie in a folder of this name, and {why}: choose another")
    return name


class ClassSettings(FileModel):
    """How perceptual classes are formed: level of the pairwise tests, their adjustment and standard errors.

    ``covariance`` is ``model``, which takes all answers for independent; ``scaled``, ``sandwich`` or ``shrinkage``,
    which take only the observers for that; or ``auto``: ``shrinkage`` from two observers on.
    """

    alpha: Annotated[float, Field(gt=0, lt=1)] = 0.05
    """The level of the pairwise tests between stimuli."""
    adjust: Literal["none", "holm", "bh", "maxz"] = "holm"
    """How the tests are adjusted for their number."""
    covariance: Literal["auto", "model", "scaled", "sandwich", "shrinkage"] = "auto"
    """Which standard errors the report takes."""


class AnalysisSpec(ClassSettings):
    """How the report forms perceptual classes, and what it says beside them.

    ``margin`` is the largest difference that does not matter, such as 0.5jnd or 55:45: the report then says which pairs
    are equivalent. ``beside`` are other settings, such as those of an earlier study: the report shows their classes
    beside its own.
    """

    margin: Annotated[str, AfterValidator(_margin)] | None = None
    """The largest difference that does not matter, such as 0.5jnd or 55:45."""
    beside: Annotated[ClassSettings | None, Field(exclude_if=lambda settings: settings is None)] = None
    """Settings whose classes the report shows beside its own, such as those of an earlier study."""


Fact = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=2000)]
_FACTS: Mapping[str, Any] = MappingProxyType(
    {
        item.code: (Annotated[Fact | None, Field(description=f"The answer to “{item.question}”, for Methods.")], None)
        for item in METHODS_ITEMS
        if item.may_be_given
    }
)
MethodsSpec = create_model(
    "MethodsSpec",
    __base__=FileModel,
    __doc__="What a paper must say and no log can: each fact fills a blank of the report's Methods.",
    __module__=__name__,
    **_FACTS,
)


class ExperimentSpec(FileModel):
    """An experiment file. ``rig`` and ``stimuli`` are paths relative to it."""

    schema_version: Literal[1]
    """The version of the file format: 1."""
    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]*$", max_length=64), AfterValidator(_folder_name)]
    """The name of the experiment, which is that of its folder of results."""
    rig: str
    """The rig file, relative to this file."""
    stimuli: str
    """The recipe of the stimuli, relative to this file."""
    question: Line
    """The question that stands above the pictures."""
    layout: LayoutSpec
    """How a trial looks."""
    blocks: Annotated[list[AnyBlock], Field(min_length=1)]
    """The parts of a session, in their order."""
    seed: Seed = 0
    """The seed of all random orders."""
    analysis: AnalysisSpec = AnalysisSpec()
    """How the report forms perceptual classes."""
    style: OwnStyle = StyleSpec()
    """How the screen looks: background, text, progress, end page."""
    keys: OwnKeys = Field(default_factory=dict)
    """Other keys for the answers, by what they mean."""
    words: OwnWords = Field(default_factory=dict)
    """Other words of the interface, and its language."""
    # No part of what a digest is made of: facts may be written when the sessions are over.
    methods: Annotated[MethodsSpec, Field(exclude=True)] = MethodsSpec()
    """What a paper must say and no log can, such as why there are so many observers, for the report's Methods."""

    @property
    def facts(self) -> Mapping[str, str]:
        """The facts of ``methods`` that are given, by the code of their item."""
        return self.methods.model_dump(exclude_none=True)

    @property
    def digest(self) -> str:
        """SHA-256 of what the file says, whatever its comments and layout, and without its ``methods``.

        A file that leaves the reference out keeps the digest that it had when that meant a physical one: its sessions
        can be resumed. So does one in which settings that led the analysis now stand beside others.
        """
        spec, beside = self, self.analysis.beside
        if beside is not None:
            led = AnalysisSpec(**beside.model_dump(), margin=self.analysis.margin)
            spec = spec.model_copy(update={"analysis": led})
        if "reference" not in spec.layout.model_fields_set:
            layout = spec.layout.model_copy(update={"reference": PHYSICAL})
            spec = spec.model_copy(update={"layout": layout})
        return hashlib.sha256(spec.model_dump_json().encode()).hexdigest()


@dataclass(frozen=True, slots=True)
class Experiment:
    """An experiment file, read and checked.

    ``example_blocks`` are the blocks as observer 01 meets them. Every observer meets as many trials, in an order of
    their own and at the same places. ``name_clashes`` are names that mean different things in two blocks: no session
    is begun with them, and one that was begun before can be resumed. ``keyboard_labels`` are what the keyboard, once it
    is known, prints at the places of digits and Latin letters that none of its keys prints: hints say it.
    """

    file: Path
    spec: ExperimentSpec
    rig: Rig
    recipe_file: Path
    stimuli: Stimuli
    view_px: tuple[int, int]
    example_blocks: tuple[Block, ...] = field(repr=False, compare=False)
    name_clashes: tuple[Finding, ...] = ()
    keyboard_labels: Mapping[str, str] = field(default_factory=dict, repr=False, compare=False)

    @property
    def stimulus_names(self) -> tuple[str, ...]:
        """The names of all stimuli, a reference picture among them."""
        return tuple(self.stimuli.factors)

    @property
    def scored_names(self) -> tuple[str, ...]:
        """The stimuli that simulated observers need a score of: none where every question has a right answer."""
        return self.stimulus_names if any(block.by_scores for block in self.spec.blocks) else ()

    @property
    def mode(self) -> Mode:
        """The stereo mode, adjusted as the rig says."""
        return find_mode(self.rig.mode, ModeOptions.parse(self.rig.spec.mode_options))

    @property
    def aperture_px(self) -> tuple[int, int]:
        """The size (width, height) of what is shown of each picture."""
        return aperture_px(self.spec.layout, self.rig.display.panel)

    @property
    def style(self) -> Style:
        """How words look, and what they are."""
        return _style(self.spec, self.rig, self.view_px, self.font, self.keyboard_labels)

    @property
    def font(self) -> Path | None:
        """The file of the study's own font, None if it has none."""
        return self.spec.style.font(self.file)

    @property
    def ground(self) -> Ground | None:
        """The background and the light of words; None where the experiment sets neither."""
        return self.spec.style.ground

    @property
    def end_page(self) -> str | None:
        """What a page says after the last block, None if there is no such page."""
        ends_in_words = self.spec.blocks[-1].is_page
        wanted = self.spec.style.end_page
        shown = not ends_in_words if wanted is None else wanted
        return self.style.say("thanks") if shown else None

    @property
    def visible_part(self) -> Part | None:
        """Which part of each picture the layout's aperture shows, for `StimulusSet.load`; None where it is all."""
        return visible_part(self.aperture_px, self.mode.areas(self.rig.display.panel.resolution_px)[0])

    @property
    def dithering(self) -> Dithering | None:
        """How pictures are dithered, None if they are rounded."""
        return None if self.rig.spec.dither == "none" else Dithering(self.rig.spec.dither)

    @property
    def places_px(self) -> tuple[Offset, ...]:
        """Where stimuli are shown, as offsets from the middle of each eye's view, each once."""
        return tuple(dict.fromkeys(place for block in self.example_blocks for place in block.places_px))

    @property
    def digest(self) -> str:
        """SHA-256 of what the file says, whatever its comments and layout, and without its ``methods``."""
        return self.spec.digest

    def refuse_name_clashes(self) -> None:
        """Raise SessionError if a name means different things in two blocks, which results could not tell apart."""
        if self.name_clashes:
            raise SessionError(self.name_clashes)

    def blocks(self, observer: str, draw: Draw = Draw()) -> tuple[Block, ...]:  # noqa: B008  # it is frozen
        """Return the blocks as ``observer`` will meet them: the order is drawn from both by ``draw``."""
        settings = _settings(self.spec, self.rig, self.style, self.stimuli, observer, draw)
        return tuple(kind.meet(setting) for kind, setting in zip(self.spec.blocks, settings, strict=True))


def doubts(design: Experiment) -> Iterator[Fault]:
    """Yield what the blocks warn of, at its place in the file."""
    settings = _settings(design.spec, design.rig, design.style, design.stimuli, "01", Draw())
    for index, (block, setting) in enumerate(zip(design.spec.blocks, settings, strict=True)):
        for fault in block.doubts(setting):
            yield Fault(fault.message, ("blocks", index, *fault.path), fault.remedy)


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


def read_experiment(
    file: str | Path,
    mode: str | None = None,
    *,
    allow_uncharacterised: bool = False,
    ask_monitor: AskMonitor = primary_monitor,
    monitors: tuple[str, ...] = (),
) -> Experiment:
    """Read an experiment file and everything it names: rig, display and recipe.

    Parameters
    ----------
    file
        Experiment file.
    mode
        Stereo mode in place of the rig's.
    allow_uncharacterised
        Whether to use another mode's characterisation if the mode has none, as `devices.display.rig_file.read_rig`.
    ask_monitor
        Called for the monitor where the rig does not state the panel of a nominal display.
    monitors
        Monitors in place of the rig's, by name or number.

    Returns
    -------
    Experiment
        What the files say, checked, with the blocks as observer 01 meets them.

    Raises
    ------
    InputError
        With every fault of the experiment and of the files that it names.

    Examples
    --------
    >>> design = read_experiment("experiments/dynamic_range.yaml")
    >>> design.spec.name, len(design.stimulus_names), sum(block.trials for block in design.example_blocks)
    ('dynamic_range', 10, 45)
    """
    file = Path(file)
    spec, source = load_document(file, ExperimentSpec, "experiment")
    findings: list[Finding] = []
    rig: Rig | None = None
    stimuli: Stimuli | None = None
    view_px: tuple[int, int] | None = None
    recipe_file = beside(file, spec.stimuli)
    try:
        rig_file = _existing(beside(file, spec.rig), "rig", spec.rig, source)
        rig = read_rig(
            rig_file, mode, allow_uncharacterised=allow_uncharacterised, ask_monitor=ask_monitor, monitors=monitors
        )
        mode_options = ModeOptions.parse(rig.spec.mode_options)
        view_px = find_mode(rig.mode, mode_options).areas(rig.display.panel.resolution_px)[0].view_px
    except InputError as error:
        findings += _placed(error, source, ("rig",))
    try:
        recipe, _ = read_recipe(_existing(recipe_file, "stimuli", spec.stimuli, source))
        factors: Mapping[str, Factors] = recipe.factors()
        if rig and (mixed := other_observer(str(recipe.observer), rig.observer)):
            findings.append(source.finding(("stimuli",), *mixed))
        reference = spec.layout.reference
        if reference in (NO_REFERENCE, PHYSICAL):
            stimuli = Stimuli(factors)
        elif reference in factors:
            stimuli = Stimuli(factors, reference)
        else:
            findings.append(_unknown_reference(reference, tuple(factors), source))
    except InputError as error:
        findings += error.findings
    sound = set(range(len(spec.blocks))) if stimuli else set()
    if stimuli:
        for index, block in enumerate(spec.blocks):
            for fault in block.faults(stimuli):
                findings.append(source.finding(("blocks", index, *fault.path), fault.message, fault.remedy))
                sound.discard(index)
    if not rig or not view_px:
        raise SessionError(findings)
    said = [*interface_faults(spec.words, spec.keys), *font_faults(spec.style, file)]
    findings += _at(source, said)
    if said:
        raise SessionError(findings)
    style = _style(spec, rig, view_px, spec.style.font(file), {})
    blocks, wrong = _make_blocks(spec, _settings(spec, rig, style, stimuli or Stimuli({}), "01", Draw()), source)
    findings += wrong
    findings += _at(source, light_faults(spec.style, rig))
    # Only a block without a fault can be walked through.
    walked = [block for index, block in blocks.items() if index in sound and block.trials <= MOST_TRIALS]
    findings += _at(source, key_clashes(style.interface, walked))
    faults = list(_too_large(rig.display.panel.resolution_px))
    if not findings and not faults:
        faults += _too_many(spec.blocks, tuple(blocks.values()))
    findings += _at(source, faults)
    if findings or stimuli is None:
        raise SessionError(findings)
    clashes = tuple(_name_clashes(spec.blocks, stimuli, source))
    return Experiment(file, spec, rig, recipe_file, stimuli, view_px, tuple(blocks.values()), clashes)


def _settings(
    spec: ExperimentSpec, rig: Rig, style: Style, stimuli: Stimuli, observer: str, draw: Draw
) -> list[BlockContext]:
    """Return what ``observer`` meets each block in."""
    common = spec.name, spec.seed, spec.question, spec.layout, rig, style, stimuli
    following = ["page" if block.begins_with_words else "trials" for block in spec.blocks[1:]]
    after: list[Any] = [*following, "nothing"]
    return [BlockContext(*common, observer, index, after[index], draw) for index in range(len(spec.blocks))]


def _style(
    spec: ExperimentSpec, rig: Rig, view_px: tuple[int, int], font: Path | None, keyboard_labels: Mapping[str, str]
) -> Style:
    return spec.style.make(view_px, interface_of(spec.words, spec.keys, keyboard_labels), rig, font)


def _make_blocks(
    spec: ExperimentSpec, settings: Sequence[BlockContext], source: YamlSource
) -> tuple[dict[int, Block], list[Finding]]:
    """Return the blocks that can be made, by place, and why the others cannot; what does not fit is reported once."""
    blocks: dict[int, Block] = {}
    findings: list[Finding] = []
    unfit: list[Finding] = []
    for block, setting in zip(spec.blocks, settings, strict=True):
        try:
            blocks[setting.index] = block.meet(setting)
        except LayoutError as error:
            unfit = unfit or _placed(error, source, ("layout", "size_mm"))
        except InputError as error:
            findings += _placed(error, source, ("blocks", setting.index))
    return blocks, [*findings, *unfit]


def _at(source: YamlSource, faults: Iterable[Fault]) -> list[Finding]:
    return [source.finding(fault.path, fault.message, fault.remedy) for fault in faults]


def _existing(path: Path, key: str, value: str, source: YamlSource) -> Path:
    if not os.path.isfile(path):  # of a name that no file can have, the method of a path raises
        raise SessionError(source.finding((key,), f"there is no such file: {value}", looked_for(path, value)))
    return path


def _placed(error: InputError, source: YamlSource, path: Path_) -> list[Finding]:
    """Return the findings, those without a file of their own placed at ``path``."""
    return [f if f.file else source.finding(path, f.message, f.remedy or "") for f in error.findings]


def _unknown_reference(name: str, known: Sequence[str], source: YamlSource) -> Finding:
    remedy = did_you_mean(name, (NO_REFERENCE, PHYSICAL, *known), "write none, physical, or the name of a stimulus")
    return source.finding(("layout", "reference"), f"the reference '{name}' is no stimulus of the recipe", remedy)


def _too_many(specs: Sequence[BlockKind], blocks: Sequence[Block]) -> Iterator[Fault]:
    """Yield blocks of more trials than a session can hold."""
    for index, (spec, block) in enumerate(zip(specs, blocks, strict=True)):
        if block.trials > MOST_TRIALS:
            keys = [key for key in ("repeats", "trials") if key in type(spec).model_fields]
            path: Path_ = ("blocks", index, *keys[:1])
            yield Fault(f"these are {block.trials} trials", path, f"a block has {MOST_TRIALS} at most")


def _too_large(resolution_px: tuple[int, int]) -> Iterator[Fault]:
    """Yield a panel that no graphics card can serve."""
    if max(resolution_px) > MOST_PX:
        what = f"the display's panel has {resolution_px[0]} x {resolution_px[1]} px"
        yield Fault(what, ("rig",), f"at most {MOST_PX} each way can be drawn; correct resolution_px")


def _name_clashes(specs: Sequence[BlockKind], stimuli: Stimuli, source: YamlSource) -> Iterator[Finding]:
    """Yield each name of a series or a scale that means something else where it stands first.

    Blocks of one kind may share a name that means the same, as where a block is repeated later in the session.
    """
    first: dict[tuple[str, str, str], tuple[int, Named]] = {}
    taken = {(spec.kind, named.what, named.name) for spec in specs for named in spec.named(stimuli)}
    for index, spec in enumerate(specs):
        for named in spec.named(stimuli):
            key = spec.kind, named.what, named.name
            before, other = first.setdefault(key, (index, named))
            if other.meaning == named.meaning:
                continue
            place = source.place(("blocks", before, *other.path), key=True)
            where = f"block {before + 1}" + (f" (line {place.line})" if place else "")
            what = f"the {named.what} '{named.name}' means {named.words} here and {other.words} in {where}"
            if before == index:
                what = f"two of the {named.what} that the factors make are called '{named.name}': "
                what += f"{other.words}; {named.words}"
            remedy = _remedy(named, key, taken, in_one_block=before == index)
            yield source.finding(("blocks", index, *named.path), f"{what}; results would mix them", remedy, key=True)


def _remedy(named: Named, key: tuple[str, str, str], taken: set[tuple[str, str, str]], *, in_one_block: bool) -> str:
    if named.path[-1] == "by":
        return "list the series by name" + (" in one of the blocks" if not in_one_block else "")
    number = 2
    while (*key[:2], f"{named.name}_{number}") in taken:
        number += 1
    return f"give it a name of its own, such as '{named.name}_{number}'"
