"""`kind: practice`: a few trials of another block that are not scored, with feedback on each answer if wanted."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Annotated, Any, Literal

from pydantic import Field

from documents.yaml import FileModel, Natural
from runner.blocks.block import Block, BlockKind, Draft, Fault, Steps
from runner.blocks.context import BlockContext, Stimuli
from runner.blocks.registry import AnyBlock
from runner.ports import Choose, ChooseBatch, Hold, Response, answer
from runner.views.interface import ENGLISH
from runner.views.pages import page
from runner.views.style import Style

Feedback = Literal["none", "correctness", "choice"]
_FEEDBACK_S = 2.0
_PLACES = {
    ("top", "first"): "upper_picture",
    ("top", "second"): "lower_picture",
    ("left", "first"): "left_picture",
    ("left", "second"): "right_picture",
}
_ANSWERS = {
    "first": "first_picture",
    "second": "second_picture",
    "no_difference": "answer_no_difference",
    "not_sure": "answer_not_sure",
    "yes": "answer_yes",
    "no": "answer_no",
}


class Until(FileModel):
    """Enough: of the last ``of`` answers with a right and a wrong, at least the share ``correct`` was right."""

    correct: Annotated[float, Field(gt=0, le=1)]
    """The share of right answers that is enough."""
    of: Annotated[Natural, Field(le=100_000)]
    """Over how many of the last answers the share is taken."""

    def reached(self, right: Sequence[bool]) -> bool:
        """Return whether it is enough, by which of the last answers were right."""
        return len(right) == self.of and sum(right) >= self.correct * self.of


class Practice(BlockKind):
    """At most ``trials`` trials of ``block``; ``until`` may end it sooner. ``block`` is of any kind that has trials."""

    has_trials = False

    kind: Literal["practice"]
    block: AnyBlock
    """The block that is practised, as it would stand by itself."""
    trials: Annotated[Natural, Field(le=100_000)]
    """How many trials there are."""
    feedback: Feedback = "correctness"
    """What is said after each practised trial."""
    until: Until | None = None
    """When practice ends early: a share of right answers."""

    @property
    def least_s(self) -> float:
        """That of the block, unless the practice states its own."""
        own = "least_response_time_ms" in self.model_fields_set
        return self.least_response_time_ms / 1000.0 if own else self.block.least_s

    def meet(self, setting: BlockContext) -> Block:
        """Return the first trials of the block as the observer of ``setting`` meets it, or fewer once that is enough.

        Feedback is given before the answer is recorded: whether it was right, where that is known, or what it was.
        The response times are those of the block.
        """
        block = self.block.meet(setting)
        trials = min(self.trials, block.trials)
        each_s = block.expected_s / max(1, block.trials) + (0.0 if self.feedback == "none" else _FEEDBACK_S)
        return Block(
            entry=self,
            steps=partial(self._steps, block, setting.style),
            trials=trials,
            expected_s=trials * each_s,
            keys=block.keys,
            places_px=block.places_px,
            pictures=block.pictures,
        )

    def faults(self, stimuli: Stimuli) -> Iterator[Fault]:
        """Yield a block that cannot be practised, settings that cannot be met, and the block's faults."""
        for fault in self.block.unpractised():
            yield Fault(fault.message, ("block", *fault.path), fault.remedy)
        if self.until and self.until.of > self.trials:
            yield Fault(f"until looks at {self.until.of} answers, of {self.trials}", ("until", "of"), "raise trials")
        for fault in self.block.faults(stimuli):
            yield Fault(fault.message, ("block", *fault.path), fault.remedy)

    def _steps(self, block: Block, style: Style) -> Steps:
        """Run the block, trial by trial, until that is enough."""
        inner = block.steps()
        response: Response | None = None
        done = 0
        right: deque[bool] = deque(maxlen=self.until.of if self.until else 1)
        correct: bool | None = None
        while True:
            try:
                step = inner.send(response)
            except StopIteration:
                return
            response = None
            if isinstance(step, ChooseBatch):
                raise TypeError("a practice's answers are not scored, and not pooled")  # `faults` says so
            if isinstance(step, Hold):
                yield step
            elif not isinstance(step, Draft):
                response = answer((yield step))
                if isinstance(step.task, Choose) and step.task.correct is not None:
                    correct = response.meaning == step.task.correct
            elif self.block.is_page or "outcome" in step.data:
                continue  # a page of words inside the block is no trial, and what came of a test neither
            else:
                if isinstance(step.data.get("correct"), bool):
                    correct = step.data["correct"]
                words = feedback_words(step.data, correct, self.feedback, style.say)
                if words:
                    yield page(words, style)
                done += 1
                if correct is not None:
                    right.append(correct)
                correct = None
                data = {**step.data, "practice_of": step.kind}
                yield Draft("practice", data, step.stimuli, step.response_time_s, repeatable=step.repeatable)
                if done == self.trials or (self.until and self.until.reached(right)):
                    inner.close()
                    return


def feedback_words(
    data: Mapping[str, Any], correct: bool | None, feedback: Feedback, say: Callable[..., str] = ENGLISH.say
) -> str:
    """Return the feedback on an answer, ``correct`` or not if that is known; empty where there is none."""
    if feedback == "correctness":
        return "" if correct is None else say("right" if correct else "wrong")
    if feedback == "choice":
        given = data.get("answer")
        if given is None:
            return say("answer_kept")
        name = _PLACES.get((str(data.get("first_position")), str(given))) or _ANSWERS.get(str(given))
        return say("your_answer", answer=say(name) if name else given)
    return ""
