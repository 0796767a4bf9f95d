#!/usr/bin/env python3
"""Write the pages of docs/ that are made from the program: what Python can call, keys, options, records of a log.

docs/api.md has every public name with its signature and what its docstring says; the others are of
`tools.reference_pages`.

python tools/api_page.py           write the pages
python tools/api_page.py --check   exit with 1 if one is not what would be written
"""

from __future__ import annotations

import ast
import inspect
import re
import sys
import textwrap
from importlib import import_module
from pathlib import Path

from pydantic import BaseModel

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))
PACKAGES = ("cyclopean", "runner", "analysis", "stimuli", "devices", "documents")
_HEAD = """# What Python can call

Made from the docstrings by `make api`. Begin with `cyclopean`; what it returns keeps the full result of the other
packages as `value`. Every name can be imported from the package that it stands under.
"""


def public_names(package: str) -> list[str]:
    """Return the names that the face of ``package`` offers, in its own order."""
    stub = ROOT / package / "__init__.pyi"
    names = []
    for node in ast.parse(stub.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom) and node.level == 1:
            names += [alias.asname or alias.name for alias in node.names]
    return names


def markdown(docstring: str) -> str:
    """Return a NumPy docstring as Markdown: sections in bold, parameters as a list, examples as code."""
    lines = inspect.cleandoc(docstring).splitlines()
    out: list[str] = []
    section, number = "", 0
    while number < len(lines):
        line = lines[number]
        below = lines[number + 1] if number + 1 < len(lines) else ""
        if line and re.fullmatch(r"-{3,}", below):
            section = line
            out += ["", f"**{section}**", ""]
            number += 2
            continue
        if section in ("Parameters", "Attributes", "Returns", "Raises", "Yields") and line and not line.startswith(" "):
            text = []
            while number + 1 < len(lines) and (lines[number + 1].startswith("    ") or not lines[number + 1]):
                number += 1
                text.append(lines[number].strip())
            body = " ".join(part for part in text if part)
            out.append(f"- `{line}`: {body}" if body else f"- {line}")
        elif section == "Examples" and (line.startswith((">>>", "...")) or (line and out[-1:] != [""])):
            code = []
            while number < len(lines) and (
                lines[number] or (number + 1 < len(lines) and lines[number + 1][:3] == ">>>")
            ):
                code.append(lines[number])
                number += 1
            out += ["```pycon", *code, "```"]
        else:
            out.append(line)
        number += 1
    text = re.sub(r"(?<!`)``(?!`)", "`", "\n".join(out))
    return re.sub(r"\n{3,}", "\n\n", text).strip()


def signature(thing: object) -> str:
    """Return how a function or class is called, as it is written; empty for what cannot be called."""
    if inspect.isfunction(thing):
        node = ast.parse(textwrap.dedent(inspect.getsource(thing))).body[0]
        assert isinstance(node, ast.FunctionDef)
        result = f" -> {ast.unparse(node.returns)}" if node.returns else ""
        return f"{node.name}({ast.unparse(node.args)}){result}"
    if not inspect.isclass(thing) or issubclass(thing, BaseModel):
        return ""
    try:
        parameters = inspect.signature(thing).parameters.values()
    except ValueError:
        return ""
    return f"{thing.__name__}({', '.join(_written(one) for one in parameters)})"


def _written(parameter: inspect.Parameter) -> str:
    """Return a parameter of a class as its source has it; a default that is no plain value is ``...``."""
    default, annotation = parameter.default, parameter.annotation
    text = parameter.name
    if annotation is not inspect.Parameter.empty:
        text += f": {annotation if isinstance(annotation, str) else inspect.formatannotation(annotation)}"
    if default is inspect.Parameter.empty:
        return text
    if isinstance(default, Path):
        return f"{text} = Path({str(default)!r})"
    return f"{text} = {default!r}" if isinstance(default, str | int | float | None | tuple) else f"{text} = ..."


def entry(package: str, name: str) -> str:
    """Return what the page says of one name."""
    thing = getattr(import_module(package), name)
    called = signature(thing)
    code = f"```text\n{called}\n```\n\n" if called else ""
    return f"### {package}.{name}\n\n" + code + markdown(inspect.getdoc(thing) or "")


def page() -> str:
    """Return the whole page."""
    parts = [_HEAD]
    for package in PACKAGES:
        about = inspect.cleandoc(import_module(package).__doc__ or "").split("\n\n")[0]
        parts.append(f"## {package}\n\n{about}\n")
        parts += [entry(package, name) + "\n" for name in public_names(package)]
    return "\n".join(parts)


def main() -> None:
    """Write the pages, or compare them."""
    from tools.reference_pages import keys_page, options_page, records_page

    pages = {"api": page, "keys": keys_page, "options": options_page, "log_records": records_page}
    for name, made in pages.items():
        file = ROOT / "docs" / f"{name}.md"
        if "--check" not in sys.argv:
            file.write_text(made(), encoding="utf-8")
        elif not file.is_file() or file.read_text(encoding="utf-8") != made():
            sys.exit(f"docs/{name}.md is not what the program says: make api")


if __name__ == "__main__":
    main()
