"""The clipping costs of a session's stimuli: those that the cache has at once, each other one when it is needed.

No picture is read before the first trial for a cost that is needed later. Where a person sits at a window, a cost is
computed in a thread of its own once its picture was read to be shown; it waits while a scene is shown for a time, so
that no frame of it is late. A trial's record waits for the costs of what it showed.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from analysis.records import Clipping, Header, StimulusCosts
from runner.session.clipping_costs import ClippingCosts
from runner.session.events import Ending, Event, Recording
from runner.session.session import Session
from stimuli.pictures import StereoImage

Costs = Mapping[str, Any]


class CostsInTurn(Mapping[str, Costs]):
    """What the gamut clip costs each stimulus of ``costs``, by name; computed when it is first asked for."""

    def __init__(self, costs: ClippingCosts) -> None:
        self._costs = costs
        self._stimuli = {name: costs.outline(name) for name in costs.stimuli.names}
        self._computing = threading.Lock()
        self._gate = threading.Lock()
        self._paused = False
        self._thread: ThreadPoolExecutor | None = None
        self._waiting: set[str] = set()
        self._finished: Callable[[], object] = lambda: None

    def __getitem__(self, name: str) -> Costs:
        """Return the costs of the stimulus ``name``; its picture is read if they must be computed."""
        return self._cost(name)

    def __contains__(self, name: object) -> bool:
        """Return whether it is a stimulus; nothing is computed for that."""
        return name in self._stimuli

    def __iter__(self) -> Iterator[str]:
        """Return the names of all stimuli, in order."""
        return iter(self._stimuli)

    def __len__(self) -> int:
        """Return how many stimuli there are."""
        return len(self._stimuli)

    @property
    def stimuli(self) -> tuple[dict[str, Any], ...]:
        """Each stimulus as a session's header has it: with its costs if they are known now."""
        return tuple(self._stimuli.values())

    @property
    def is_busy(self) -> bool:
        """Whether a picture that was read waits for its costs."""
        return bool(self._waiting)

    def of(self, names: Collection[str]) -> dict[str, Costs]:
        """Return the costs of ``names``."""
        return {name: self._cost(name) for name in names}

    def begin(self, finished: Callable[[], object]) -> None:
        """Compute costs in a thread from now on, as their pictures are read; ``finished`` is called after each."""
        self._finished = finished
        if self._thread is None:
            self._thread = ThreadPoolExecutor(1, thread_name_prefix="clipping costs")

    def was_read(self, name: str, image: StereoImage) -> None:
        """Take the picture of ``name``, which was read to be shown, to compute its costs where a thread does that."""
        thread = self._thread
        if thread is None or name in self._waiting or "clipping" in self._stimuli.get(name, _KNOWN):
            return
        self._waiting.add(name)
        with suppress(RuntimeError):  # the session ended meanwhile
            thread.submit(self._in_thread, name, image)

    def pause(self) -> None:
        """Compute nothing in the thread from now on; wait for what it is at."""
        if not self._paused:
            self._gate.acquire()
            self._paused = True

    def resume(self) -> None:
        """Let the thread go on."""
        if self._paused:
            self._paused = False
            self._gate.release()

    def end(self) -> None:
        """End the thread, and leave what it has not begun for when it is asked for."""
        thread, self._thread = self._thread, None
        if thread is not None:
            self.resume()
            thread.shutdown(wait=True, cancel_futures=True)
            self._waiting.clear()

    def _in_thread(self, name: str, image: StereoImage) -> None:
        try:
            with self._gate:
                self._cost(name, image)
        finally:
            self._waiting.discard(name)
            self._finished()

    def _cost(self, name: str, image: StereoImage | None = None) -> Costs:
        with self._computing:
            if "clipping" not in self._stimuli[name]:
                self._stimuli[name] = self._costs.description(name, image)
            costs: Costs = self._stimuli[name]["clipping"]
            return costs


_KNOWN: Mapping[str, None] = {"clipping": None}


@dataclass(frozen=True, slots=True)
class RecordedCosts:
    """States with each trial of ``session`` what the gamut clip costs the stimuli that it showed.

    At the end it records the costs of those stimuli of the ``header`` of which neither that nor a trial says them; of
    stimuli that were taken out of the recipe since there are none.
    """

    costs: CostsInTurn
    session: Session
    header: Header

    def hear(self, event: Event) -> None:
        """Add the costs to what is recorded."""
        if isinstance(event, Recording) and event.stimuli and self.costs:
            event.data["clipping"] = self.costs.of([name for name in event.stimuli if name in self.costs])
        elif isinstance(event, Ending):
            said = {name for answer in self.session.answers for name in answer.clipping or ()}
            said |= {stimulus.name for stimulus in self.header.stimuli if stimulus.clipping}
            if lacking := [name for name in self.header.stimulus_names if name in self.costs and name not in said]:
                costs = {name: Clipping.model_validate(cost) for name, cost in self.costs.of(lacking).items()}
                self.session.record(lambda utc: StimulusCosts(stimuli=costs, utc=utc))
