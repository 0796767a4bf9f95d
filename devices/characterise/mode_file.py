"""Modes of a display file written, added and updated; whatever is not set stays, character for character.

The text is edited by the places that PyYAML gives its nodes. A round-trip library would rewrite the whole file, with
numbers, quotes, long lines and columns of its own taste; here what is not set is copied.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from devices.display.display_file import EYES, read_display
from devices.display.panel import PanelSpec
from devices.errors import DeviceError
from documents import Finding, InputError
from documents.files import read_regular, whole_file, writing
from documents.yaml import YamlSource, parse_yaml, read_yaml, yaml_text

CHARACTERISATION = (
    "black_XYZ_cd_m2",
    "primaries_XYZ_cd_m2",
    "curve",
    "observer",
    "source",
    "gamma_table",
    "ambient_XYZ_cd_m2",
)
_MOST_BYTES = 1_000_000
_AMBIENT = "ambient_XYZ_cd_m2"
_PARTS = {
    "crosstalk": "crosstalk",
    "gain_map": "a gain map",
    "monitor_settings": "settings of the monitor",
    _AMBIENT: "the room's light",
}
# What YAML takes for the end of a line.
_LINE = re.compile("[^\n\r\x85\u2028\u2029]*(?:\r\n|[\n\r\x85\u2028\u2029]|$)")


@dataclass(frozen=True, slots=True)
class ModeLines:
    """What is to be written of one mode, as lines of YAML that are not indented.

    ``models``: the lines of a model for ``both``, or for ``left``, ``right`` or the two; none to write parts alone.
    ``parts``: the lines of ``crosstalk``, ``gain_map`` and ``monitor_settings``, their keys first; the room's light is
    one where no model is written, because a model has it.
    """

    models: Mapping[str, Sequence[str]]
    parts: Mapping[str, Sequence[str]]

    def keys(self) -> dict[str, list[str]]:
        """Return the lines of each key of the mode, the key first."""
        keys: dict[str, list[str]] = {}
        for eye, lines in self.models.items():
            keys |= _by_key(lines) if eye == "both" else {eye: [f"{eye}:", *_indented(lines)]}
        return keys | {part: list(lines) for part, lines in self.parts.items()}

    def block(self, mode: str) -> list[str]:
        """Return the lines of the whole mode."""
        return [f"{yaml_text(mode)}:", *_indented([line for lines in self.keys().values() for line in lines])]


def write_mode(path: Path, mode: str, new: ModeLines, panel: PanelSpec | None = None, *, replace: bool = False) -> str:
    """Write ``new`` into ``mode`` of the display file at ``path``; return in sentences what was done.

    A file that is not there is made, and needs the ``panel``. In one that is there the mode is added, or its keys that
    are new are set; the panel, all other modes and keys, and their comments stay. What would have to go is only
    overwritten with ``replace``. The file is read back before it is put in place, in one step.

    Raises
    ------
    DeviceError
        If the panel is missing, or not that of the file; if something would be overwritten; if parts alone are to go
        to a mode that has no characterisation of its own; if the file cannot be changed as it is laid out, or would not
        be a display file.
    """
    if not path.exists():
        if panel is None or not new.models:
            raise DeviceError(
                Finding(
                    "there is no such display file yet", str(path), remedy="a new one needs --panel 1920x1080,0.2768"
                )
            )
        head = ["schema_version: 1", panel.line, "modes:"]
        _put(path, "\n".join([*head, *_indented(new.block(mode))]) + "\n")
        return " ".join([f"wrote {path} with the mode '{mode}'.", *_follows(path, mode)])
    source = read_yaml(path)
    if panel is not None and panel != read_display(path).panel:
        raise _refusal("the file is of another panel", source, "panel", remedy="leave --panel out, or write a new file")
    text = read_regular(path, _MOST_BYTES).decode("utf-8")
    there = source.data["modes"].get(mode) if isinstance(source.data.get("modes"), dict) else None
    if there is None:
        if not new.models:
            remedy = "characterise it first, or name another with --mode"
            raise _refusal(f"there is no mode '{mode}' to add to", source, "modes", remedy=remedy)
        # A file of a nominal display has no modes before the first is measured.
        where = ("modes",) if source.data.get("modes") else ()
        lines = {mode: new.block(mode)} if where else {"modes": ["modes:", *_indented(new.block(mode))]}
        after, _ = set_keys(text, where, lines, str(path))
        _put(path, after)
        return " ".join([f"added the mode '{mode}' to {path}; all else in it stays.", *_follows(path, mode)])
    if "same_as" in there and not new.models:
        remedy = f"write into '{there['same_as']}'"
        raise _refusal(f"the mode '{mode}' is the same as another", source, "modes", mode, remedy=remedy)
    if _AMBIENT in new.parts and {"left", "right"} & set(there):
        remedy = "write the line that is printed into left: and right:, as each lens has it"
        raise _refusal(f"the mode '{mode}' is characterised per eye", source, "modes", mode, remedy=remedy)
    same = {part for part, lines in new.parts.items() if _part(part, lines) == there.get(part)}
    new = ModeLines(new.models, {part: lines for part, lines in new.parts.items() if part not in same})
    goes = _goes(there, new)
    if goes and not replace:
        what = f"the mode '{mode}' holds {' and '.join(goes)} already, which would go"
        remedy = "give --replace to overwrite it, another --mode, or a new file"
        raise _refusal(what, source, "modes", mode, remedy=remedy)
    without: list[str] = []
    if "same_as" in there:
        after, comments = set_keys(text, ("modes",), {mode: new.block(mode)}, str(path))
    else:
        odd = CHARACTERISATION if "both" not in new.models else EYES
        without = [key for key in odd if key in there and new.models]
        # A table of the measurement before says nothing of this one.
        keys = new.keys()
        without += [key for key in ("gamma_table",) if key in there and "both" in new.models and key not in keys]
        after, comments = set_keys(text, ("modes", mode), keys, str(path), without)
    _put(path, after)
    sentences = [f"updated the mode '{mode}' of {path}; all else in it stays."]
    sentences += [f"Overwritten: {', '.join(goes)}."] if goes else []
    sentences += [f"Lines with a comment that went with it: {comments}."] if comments else []
    sentences += [f"There already, and the same: {', '.join(sorted(same))}."] if same else []
    kept = [part for part in _PARTS if part in there and part not in (*new.keys(), *without, *same)]
    sentences += [f"What was measured before stays: {', '.join(kept)}."] if kept and new.models else []
    return " ".join([*sentences, *_follows(path, mode)])


def _part(part: str, lines: Sequence[str]) -> Any:
    """Return what ``lines`` of a part say."""
    return parse_yaml("\n".join(lines), part).data[part]


def _goes(there: Mapping[str, Any], new: ModeLines) -> list[str]:
    """Return in words what of the mode ``there`` would be overwritten."""
    goes = [words for part, words in _PARTS.items() if part in there and part in new.parts]
    if not new.models:
        return goes
    if "same_as" in there:
        return [*goes, f"'same_as: {there['same_as']}'"]
    if not {"left", "right"} & set(there):
        return [*goes, "a characterisation for both eyes"]
    eyes = [eye for eye in EYES if eye in there and ("both" in new.models or eye in new.models)]
    return [*goes, *(f"a characterisation of the {eye} eye" for eye in eyes)]


def _follows(path: Path, mode: str) -> list[str]:
    """Return what the file says now of ``mode``: an eye that lacks, modes that are the same."""
    display = read_display(path)
    sentences = []
    if mode in display.lacking:
        sentences.append(f"It cannot be used before its {' and '.join(display.lacking[mode])} eye is there too.")
    modes = read_yaml(path).data["modes"]
    same = [name for name, held in modes.items() if held.get("same_as") == mode]
    return [*sentences, *([f"The same as it: {', '.join(same)}."] if same else [])]


def _put(path: Path, text: str) -> None:
    """Put ``text`` in place of the file, whole or not at all, if it reads as a display file."""
    target = path.resolve()  # a link stays one
    with writing(path, "display file", DeviceError), whole_file(target, make_folder=False) as draft:
        draft.write_bytes(text.encode("utf-8"))
        if target.exists():
            shutil.copymode(target, draft)
        try:
            read_display(draft)
        except InputError as error:
            wrong = [Finding(f"the file would not be right: {f.message}", str(path)) for f in error.findings]
            raise DeviceError(wrong) from error


def _refusal(message: str, source: YamlSource, *key: str, remedy: str) -> DeviceError:
    return DeviceError(source.finding(key, message, remedy, key=True))


def _by_key(lines: Sequence[str]) -> dict[str, list[str]]:
    """Return the lines of a mapping apart, by key."""
    keys: dict[str, list[str]] = {}
    for line in lines:
        if not line.startswith(" "):
            keys[line.partition(":")[0]] = []
        keys[next(reversed(keys))].append(line)
    return keys


def _indented(lines: Sequence[str]) -> list[str]:
    return [f"  {line}" if line else line for line in lines]


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
            raise _layout_refusal(f"'{key.value}' shares its line with something else", file, key)

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
        raise _layout_refusal(f"'{'.'.join(path)}' is written in braces", file, node)
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


def _layout_refusal(message: str, file: str, node: yaml.Node) -> DeviceError:
    mark = node.start_mark
    return DeviceError(
        Finding(message, file, mark.line + 1, mark.column + 1, "write it in lines of its own, or write a new file")
    )
