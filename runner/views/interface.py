"""Every word of the interface in its language, and the keys that observers press: what a block says and listens to.

The words are in `languages/`, one file for each language; an experiment may set any of them, and any key.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, get_args

from documents.text import did_you_mean, nearest
from documents.yaml import read_yaml
from runner.ports import Ask

Language = Literal["en", "de", "fr"]
LANGUAGES: tuple[Language, ...] = get_args(Language)
_IN_BRACES = re.compile(r"\{(\w+)\}")
# What stands between braces, or a brace without its other one; what is shown of it is no longer than a name.
_ANY_BRACES = re.compile(r"\{[^{}]*\}|[{}]")
_LONGEST_NAME = 40
_ARROWS = ("up", "down", "left", "right")
# Words that stand in the braces of others, and have none of their own.
_INSERTED = ("arrows", "the_arrows", "arrow_keys")
# What blocks listen to, for which an experiment may give other keys. Escape always opens the pause menu.
KEYS = (*_ARROWS, "space", "enter", "home", "end", "page_up", "page_down", *"0123456789", *"abcdefghijkl", *"nrsu")
PRESSES = (
    *KEYS,
    *("tab", "backspace", "delete", "insert", "wheel_up", "wheel_down"),
    *(f"f{number}" for number in range(1, 13)),
    *(f"pad_{name}" for name in ("a", "b", "x", "y", "left_bumper", "right_bumper", "start", *_ARROWS)),
)


@cache
def words_of(language: Language) -> Mapping[str, str]:
    """Return every word of ``language`` by its name."""
    source = read_yaml(Path(__file__).with_name("languages") / f"{language}.yaml")
    words: dict[str, str] = source.data
    return MappingProxyType(words)


@dataclass(frozen=True, slots=True)
class Interface:
    """Words in ``language`` but for those that are an experiment's ``own``, and the keys in place of others.

    ``keyboard_labels`` are what keys print here at the places of digits and Latin letters that no key prints.
    """

    language: Language = "en"
    own: Mapping[str, str] = field(default_factory=dict)
    keys: Mapping[str, Sequence[str]] = field(default_factory=dict)
    keyboard_labels: Mapping[str, str] = field(default_factory=dict)

    def say(self, name: str, **values: Any) -> str:
        """Return the words called ``name``, with the keys' names and ``values`` in their places."""
        return _IN_BRACES.sub(lambda brace: self._value(brace[1], values), self._words(name))

    def key(self, name: str) -> str:
        """Return what the key that observers press for ``name`` is called: ``N (Т)`` where the key N prints Т."""
        press = self.keys.get(name, (name,))[0]
        if f"key_{press}" in words_of(self.language):
            return self._words(f"key_{press}")
        if press in self.keyboard_labels:
            return f"{press.upper()} ({self.keyboard_labels[press]})"
        if len(press) == 1:
            return press.upper() if len(press.upper()) == 1 else press
        return press.replace("_", " ").capitalize()

    def pointing(self, page: str) -> str:
        """Return the words of a page that speaks of arrow keys, and of the keys in their place if there are any."""
        words = self.say(page)
        return words if not set(_ARROWS) & set(self.keys) else f"{words}\n\n{self.say('keys_instead')}"

    def listening(self, ask: Ask) -> Ask:
        """Return ``ask`` as it is answered with these keys; where words are typed, every key is itself."""
        if not self.keys or ask.typing:
            return ask
        keys: dict[str, str] = {}
        for key, meaning in ask.keys.items():
            for press in self.keys.get(key, (key,)):
                if press not in keys or key in self.keys:
                    keys[press] = meaning
        return replace(ask, keys=keys)

    def conflicts(self, ask: Ask) -> Iterator[tuple[str, str]]:
        """Yield the keys that would mean two things here: the key in place of which it stands, and the press."""
        if ask.typing:
            return
        for key, presses in self.keys.items():
            for press in presses if key in ask.keys else ():
                means = {m for k, m in ask.keys.items() if press in self.keys.get(k, (k,))}
                if len(means) > 1:
                    yield key, press

    def _words(self, name: str) -> str:
        return self.own.get(name) or words_of(self.language)[name]

    def _value(self, name: str, values: Mapping[str, Any]) -> str:
        if name in values:
            return str(values[name])
        keys = _ARROWS if name == "arrow_keys" else _ARROWS[2:]
        if name in _INSERTED:
            return " / ".join(map(self.key, keys)) if set(keys) & set(self.keys) else self._words(name)
        return self.key(name)


ENGLISH = Interface()


def word_faults(words: Mapping[str, str]) -> Iterator[tuple[str, str, str]]:
    """Yield what is wrong with an experiment's own words: the name, the fault and its remedy."""
    english = words_of("en")
    for name, text in words.items():
        if name == "language":
            if text not in LANGUAGES:
                yield name, f"there is no language '{text}'", did_you_mean(text, LANGUAGES)
        elif name not in english:
            yield name, f"the interface has no words called '{name}'", did_you_mean(name, english)
        elif not text.strip():
            yield name, f"'{name}' is empty", "leave it out, or write words"
        else:
            yield from ((name, *fault) for fault in _brace_faults(name, text, _fillable(name)))


def _fillable(name: str) -> list[str]:
    """Return what is filled in between braces in the words called ``name``: in those of a key, nothing."""
    if name in _INSERTED or name.startswith("key_"):
        return []
    return list(dict.fromkeys([*_IN_BRACES.findall(words_of("en")[name]), *KEYS[:6]]))


def _brace_faults(name: str, text: str, known: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield braces that would stay in the words as they are: around anything but one of ``known``, or alone."""
    listed = f"there can be: {', '.join(f'{{{each}}}' for each in known)}" if known else "write it without braces"
    for braces in dict.fromkeys(_ANY_BRACES.findall(text)):
        inner = braces[1:-1]
        if inner in known:
            continue
        shown = braces if len(braces) <= _LONGEST_NAME else f"{braces[: _LONGEST_NAME - 4]}...}}"
        what = f"nothing is called {shown} in" if braces[1:] else f"'{braces}' stands without its other brace in"
        near = nearest(inner, known)
        yield f"{what} '{name}'", f"did you mean '{near}'? {listed}" if near else listed


def key_faults(keys: Mapping[str, Sequence[str]]) -> Iterator[tuple[tuple[str | int, ...], str, str]]:
    """Yield what is wrong with an experiment's keys: the place below ``keys``, the fault and its remedy."""
    for key, presses in keys.items():
        if key == "escape":
            yield (key,), "Escape always opens the pause menu", "leave it out"
        elif key not in KEYS:
            yield (key,), f"no screen asks for the key '{key}'", did_you_mean(key, KEYS)
        for index, press in enumerate(presses):
            if press == "escape":
                yield (key, index), "Escape always opens the pause menu", "name another key"
            elif press not in PRESSES and (len(press) != 1 or not press.isprintable() or press != press.lower()):
                yield (key, index), f"there is no key '{press}'", did_you_mean(press.lower(), PRESSES)
