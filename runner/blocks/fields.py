"""What may be typed into a field: words of some length, or a number within a range."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from decimal import Decimal

LONGEST = 500
LONGEST_NUMBER = 24
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)")


@dataclass(frozen=True, slots=True)
class Words:
    """Any words of at most ``longest`` characters."""

    longest: int = LONGEST

    def refusal(self, longer: str) -> str:
        """Say why ``longer`` cannot be typed; nothing if it can."""
        return f"There is room for {self.longest} characters" if len(longer) > self.longest else ""

    def fault(self, typed: str) -> str:
        """Say what is wrong with an answer that is not empty; nothing if it will do."""
        return ""

    def value(self, typed: str) -> str:
        """Return the answer."""
        return typed.strip()

    @property
    def wanted(self) -> str:
        """What to type."""
        return "Type your answer"

    @property
    def example(self) -> str:
        """An answer that would do."""
        return "1"


@dataclass(frozen=True, slots=True)
class Number:
    """A number of ``unit`` from ``lowest`` to ``highest``, both included, without a fraction if ``whole``."""

    unit: str = ""
    lowest: float | None = None
    highest: float | None = None
    whole: bool = False

    def refusal(self, longer: str) -> str:
        """Say why ``longer`` cannot be typed; nothing if it can."""
        sign = "" if self.lowest is not None and self.lowest >= 0 else "[+-]?"
        fraction = "" if self.whole else r"([.,]\d*)?"
        if re.fullmatch(rf"{sign}\d*{fraction}", longer, re.ASCII) is None:
            return "Digits only" if self.whole and not sign else "A number only"
        return "That number is too long" if len(longer) > LONGEST_NUMBER else ""

    def fault(self, typed: str) -> str:
        """Say what is wrong with an answer that is not empty; nothing if it will do."""
        if _NUMBER.fullmatch(typed) is None:
            return self.wanted
        number = self.value(typed)
        low = self.lowest is not None and number < self.lowest
        high = self.highest is not None and number > self.highest
        return f"{typed} is too {'low' if low else 'high'}: {_lower(self.wanted)}" if low or high else ""

    def value(self, typed: str) -> float | int:
        """Return the answer; a decimal comma counts as a point."""
        plain = typed.replace(",", ".")
        return int(plain) if plain.lstrip("+-").isdigit() else float(plain)

    @property
    def wanted(self) -> str:
        """What to type."""
        unit = f" {self.unit}" if self.unit else ""
        kind = "whole number" if self.whole else "number"
        if self.lowest is not None and self.highest is not None:
            return f"Type a {kind} from {written(self.lowest)} to {written(self.highest)}{unit}"
        if self.lowest is not None:
            return f"Type a {kind}, {written(self.lowest)}{unit} or more"
        if self.highest is not None:
            return f"Type a {kind}, {written(self.highest)}{unit} or less"
        return f"Type a {kind}{f' ({self.unit})' if self.unit else ''}"

    @property
    def example(self) -> str:
        """An answer that would do."""
        lowest = -math.inf if self.lowest is None else self.lowest
        highest = math.inf if self.highest is None else self.highest
        if lowest <= 1 <= highest:
            return "1"
        if self.whole:
            return str(math.ceil(lowest) if lowest > 1 else math.floor(highest))
        return written(lowest if lowest > 1 else highest)


def written(number: float) -> str:
    """Return a number as people write it: without an exponent, and with no more digits than it has."""
    digits = format(Decimal(repr(float(number))) + 0, "f")
    return digits.rstrip("0").rstrip(".") if "." in digits else digits


def _lower(words: str) -> str:
    return words[:1].lower() + words[1:]
