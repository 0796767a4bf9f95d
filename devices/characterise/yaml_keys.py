"""Set keys of one mapping inside a YAML text and leave every other character of the text as it is.

The text is edited by the places that PyYAML gives its nodes. A round-trip library would rewrite the whole file, with
numbers, quotes, long lines and columns of its own taste; here what is not set is copied.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence

import yaml

from devices.errors import DeviceError
from documents import Finding, InputError
from documents.yaml.source import parse_yaml

# What YAML takes for the end of a line.
_LINE = re.compile("[^\n\r\x85\u2028\u2029]*(?:\r\n|[\n\r\x85\u2028\u2029]|$)")


def set_keys(
    text: str, path: Sequence[str], blocks: Mapping[str, Sequence[str]], file: str, without: Collection[str] = ()
) -> tuple[str, int]:
    """Return ``text`` with keys of the mapping at ``path`` set, and how many lines with comments had to go for it.

    ``blocks`` has for each key its lines, the key's own first and not indented. A key that is there is replaced where
    it stands, another is added behind the mapping's last; the keys of ``without`` are taken out. What is read from the
    new text differs from what was read before in these keys alone, which is checked before it is returned.

    Raises
    ------
    DeviceError
        If the mapping is written in braces, a key shares its line with something else, an alias refers to what would
        go, or the text is no YAML.
    """
    parse_yaml(text, file)
    mapping = _at(yaml.compose(text, Loader=yaml.SafeLoader), path, file)
    lines = [line for line in _LINE.findall(text) if line]
    ending = "\r\n" if lines and lines[0].endswith("\r\n") else "\n"
    keys = {str(key.value): (key, value) for key, value in mapping.value}
    column = mapping.value[0][0].start_mark.column
    for key, _ in keys.values():
        if lines[key.start_mark.line][: key.start_mark.column].strip(" \ufeff"):
            raise _refusal(f"'{key.value}' shares its line with something else", file, key)

    def block(key: str) -> list[str]:
        return [f"{' ' * column}{line}{ending}" if line else ending for line in blocks[key]]

    behind = max(_end(key, value) for key, value in keys.values())
    edits: list[tuple[int, int, list[str]]] = []
    for name, (key, value) in keys.items():
        if name in blocks or name in without:
            edits.append((key.start_mark.line, _end(key, value), block(name) if name in blocks else []))
    added = [line for name in blocks if name not in keys for line in block(name)]
    edits.append((_past_comments(lines, behind, column), 0, added))
    gone = 0
    for start, end, new in sorted(edits, key=lambda edit: edit[0], reverse=True):
        if start and not lines[start - 1].endswith(("\n", "\r", "\x85", "\u2028", "\u2029")):
            lines[start - 1] += ending
        gone += sum(bool(re.search(r"(^|\s)#", line)) for line in lines[start:end])
        lines[start : max(start, end)] = new
    after = "".join(lines)
    _try(text, after, path, blocks, without, file)
    return after, gone


def _at(node: yaml.Node | None, path: Sequence[str], file: str) -> yaml.MappingNode:
    """Return the mapping at ``path``, written in lines."""
    for step in path:
        inside = node.value if isinstance(node, yaml.MappingNode) else []
        node = next((value for key, value in inside if key.value == step), None)
    if not isinstance(node, yaml.MappingNode) or not node.value:
        raise DeviceError(Finding(f"there is no mapping '{'.'.join(path)}'", file))
    if node.flow_style:
        raise _refusal(f"'{'.'.join(path)}' is written in braces", file, node)
    return node


def _end(key: yaml.Node, value: yaml.Node) -> int:
    """Return the number of the line behind the last that ``key`` and its ``value`` write on.

    An alias's node stands where its anchor does, before the key.
    """
    if isinstance(value, yaml.CollectionNode) and not value.flow_style and value.value:
        last = value.value[-1]
        ends = _end(*last) if isinstance(value, yaml.MappingNode) else _end(value, last)
        return max(ends, key.end_mark.line + 1)
    mark = value.end_mark
    return max(mark.line + (mark.column > 0), key.end_mark.line + 1)


def _past_comments(lines: list[str], behind: int, column: int) -> int:
    """Return ``behind``, or the line behind the comments that follow there as far in as the mapping's keys."""
    while behind < len(lines) and lines[behind].lstrip().startswith("#"):
        if len(lines[behind]) - len(lines[behind].lstrip()) < max(column, 1):
            break
        behind += 1
    return behind


def _try(
    before: str,
    after: str,
    path: Sequence[str],
    blocks: Mapping[str, Sequence[str]],
    without: Collection[str],
    file: str,
) -> None:
    """Refuse ``after`` unless it reads as ``before`` with the keys set and nothing else changed."""
    wanted = parse_yaml(before, file).data
    inner = wanted
    for step in path:
        inner = inner[step]
    for key in without:
        inner.pop(key, None)
    for key, lines in blocks.items():
        inner[key] = parse_yaml("\n".join(lines), file).data[key]
    try:
        changed = parse_yaml(after, file).data
    except InputError as error:
        raise DeviceError(
            Finding("the file cannot be changed as it is laid out; what would go may be used elsewhere in it", file)
        ) from error
    if changed != wanted:
        raise DeviceError(Finding("the file cannot be changed as it is laid out", file, remedy="write a new file"))


def _refusal(message: str, file: str, node: yaml.Node) -> DeviceError:
    mark = node.start_mark
    return DeviceError(
        Finding(message, file, mark.line + 1, mark.column + 1, "write it in lines of its own, or write a new file")
    )
