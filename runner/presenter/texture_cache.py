"""A cache that releases what was used longest ago once it holds more than its budget of bytes."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Collection, Hashable, Iterator
from typing import Generic, Protocol, TypeVar


class Held(Protocol):
    """Something on the graphics card that knows its size and can be released."""

    @property
    def size_bytes(self) -> int:
        """Bytes held."""

    def release(self) -> None:
        """Free them."""


K = TypeVar("K", bound=Hashable)
V = TypeVar("V", bound=Held)


class LruCache(Generic[K, V]):
    """Values by key, at most ``budget_bytes`` of them beside those that a caller asks to keep."""

    def __init__(self, budget_bytes: int, evicted: Callable[[], None] = lambda: None) -> None:
        self._budget_bytes = budget_bytes
        self._evicted = evicted
        self._values: OrderedDict[K, V] = OrderedDict()
        self.size_bytes = 0

    def __len__(self) -> int:
        return len(self._values)

    def __iter__(self) -> Iterator[K]:
        return iter(self._values)

    def get(self, key: K, make: Callable[[], V]) -> V:
        """Return the value of ``key``, made if it is not held, and mark it as just used."""
        if key not in self._values:
            value = make()
            self._values[key] = value
            self.size_bytes += value.size_bytes
        self._values.move_to_end(key)
        return self._values[key]

    def trim(self, keep: Collection[K]) -> None:
        """Release the values used longest ago, except ``keep``, until the budget holds."""
        for key in [key for key in self._values if key not in keep]:
            if self.size_bytes <= self._budget_bytes:
                return
            value = self._values.pop(key)
            self.size_bytes -= value.size_bytes
            value.release()
            self._evicted()

    def clear(self) -> None:
        """Release everything."""
        for value in self._values.values():
            value.release()
        self._values.clear()
        self.size_bytes = 0
