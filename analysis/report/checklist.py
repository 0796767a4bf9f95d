"""What journals ask of a Methods section: one list, from which Methods, JSON, `methods:` of a study and a page come.

Each item is a question that a reviewer asks. Its answer was recorded with the sessions, or follows from how the report
was computed; what neither says, people give once, in the experiment file. What nobody said is a blank to fill in.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from analysis.report.words import counted
from documents.text import JsonResult

Status = Literal["recorded", "computed", "given", "missing", "not_applicable"]
Source = Literal["recorded", "computed", "given"]
Part = Literal["observers", "display", "procedure", "analysis", "data"]


@dataclass(frozen=True, slots=True)
class Item:
    """A question, by its ``code``.

    Attributes
    ----------
    part
        The paragraph that answers it.
    source
        Where the answer comes from: ``recorded`` in the sessions' logs, ``computed`` by the report, or ``given``, in
        the experiment file.
    asked_by
        Who asks, as keys of docs/references.md.
    of_people
        Whether it asks about people, and not where all observers are simulated.
    """

    code: str
    question: str
    part: Part
    source: Source
    asked_by: tuple[str, ...]
    of_people: bool = False

    @property
    def may_be_given(self) -> bool:
        """Whether the experiment file may answer it: all but what only the computation knows."""
        return self.source != "computed"

    @property
    def blank(self) -> str:
        """What stands in Methods where nobody answered."""
        return f"[{self.question}]"


_JARS, _COBIDAS, _BIDS, _BT500, _OPEN = "Appelbaum2018", "Nichols2017", "BIDS", "ITU500", "Aczel2020"

METHODS_ITEMS: tuple[Item, ...] = (
    Item(
        "observers",
        "How many observers took part, in how many sessions?",
        "observers",
        "recorded",
        (_JARS, _COBIDAS, _BT500),
    ),
    Item("sample_size", "How was the number of observers chosen?", "observers", "given", (_JARS, _COBIDAS, _OPEN)),
    Item("sensitivity", "Which difference could so many observers show?", "observers", "computed", (_JARS, _COBIDAS)),
    Item("recruitment", "Who was asked to take part, where and how?", "observers", "given", (_JARS,), True),
    Item("eligibility", "Who could take part, and who could not?", "observers", "given", (_JARS, _COBIDAS), True),
    Item("age", "How old were the observers?", "observers", "given", (_JARS, _COBIDAS, _BIDS), True),
    Item("gender", "What were the observers' genders?", "observers", "given", (_JARS, _COBIDAS, _BIDS), True),
    Item(
        "vision",
        "Was the observers' vision normal or corrected, and how tested?",
        "observers",
        "given",
        (_BT500,),
        True,
    ),
    Item(
        "experience",
        "Were the observers experts, and did they know the purpose of the study?",
        "observers",
        "given",
        (_BT500,),
        True,
    ),
    Item("payment", "What did observers get for taking part?", "observers", "given", (_JARS,), True),
    Item("ethics", "Who approved the study, under which number?", "observers", "given", (_JARS, _COBIDAS, _BIDS), True),
    Item("consent", "How did the observers consent?", "observers", "given", (_JARS, _COBIDAS), True),
    Item(
        "exclusions",
        "Who was left out, why, and which answers do not count?",
        "observers",
        "computed",
        (_JARS, _COBIDAS, _BT500, _OPEN),
    ),
    Item("display", "On which display were the stimuli shown, and how was it set?", "display", "recorded", (_BT500,)),
    Item("viewing", "From what distance were the stimuli seen?", "display", "recorded", (_BT500,)),
    Item("room", "How was the room lit?", "display", "recorded", (_BT500,), True),
    Item("colours", "How were colours and light measured?", "display", "recorded", (_BT500,)),
    Item(
        "seen",
        "How large were the stimuli at the eyes, on what surround, and what of them was not shown?",
        "display",
        "recorded",
        (_BT500,),
    ),
    Item("timing", "How exact were the times of frames and onsets?", "display", "recorded", (_COBIDAS,)),
    Item("stimuli", "How many stimuli were there, and in what do they differ?", "procedure", "recorded", (_BT500,)),
    Item("materials", "What do the stimuli show, and where are they from?", "procedure", "given", (_JARS, _BT500)),
    Item(
        "task",
        "What did the observers do, and what were they asked?",
        "procedure",
        "recorded",
        (_JARS, _COBIDAS, _BIDS),
    ),
    Item("trials", "How many trials did a session have?", "procedure", "recorded", (_COBIDAS, _BT500)),
    Item("order", "How were the trials ordered?", "procedure", "recorded", (_JARS, _COBIDAS, _BT500)),
    Item("sessions", "When were the sessions, and how long?", "procedure", "recorded", (_JARS, _BT500)),
    Item(
        "preregistration",
        "Was the study registered before, with its analysis and its rule for leaving out observers?",
        "procedure",
        "given",
        (_JARS, _OPEN),
    ),
    Item("analysis", "How were the results computed, and their intervals?", "analysis", "computed", (_JARS, _COBIDAS)),
    Item("draws", "How many random draws were made, with which seed?", "analysis", "computed", (_COBIDAS,)),
    Item("p_values", "Which p value is reported where there are several?", "analysis", "computed", (_JARS, _COBIDAS)),
    Item("correction", "Of how many tests is each p value corrected?", "analysis", "computed", (_JARS, _COBIDAS)),
    Item("effect_sizes", "Which effect sizes are reported, with which intervals?", "analysis", "computed", (_JARS,)),
    Item("software", "With which software, of which version?", "analysis", "recorded", (_COBIDAS, _BIDS)),
    Item("records", "How are the records protected from change?", "data", "recorded", ()),
    Item("data", "Where are the data, and who may use them?", "data", "given", (_COBIDAS, _BIDS, _OPEN)),
    Item("code", "Where are the experiment's files and the code of the analysis?", "data", "given", (_COBIDAS, _OPEN)),
)
NOT_OF_PEOPLE = "All observers were simulated."


@dataclass(frozen=True, slots=True)
class ItemAnswer(JsonResult):
    """The answer to an ``item``: its ``text``, and where it is from; of one that is missing the blank to fill in."""

    item: Item
    status: Status
    text: str
    json_keys: ClassVar = {"item.code": "code", "item.part": "part"}
    json_names: ClassVar = "item.code item.part item.question item.asked_by status answer"

    @property
    def answer(self) -> str | None:
        """The text; None of one that is missing."""
        return None if self.status == "missing" else self.text


def answer(item: Item, said: str, given: str, *, simulated: bool) -> ItemAnswer:
    """Return the answer to ``item``: what the records or the computation ``said`` first, then what people have given.

    ``simulated`` says that all observers are.
    """
    given = " ".join(given.split())
    if said:
        status: Status = "computed" if item.source == "computed" else "recorded"
        return ItemAnswer(item, status, f"{said} {given}".strip())
    if given:
        return ItemAnswer(item, "given", given)
    if item.of_people and simulated:
        return ItemAnswer(item, "not_applicable", NOT_OF_PEOPLE)
    return ItemAnswer(item, "missing", item.blank)


@dataclass(frozen=True, slots=True)
class Methods(JsonResult):
    """An answer to each item of the list, in its order, and the ``works`` that they cite."""

    answers: tuple[ItemAnswer, ...] = ()
    works: tuple[str, ...] = ()
    json_keys: ClassVar = {"answers": "items", "missing_items": "missing", "works": "references"}
    json_names: ClassVar = "answers missing_items works"

    @property
    def missing(self) -> tuple[ItemAnswer, ...]:
        """The blanks to fill in."""
        return tuple(one for one in self.answers if one.status == "missing")

    @property
    def sentence(self) -> str:
        """Which facts are missing, and where to write them; empty if none is."""
        codes = [one.item.code for one in self.missing]
        if not codes:
            return ""
        return (
            f"{counted(len(codes), 'fact')} that journals ask for {'is' if len(codes) == 1 else 'are'} missing, and "
            f"blank in Methods: {', '.join(codes)}. Write {'it' if len(codes) == 1 else 'them'} under methods: in the "
            "experiment file."
        )

    @property
    def missing_items(self) -> list[dict[str, str]]:
        """Code and question of each item that is missing."""
        return [{"code": one.item.code, "question": one.item.question} for one in self.missing]
