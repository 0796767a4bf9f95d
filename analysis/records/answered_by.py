"""Who answered: people, simulated observers, or both; and which sessions count together.

Simulated observers are never counted with people unless that is asked for. Where a person and a simulated observer have
one code, they are two observers.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace

from analysis.records.session_record import SessionLog
from documents.text import counted


@dataclass(frozen=True, slots=True)
class WhoAnswered:
    """The codes of the ``people`` and of the ``simulated`` observers, each once, in the order of their sessions.

    ``sessions_of_people`` and ``simulated_sessions`` are numbers of sessions.
    """

    people: tuple[str, ...] = ()
    simulated: tuple[str, ...] = ()
    sessions_of_people: int = 0
    simulated_sessions: int = 0

    @classmethod
    def of(cls, sessions: Iterable[tuple[str, bool]]) -> WhoAnswered:
        """Return who answered in ``sessions``: pairs of an observer's code and whether it was simulated."""
        each = list(sessions)
        people = [code for code, simulated in each if not simulated]
        others = [code for code, simulated in each if simulated]
        return cls(tuple(dict.fromkeys(people)), tuple(dict.fromkeys(others)), len(people), len(others))

    @property
    def all_simulated(self) -> bool:
        """Whether every observer is simulated."""
        return bool(self.simulated) and not self.people

    @property
    def are_mixed(self) -> bool:
        """Whether people and simulated observers stand side by side."""
        return bool(self.simulated and self.people)

    @property
    def shared(self) -> tuple[str, ...]:
        """The codes that both a person and a simulated observer have."""
        return tuple(code for code in self.people if code in set(self.simulated))

    def words(self, codes: Collection[str] | None = None) -> str:
        """Return how many observers there are, such as "6 observers, 5 of them simulated"; of ``codes`` if given."""
        people = [code for code in self.people if codes is None or code in codes]
        simulated = [code for code in self.simulated if codes is None or code in codes]
        if not people and simulated:
            return counted(len(simulated), "simulated observer", "simulated observers")
        words = counted(len(people) + len(simulated), "observer", "observers")
        return f"{words}, {len(simulated)} of them simulated" if simulated else words


def who_answered(sessions: Iterable[SessionLog]) -> WhoAnswered:
    """Return who answered in the logs of sessions."""
    return WhoAnswered.of((str(session.header.observer), session.header.simulated) for session in sessions)


def counts(who: WhoAnswered, *, simulated: bool, with_simulated: bool = False) -> bool:
    """Return whether a session counts, of a ``simulated`` observer or of a person, among those of ``who``."""
    return with_simulated or not (simulated and who.people)


@dataclass(frozen=True, slots=True)
class CountedSessions:
    """The ``sessions`` that count together, in order, and those of simulated observers that are ``left_out``."""

    sessions: tuple[SessionLog, ...]
    left_out: WhoAnswered = WhoAnswered()

    @property
    def notes(self) -> tuple[str, ...]:
        """A sentence on those who are left out, if there are any."""
        who = self.left_out
        return (left_out_note(who.simulated_sessions),) if who.simulated_sessions else ()


def left_out_note(sessions: int) -> str:
    """Return the sentence on so many sessions of simulated observers that are left out."""
    words = "session of a simulated observer is" if sessions == 1 else "sessions of simulated observers are"
    them = "it" if sessions == 1 else "them"
    return f"{sessions} {words} left out, beside those of people; --with-simulated counts {them} too."


def pool(sessions: Sequence[SessionLog], *, with_simulated: bool = False) -> CountedSessions:
    """Return the sessions that count together: of people, of simulated observers where there are no people, or both.

    Parameters
    ----------
    sessions
        Sessions of any observers.
    with_simulated
        Whether simulated observers count beside people. One whose code a person has too is then called
        ``CODE (simulated)``.

    Returns
    -------
    CountedSessions
        The sessions that count, in the order given.
    """
    who = who_answered(sessions)
    chosen = tuple(
        one for one in sessions if counts(who, simulated=one.header.simulated, with_simulated=with_simulated)
    )
    if len(chosen) < len(sessions):
        return CountedSessions(chosen, who_answered(one for one in sessions if one.header.simulated))
    shared = frozenset(who.shared)
    return CountedSessions(
        tuple(_apart(one) if one.header.simulated and one.header.observer in shared else one for one in chosen)
    )


def _apart(session: SessionLog) -> SessionLog:
    """Return a simulated observer's session under a code that no person has."""
    code = session.header.observer
    header = session.header.model_copy(update={"observer": f"{code} (simulated)"})
    return replace(session, header=header, recorded_as=session.recorded_as or code)
