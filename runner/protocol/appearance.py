"""`style:`, `keys:` and `words:` of an experiment file: how its screens look, what is pressed, and what they say."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Annotated, Any, cast

from pydantic import Field, model_validator
from pydantic.annotated_handlers import GetJsonSchemaHandler
from pydantic_core import CoreSchema

from devices.compensation import Correction
from devices.display import Rig, px_from_mm, size_mm
from documents import InputError
from documents.files import beside
from documents.fonts import read_font
from documents.yaml import FileModel, NotNegative, Positive
from runner.blocks.block import Block, Fault
from runner.ports import Ask
from runner.presenter.ground import Ground, Inks, Light
from runner.presenter.lettering import capital_share
from runner.presenter.modes.options import ModeOptions
from runner.presenter.modes.registry import find_mode
from runner.views.interface import KEYS, LANGUAGES, PRESSES, Interface, Language, key_faults, word_faults, words_of
from runner.views.style import Progress, Style

Coordinate = Annotated[float, Field(gt=0, lt=1)]


class _LightSpec(FileModel):
    luminance_cd_m2: Annotated[
        NotNegative | None, Field(description="Luminance in cd/m², the room's light included.")
    ] = None
    share_of_white: Annotated[
        float | None, Field(ge=0, le=1, description="Luminance as a share of that of the display's white.")
    ] = None
    xy: Annotated[
        tuple[Coordinate, Coordinate] | None,
        Field(description="CIE 1931 x and y; left out, those of the display's white."),
    ] = None

    @model_validator(mode="after")
    def _one_light(self) -> _LightSpec:
        both = self.luminance_cd_m2 is not None and self.share_of_white is not None
        if both:
            raise ValueError("give 'luminance_cd_m2' or 'share_of_white', not both")
        if self.luminance_cd_m2 is None and self.share_of_white is None and (self.xy or self._needs_light):
            raise ValueError("give its light: 'luminance_cd_m2' or 'share_of_white'")
        return self

    @property
    def _needs_light(self) -> bool:
        return True

    @property
    def light(self) -> Light | None:
        """The light, None if none is given."""
        if self.luminance_cd_m2 is None and self.share_of_white is None:
            return None
        return Light(self.luminance_cd_m2, self.share_of_white, self.xy)


class BackgroundSpec(_LightSpec):
    """What pictures and words stand on, in ``luminance_cd_m2`` or as a ``share_of_white``; black if left out."""


class TextStyleSpec(_LightSpec):
    """The light of plain words, to which all others keep their proportion, their size and their font."""

    height_arcmin: Annotated[
        Positive | None,
        Field(
            le=600,
            description="Height of a capital letter of the question, in minutes of arc at the rig's distance; ISO "
            "9241-303 recommends 20 to 22, and 16 at least. Left out, words are as large as suits the view.",
        ),
    ] = None
    font: Annotated[
        str | None,
        Field(
            exclude_if=lambda font: font is None,  # the hash of a file without it stays what it was
            min_length=1,
            description="A font file, relative to this file, for letters that it has; left out, DejaVu Sans. What it "
            "lacks comes from DejaVu Sans, then from fonts that are installed.",
        ),
    ] = None

    @property
    def _needs_light(self) -> bool:
        return False


class StyleSpec(FileModel):
    """How screens look: ``background`` and ``text``, the session's ``progress``, and a page at the end."""

    background: Annotated[BackgroundSpec | None, Field(description="Light behind everything; black if left out.")] = (
        None
    )
    text: Annotated[TextStyleSpec | None, Field(description="Light, size and font of words.")] = None
    progress: Annotated[
        Progress, Field(description="How far the session is, at the lower edge: none, bar, or count of trials.")
    ] = "none"
    end_page: Annotated[
        bool | None,
        Field(
            description="Whether a page that thanks follows the last block, for people; left out, it does unless the "
            "last block is a page. Its words are words: {thanks: ...}."
        ),
    ] = None

    @property
    def ground(self) -> Ground | None:
        """What scenes are drawn on and words are drawn in; None where neither is given."""
        background = self.background.light if self.background else None
        text = self.text.light if self.text else None
        return Ground(background, text) if background or text else None

    def font(self, experiment_file: Path) -> Path | None:
        """The file of the study's own font, None if it has none."""
        return beside(experiment_file, self.text.font) if self.text and self.text.font else None

    def make(self, view_px: tuple[int, int], interface: Interface, rig: Rig, font: Path | None) -> Style:
        """Return how words look in an eye's view of ``view_px`` at the rig's distance, with the study's ``font``."""
        arcmin = self.text and self.text.height_arcmin
        if not arcmin:
            return Style(view_px, interface, self.progress, font=font)
        capital_px = px_from_mm(size_mm(arcmin / 60.0, rig.spec.distance_mm), rig.display.panel.pixel_pitch_mm)
        return Style(view_px, interface, self.progress, float(capital_px) / capital_share(font), font)


LEAST_CONTRAST = 3.0  # of plain words to their background, in luminance: ISO 9241-303
_SCREENS_TRIED = 300  # of each block: keys mean the same in later ones


@dataclass(frozen=True, slots=True)
class _Schema:
    """The JSON Schema of a field, made when it is asked for."""

    made: Callable[[], dict[str, Any]]

    def __get_pydantic_json_schema__(self, core_schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return self.made()


def _words_schema() -> dict[str, Any]:
    words = {name: {"type": "string", "description": f"In English: {text}"} for name, text in words_of("en").items()}
    language = {"enum": list(LANGUAGES), "description": "Language of the interface: en, de or fr."}
    return {"type": "object", "properties": {"language": language, **words}, "additionalProperties": False}


def _keys_schema() -> dict[str, Any]:
    press = {"type": "string", "description": f"A printed character, or one of: {', '.join(PRESSES)}."}
    pressed = {"type": "array", "items": press, "minItems": 1}
    keys = {key: {**pressed, "description": f"What is pressed in place of {key}."} for key in KEYS}
    return {"type": "object", "properties": keys, "additionalProperties": False}


def _unset(value: Any) -> bool:
    return not value or value == StyleSpec()


# Left out of what a file says where they are not given: the hash of a file without them stays what it was.
OwnStyle = Annotated[StyleSpec, Field(exclude_if=_unset)]
OwnWords = Annotated[
    dict[str, Annotated[str, Field(max_length=2000)]],
    _Schema(_words_schema),
    Field(exclude_if=_unset, description="The interface's language, and any of its words in others."),
]
OwnKeys = Annotated[
    dict[str, Annotated[list[str], Field(min_length=1, max_length=10)]],
    _Schema(_keys_schema),
    Field(exclude_if=_unset, description="Keys that are pressed in place of others, such as left: [a]."),
]


def interface_of(
    words: Mapping[str, str], keys: Mapping[str, Sequence[str]], keyboard_labels: Mapping[str, str]
) -> Interface:
    """Return the interface that an experiment's words and keys make, both without faults, at such a keyboard."""
    own = {name: text for name, text in words.items() if name != "language"}
    return Interface(cast(Language, words.get("language", "en")), own, keys, keyboard_labels)


def interface_faults(words: Mapping[str, str], keys: Mapping[str, Sequence[str]]) -> Iterator[Fault]:
    """Yield words that the interface does not have, and keys that there are not."""
    for name, message, remedy in word_faults(words):
        yield Fault(message, ("words", name), remedy)
    for path, message, remedy in key_faults(keys):
        yield Fault(message, ("keys", *path), remedy)


def font_faults(style: StyleSpec, experiment_file: Path) -> Iterator[Fault]:
    """Yield a font that is missing or is none."""
    try:
        if font := style.font(experiment_file):
            read_font(font)
    except InputError as error:
        (fault,) = error.findings
        yield Fault(f"the font cannot be read: {fault.message}", ("style", "text", "font"), fault.remedy or "")


def light_faults(style: StyleSpec, rig: Rig) -> Iterator[Fault]:
    """Yield lights that the display cannot show, and words that would hardly be seen."""
    if style.ground is None:
        return
    mode = find_mode(rig.mode, ModeOptions.parse(rig.spec.mode_options))
    compensation = mode.compensation(rig.models, rig.display.panel.resolution_px, Correction(rig.crosstalk))
    white = rig.models.left.shown_white_XYZ_cd_m2[1]
    remedy = f"white has {white:.4g} cd/m² here: write less light, or a colour nearer to white"
    outside = [what for what, leaves in Inks(style.ground, compensation).leaves_gamut().items() if leaves]
    for what in outside:
        yield Fault(f"the display cannot show this {what}", ("style", what), remedy)
    if not outside and min(map(style.ground.contrast, (rig.models.left, rig.models.right))) < LEAST_CONTRAST:
        what = f"words and background differ by less than {LEAST_CONTRAST:g} to 1 in luminance"
        yield Fault(what, ("style",), "make the text lighter or darker; ISO 9241-303 asks for this at least")


def key_clashes(interface: Interface, blocks: Iterable[Block]) -> Iterator[Fault]:
    """Yield keys that would mean two things on one screen of ``blocks``."""
    if not interface.keys:
        return
    from runner.observers.simulated import walk

    screens = (step for block in blocks for step in islice(walk(block), _SCREENS_TRIED) if isinstance(step, Ask))
    for key, press in dict.fromkeys(clash for ask in screens for clash in interface.conflicts(ask)):
        place = list(interface.keys[key]).index(press)
        yield Fault(f"'{press}' means something else too on one screen", ("keys", key, place), "name another key")
