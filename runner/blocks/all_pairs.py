"""All-pairs forced choice: every two stimuli together, which is closer to the reference?"""

from __future__ import annotations

from dataclasses import dataclass, replace

from runner.blocks.layouts import PairLayout
from runner.blocks.message import page
from runner.blocks.pair_order import pair_order
from runner.blocks.steps import Block, Draft, Hold, Steps, answer
from runner.blocks.style import FULL_HD_HALF, Style
from runner.ports import Ask
from runner.presenter.scene import Picture, Scene, Text
from runner.tasks import Compare


def fixation(style: Style) -> Scene:
    """Return a cross in the middle."""
    return Scene((style.text("+", height=48),))


@dataclass(frozen=True, slots=True)
class AllPairs(Block):
    """The thesis's second experiment (Section 4.5.2): all pairs, one answer each, a break now and then.

    In seconds, to the nearest frame: ``fixation_s`` shows a cross before each pair, ``exposure_s`` takes the pair away
    again and leaves the question (None: it stays until answered), ``blank_s`` is black between two trials.
    """

    stimuli: tuple[str, ...]
    question: str
    layout: PairLayout
    seed: str
    order_seed: str
    flip_sides: bool = False
    repeats: int = 1
    break_every: int | None = None
    fixation_s: float = 0.0
    exposure_s: float | None = None
    blank_s: float = 0.0
    style: Style = FULL_HD_HALF
    reference: str | None = None

    @property
    def trials(self) -> int:
        """Pairs times repeats."""
        return len(self.stimuli) * (len(self.stimuli) - 1) // 2 * self.repeats

    @property
    def keys(self) -> dict[str, str]:
        """The arrows that choose."""
        return self.layout.keys

    def steps(self) -> Steps:
        """Ask for every pair and record each answer."""
        order = pair_order(len(self.stimuli), self.repeats, self.seed, self.order_seed, flip=self.flip_sides)
        pairs = [(self.stimuli[first], self.stimuli[second]) for first, second in order]
        for number, (first, second) in enumerate(pairs):
            if self.break_every and number and number % self.break_every == 0:
                words = f"Time for a break.\n{number} of {len(pairs)} comparisons are done."
                yield replace(page(words, self.style), upcoming=self.scene(first, second))
            following = pairs[number + 1] if number + 1 < len(pairs) else None
            upcoming = self.scene(*following) if following else None
            if self.blank_s and number:
                yield Hold("blank", Scene(), self.blank_s)
            if self.fixation_s:
                yield Hold("fixation", fixation(self.style), self.fixation_s)
            scene = self.scene(first, second)
            if self.exposure_s:
                yield Hold("pair", scene, self.exposure_s)
                scene = Scene(scene.items[-1:])  # the question stays
            response = answer((yield Ask(scene, self.layout.keys, upcoming, Compare(first, second, self.reference))))
            chosen, rejected = (first, second) if response.meaning == "first" else (second, first)
            yield Draft(
                "all_pairs",
                {
                    "first": first,
                    "second": second,
                    "answer": response.meaning,
                    "chosen": chosen,
                    "rejected": rejected,
                    "first_position": self.layout.position_names[0],
                },
                stimuli=(first, second),
                response_time_s=response.time_s,
            )

    def scene(self, first: str, second: str) -> Scene:
        """Return the two pictures with the question above them."""
        layout = self.layout
        return Scene(
            (
                Picture(first, layout.first_px, layout.aperture_px),
                Picture(second, layout.second_px, layout.aperture_px),
                *layout.reference(self.reference),
                Text(self.question, layout.question_px, self.style.px(24), layout.question_width_px),
            )
        )
