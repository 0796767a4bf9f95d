"""What the lines of a log beside its trials have: the header, notes, marks, resumptions, events of the window, the end.

Known fields have their types and ranges, and further ones are allowed: a newer version may add some.
"""

from __future__ import annotations

import json
import operator
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, ConfigDict, Field, Strict, field_validator

from analysis.kinds.fields import (
    SCHEMA_VERSION,
    XYZ,
    Count,
    Fields,
    Json,
    Level,
    Name,
    NotNegative,
    Number,
    Percent,
    Positive,
    RecordError,
    Text,
    Utc,
    Whole,
    WholeLevel,
    Work,
    of_whole_characters,
    read_fields,
)
from analysis.kinds.kinds import KINDS
from analysis.records.older_logs import ORDER_RULE, header_of_today
from documents.files import Repeated
from documents.yaml import Seed

_Size = Annotated[tuple[Count, Count], Strict(False)]
_Share = Annotated[float, Field(gt=0, lt=1)]
# Whole numbers stay whole: a level names a group as it was written.
Factor = Text | WholeLevel | Level | bool


class EyeCosts(Fields):
    """What the gamut clip costs one eye of a stimulus, in % of its pixels and ΔE00, or what crosstalk leaves in it."""

    percent_red: Percent | None = None
    percent_green: Percent | None = None
    percent_blue: Percent | None = None
    percent_any: Percent | None = None
    percent_negative: Percent | None = None
    percent_above_full: Percent | None = None
    delta_e_00_mean: NotNegative | None = None
    delta_e_00_max: NotNegative | None = None
    percent_noticed: Percent | None = None
    projection_delta_e_00_mean: NotNegative | None = None
    projection_delta_e_00_max: NotNegative | None = None


class Uncancelled(Fields):
    """What crosstalk could not be cancelled, by eye, and the share of white by which black was lifted for it."""

    lift_share: NotNegative | None = None
    left: EyeCosts | None = None
    right: EyeCosts | None = None

    @property
    def eyes(self) -> list[tuple[str, EyeCosts]]:
        """Each eye of which it is known, the left one first."""
        return [(eye, costs) for eye, costs in (("left", self.left), ("right", self.right)) if costs is not None]


class Clipping(Uncancelled):
    """What the gamut clip costs a stimulus, by eye."""

    crosstalk: Uncancelled | None = None


class Stimulus(Fields):
    """A stimulus of the session."""

    name: Name
    factors: dict[Name, Factor] = Field(default_factory=dict)
    size_px: _Size | None = None
    """Pixels on the screen, wide and high."""
    resampled: Text | None = None
    """How the recipe computed pixels between pixels; null if it did not."""
    flat: bool = False
    clipping: Clipping | None = None
    """If it was known when the session began."""


class Panel(Fields):
    """The panel's pixels."""

    resolution_px: _Size | None = None
    pixel_pitch_mm: Positive | None = None
    refresh_hz: Positive | None = None
    bits: Count | None = None


class Eyes(Fields):
    """A colour for each eye."""

    model_config = ConfigDict(extra="forbid")

    left: XYZ | None = None
    right: XYZ | None = None

    @property
    def known(self) -> list[tuple[float, float, float]]:
        """That of each eye of which it is known, the left one first."""
        return [xyz for xyz in (self.left, self.right) if xyz is not None]


_Row = Annotated[tuple[Number, Number, Number], Strict(False)]
_Filter = _Row | Annotated[tuple[_Row, _Row, _Row], Strict(False)]


class FilterTransmittances(Fields):
    """What an anaglyph's filters do to light; None where the display was measured through them."""

    left: _Filter | None = None
    right: _Filter | None = None
    assumed: list[Literal["left", "right"]] = Field(default_factory=list)
    white_XYZ_cd_m2: Eyes | None = None


class NominalStandard(Fields):
    """The standard that a display was taken for."""

    kind: Name | None = None
    white_cd_m2: NotNegative | None = None
    black_cd_m2: NotNegative | None = None
    black_assumed: bool | None = None
    panel_from: Text | None = None
    words: Text | None = None

    @property
    def said(self) -> str:
        """What the display was taken for, in words."""
        return self.words or self.kind or ""


class SeenDisplay(Fields):
    """The display, and how it was seen."""

    file: Text | None = None
    mode: Text | None = None
    characterised_as: Text | None = None
    nominal: NominalStandard | None = None
    source: Text | None = None
    colorimetric_observer: Text | None = None
    panel: Panel = Field(default_factory=Panel)
    monitor_settings: dict[Name, Json] = Field(default_factory=dict)
    white_XYZ_cd_m2: Eyes | None = None
    black_XYZ_cd_m2: Eyes | None = None
    ambient_XYZ_cd_m2: Eyes | None = None
    surround_XYZ_cd_m2: Eyes | None = None
    """The light around the pictures."""
    distance_mm: Positive | None = None
    glasses: Text | None = None
    mode_options: Json | None = None
    filters: FilterTransmittances | None = None
    crosstalk_cancelled: bool | None = None
    lift_black: bool | None = None
    dither: Text | None = None
    gain_map_delivers: NotNegative | None = None


class SwapIntervals(Fields):
    """Intervals between swaps of black frames."""

    frames: Count
    median_ms: NotNegative
    p99_ms: NotNegative
    shortest_ms: NotNegative | None = None
    longest_ms: NotNegative
    missed: Count | None = None
    late: Count | None = None


class Timing(Fields):
    """What is known of the time of frames."""

    compositor: Text | None = None
    verification: Text | None = None
    swap_intervals: SwapIntervals | None = None
    verification_record: Json | None = None


class GammaTables(Fields):
    """The gamma tables that were measured, loaded and set."""

    measured: dict[Name, Json] | None = None
    loaded: dict[Name, Json] | None = None
    set: Text | None = None
    accepted: bool | None = None


_Lines = Annotated[tuple[Text, ...], Strict(False)]


class SurfaceFacts(Fields):
    """What a surface says of how it shows: plain words and numbers.

    ``bits`` is what a channel's codes have; keys, wheel and mouse are stamped as they are reported, ``gamepads`` to
    ``gamepad_resolution_ms``. ``arithmetic`` is what colours are computed in; see
    `runner.presenter.arithmetic_choice`. ``monitors`` are those that it is on, each in a line; ``larger_than_screen``
    is whether a part of it is on none.
    """

    backend: Text = ""
    display_server: Text = ""
    vendor: Text = ""
    renderer: Text = ""
    gl_version: Text = ""
    size_px: _Size | None = None
    stereo: bool | None = None
    vsync: bool | None = None
    remarks: _Lines = ()
    refresh_hz: NotNegative | None = None
    bits: Count = 8
    gamepads: _Lines = ()
    gamepad_resolution_ms: NotNegative | None = None
    arithmetic: Text = ""
    monitors: _Lines = ()
    larger_than_screen: bool | None = False


class Presentation(SurfaceFacts):
    """The surface that the session was drawn on, its times, its gamma tables, and what stood beside it."""

    timing: Timing = Field(default_factory=Timing)
    gamma_table: GammaTables = Field(default_factory=GammaTables)
    results_mirror: Text | None = None
    timing_marks: list[Json] = Field(default_factory=list)


class ClassRule(Fields):
    """How perceptual classes are formed."""

    alpha: _Share = 0.05
    adjust: Literal["none", "holm", "bh", "maxz"] = "holm"
    covariance: Literal["auto", "model", "scaled", "sandwich", "shrinkage"] = "auto"


class Analysis(ClassRule):
    """The experiment's options of the analysis; the report shows classes ``beside`` its own, by other settings."""

    margin: Text | None = None
    beside: ClassRule | None = None


class Appearance(Fields):
    """What an experiment sets of its background or its text."""

    luminance_cd_m2: NotNegative | None = None
    share_of_white: NotNegative | None = None
    xy: Annotated[tuple[Number, Number], Strict(False)] | None = None
    height_arcmin: Positive | None = None
    font: Text | None = None


class Appearances(Fields):
    """What an experiment sets of how its screens look."""

    background: Appearance | None = None
    text: Appearance | None = None


class Font(Fields):
    """A font other than DejaVu Sans that drew words."""

    name: Text
    file: Text
    sha256: Text


class SessionInterface(Fields):
    """The language of the session, and what the experiment sets of how it looks and of its keys."""

    language: Name = "en"
    style: Appearances = Field(default_factory=Appearances)
    keys: Json = Field(default_factory=dict)
    words: dict[Name, Text] = Field(default_factory=dict)
    keyboard_labels: dict[Name, Text] = Field(default_factory=dict)
    fonts: list[Font] = Field(default_factory=list)


# A pair in JSON is a list; strictly taken, it would be no tuple.
Ends = Annotated[tuple[Whole, Whole], Strict(False)]


class Planned(Fields):
    """One block of the session as it began: its kind, and how many trials and how much time it is expected to take.

    ``scales`` has the lowest and the highest number of each scale by its name.
    """

    kind: Name
    trials: Count
    expected_s: NotNegative
    scales: dict[Name, Ends] = Field(default_factory=dict)

    @field_validator("scales")
    @classmethod
    def _rise(cls, scales: dict[str, tuple[int, int]]) -> dict[str, tuple[int, int]]:
        if any(low >= high for low, high in scales.values()):
            raise ValueError("should have the lowest number of each scale before its highest")
        return scales


class Header(Fields):
    """The first line: experiment, observer, stimuli, device and software of a session.

    ``station`` is a random name that an account on a machine keeps, ``planned`` has each block as the session began.
    ``order_rule`` says which neighbouring observers take opposite sides: 2, the numbers 1 and 2; 1, the numbers 2 and
    3. ``sitting`` counts the observer's sessions in the folder from 1. ``hashes`` identifies the experiment, stimuli
    and display by SHA-256. ``extensions`` has the package of each kind of block that is not ours; ``software`` has its
    version.
    """

    record: Literal["session"] = "session"
    experiment: Name
    observer: Name
    session: Name
    started_utc: Utc
    seed: Seed
    question: Text
    simulated: bool
    stimuli: list[Stimulus]
    display: SeenDisplay
    analysis: Analysis
    hashes: dict[Name, Text]
    software: dict[Name, Text]
    presentation: Presentation
    remarks: Annotated[tuple[Text, ...], Strict(False)] = ()
    interface: SessionInterface = Field(default_factory=SessionInterface)
    station: Text = ""
    planned: list[Planned] = Field(default_factory=list)
    order_rule: Literal[1, 2] = ORDER_RULE
    sitting: Count = 1
    extensions: dict[Name, Name] = Field(default_factory=dict, exclude_if=operator.not_)
    schema_version: Literal[1] = SCHEMA_VERSION

    @property
    def stimulus_names(self) -> list[str]:
        """The names of the stimuli, in order."""
        return [stimulus.name for stimulus in self.stimuli]

    @property
    def factors(self) -> dict[str, dict[str, Factor]]:
        """The level of each factor of each stimulus, by names."""
        return {stimulus.name: stimulus.factors for stimulus in self.stimuli}


class SharedParts:
    """What logs that are read together have alike, each once: `texts` of lines, and what they were read as.

    ``costs`` has what the gamut clip costs a stimulus by its name, as it was stated and as it was read.
    """

    _MOST_PARTS = 600

    def __init__(self) -> None:
        self.texts = Repeated(first="stimuli", last="clipping")
        self.costs: dict[str, tuple[Any, Clipping]] = {}
        self._parts: dict[int, tuple[Any, Any]] = {}  # by the identity of what stands in a header

    def parts(self, line: dict[str, Any]) -> dict[str, Any]:
        """Return the parts of a header that are one object with those of a header before, as they were read."""
        held = {name: self._parts.get(id(line.get(name))) for name in Header.nested}
        return {name: part[1] for name, part in held.items() if part and part[0] is line[name]}

    def keep(self, line: dict[str, Any], header: Header) -> None:
        """Take note of how the parts of a header were read."""
        if len(self._parts) < self._MOST_PARTS:
            self._parts |= {
                id(line[name]): (line[name], getattr(header, name)) for name in Header.nested if name in line
            }


def read_header(line: dict[str, Any], shared: SharedParts | None = None) -> Header:
    """Return a line as a header; what it has in common with headers before is not read again.

    Raises
    ------
    RecordError
        If it is none, or one of another version of the format, or two stimuli have one name.
    """
    version = line.get("schema_version", SCHEMA_VERSION)
    if version != SCHEMA_VERSION and isinstance(version, int):
        software = line.get("software")
        by = software.get("cyclopean") if isinstance(software, dict) else None
        raise RecordError(
            f"the log has schema_version {version}, and this version of cyclopean reads {SCHEMA_VERSION}",
            f"read it with the version that recorded it{f', {by}' if isinstance(by, str) else ''}, or a newer one; "
            "if none did, restore the file from a copy",
        )
    shared, line = shared or SharedParts(), header_of_today(line)
    known = shared.parts(line)
    header = read_fields(Header, line | known, checked=known)
    shared.keep(line, header)
    names = header.stimulus_names
    for index, name in enumerate(names):
        if name in names[:index]:
            raise RecordError(f"two stimuli are called '{name}'")
    for kind, package in header.extensions.items():
        if kind not in KINDS:
            what = f"it has trials of kind '{kind}', which {package} {header.software.get(package, '')} adds"
            raise RecordError(what.replace("  ", " "), f"install it: pip install {package}")
    return header


def new_header(experiment: str, observer: str, session: str, started_utc: str, **fields: Any) -> Header:
    """Return the header of a session that begins, as it will be read.

    Parameters
    ----------
    experiment, observer, session
        The experiment's name, the observer's code, and the session's label.
    started_utc
        When it begins.
    fields
        Further fields of `Header`, as JSON has them. What describes stimuli, display and program is empty where it is
        not given; the seed is then 0.

    Raises
    ------
    RecordError
        If a field is not what it should be.

    Examples
    --------
    >>> new_header("views", "01", "s1", "2026-01-31T09:30:00Z", display={"mode": "flat"}).display.mode
    'flat'
    """
    line: dict[str, Any] = {"record": "session", "experiment": experiment, "observer": observer, "session": session}
    line |= {"started_utc": started_utc, "seed": 0, "question": "", "simulated": False, "stimuli": []}
    line |= {part: {} for part in ("display", "analysis", "hashes", "software", "presentation")}
    return read_header(of_whole_characters(json.loads(json.dumps({**line, **fields}))))


class Note(Fields):
    """A note ``by`` the observer, the experimenter or the program, made after ``trial`` of ``block``."""

    record: Literal["note"] = "note"
    text: Annotated[Text, BeforeValidator(of_whole_characters)]
    by: Name
    block: Count
    trial: Count
    utc: Utc


class Mark(Fields):
    """A request to repeat a trial, and ``by`` whom."""

    record: Literal["mark"] = "mark"
    block: Count
    trial: Count
    by: Name
    utc: Utc


class Change(Fields):
    """SHA-256 before and after."""

    before: Text | None
    now: Text | None


class Resumption(Fields):
    """A session was resumed; ``accepted_changes`` maps what had changed to its SHA-256 before and after.

    ``clock_behind_s`` is how far the machine's clock stood before the last record; the session's times count on from
    that record all the same. ``software`` has the versions that differ from those that wrote the log so far.
    """

    record: Literal["resume"] = "resume"
    utc: Utc
    accepted_changes: dict[Name, Change] = Field(default_factory=dict)
    """What had changed, by its name."""
    clock_behind_s: NotNegative = 0.0
    software: dict[Name, Text] = Field(default_factory=dict, exclude_if=operator.not_)


class WindowEvent(Fields):
    """What became of the window after ``trial`` trials of ``block``.

    ``what`` is ``lost_focus``, ``got_focus``, ``minimised``, ``restored``, ``resized`` (to ``size_px``) or ``moved``
    (to the ``monitor``).
    """

    record: Literal["window"] = "window"
    what: Name
    block: Count
    trial: Count
    utc: Utc
    # What belongs to other events is left out.
    size_px: Annotated[tuple[Count, ...], Strict(False), Field(max_length=2, exclude_if=operator.not_)] = ()
    monitor: Annotated[str, BeforeValidator(of_whole_characters), Field(exclude_if=operator.not_)] = ""


class StimulusCosts(Fields):
    """What the gamut clip costs stimuli, by name, of which neither the header nor a trial before says it."""

    record: Literal["clipping"] = "clipping"
    stimuli: dict[Name, Clipping]
    utc: Utc


class EndRecord(Fields):
    """The session is complete."""

    record: Literal["end"]
    work: dict[Name, Work] = Field(default_factory=dict)
    screened_out: bool = False
