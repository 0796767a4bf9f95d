"""What `mkdocs build` does to the pages of docs/, which stay as they are read in the repository.

The navigation is docs/index.md: its headings, and under each the pages that it links, in their order. Links to files
outside docs/ lead to the repository where pyproject.toml names its address, and are plain text where it does not. A
link to a file that does not exist is a warning, and so an error.
"""

from __future__ import annotations

import logging
import os
import re
import tomllib
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files
    from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[1]
BESIDE = ("CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md")  # pages of the site that lie beside docs/
SEARCH = "assets/iframe-worker.js"
_LINK = re.compile(r"\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)#\s]+)(#[^)\s]*)?\)")
_CODE = re.compile(r"(^```.*?^```|`[^`\n]*`)", re.DOTALL | re.MULTILINE)
_log = logging.getLogger("mkdocs.hooks.docs_site")


def navigation(index: str, decisions: str) -> list[dict[str, Any] | str]:
    """Return the navigation: a section for each heading of ``index`` with the pages linked there, each page once.

    The pages of ``decisions``, the text of decisions/README.md, are a section of their own.
    """
    nav: list[dict[str, Any] | str] = ["index.md"]
    seen = {"index.md"}
    for part in re.split(r"^## ", index, flags=re.MULTILINE)[1:]:
        title, _, text = part.partition("\n")
        links = [PurePosixPath(link).name if link.startswith("../") else link for _, link, _ in _LINK.findall(text)]
        pages = [link for link in dict.fromkeys(links) if link.endswith(".md") and "/" not in link and link not in seen]
        seen |= set(pages)
        if pages:
            nav.append({title.strip(): pages})
    nav.append({"Changes": "CHANGELOG.md"})
    recorded = [f"decisions/{link}" for _, link, _ in _LINK.findall(decisions) if "/" not in link]
    nav.append({"Decisions": ["decisions/README.md", *recorded]})
    return nav


def repository_url(pyproject: str) -> str:
    """Return the address of the repository's files, or nothing where ``pyproject`` does not name it."""
    urls = tomllib.loads(pyproject)["project"].get("urls", {})
    found = next((url for name, url in urls.items() if name.lower() in ("repository", "source", "homepage")), "")
    return f"{found.rstrip('/')}/blob/main/" if found else ""


def relink(text: str, source: Path, url: str) -> str:
    """Return ``text`` of the page ``source`` with its links out of docs/ led to a page of the site, or to ``url``."""

    def led(match: re.Match[str]) -> str:
        words, link, anchor = match.group(1), match.group(2), match.group(3) or ""
        if re.match(r"[a-z]+:", link):
            return match.group(0)
        target = Path(os.path.normpath(source.parent / link))
        if not target.exists():
            _log.warning("%s links %s, which does not exist", source.relative_to(ROOT), link)
        here = source.parent if source.is_relative_to(ROOT / "docs") else ROOT / "docs"
        inside = target if target.is_relative_to(ROOT / "docs") else None
        if target.parent == ROOT and target.name in BESIDE:
            inside = ROOT / "docs" / target.name
        if inside is not None and inside.suffix:
            inside = inside if inside != ROOT / "docs/decisions" else inside / "README.md"
            return f"[{words}]({Path(os.path.relpath(inside, here)).as_posix()}{anchor})"
        if not target.is_relative_to(ROOT):
            _log.warning("%s links %s, which is outside the repository", source.relative_to(ROOT), link)
        return f"[{words}]({url}{target.relative_to(ROOT).as_posix()}{anchor})" if url else words

    parts = _CODE.split(text)
    return "".join(part if number % 2 else _LINK.sub(led, part) for number, part in enumerate(parts))


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Take the navigation from docs/index.md, and name headings as the repository's pages do in their links."""
    from pymdownx.slugs import slugify

    config.mdx_configs["toc"]["slugify"] = slugify(case="lower")
    docs = Path(config.docs_dir)
    config.nav = navigation(*(docs.joinpath(name).read_text("utf-8") for name in ("index.md", "decisions/README.md")))
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that lie beside docs/, and the script that searches pages opened as files."""
    from mkdocs.structure.files import File

    for name in BESIDE:
        files.append(File.generated(config, name, abs_src_path=str(ROOT / name)))
    files.append(File.generated(config, SEARCH, abs_src_path=str(Path(__file__).with_name(Path(SEARCH).name))))
    return files


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """Lead the links of a page that leave docs/, and check that they exist."""
    url = repository_url((ROOT / "pyproject.toml").read_text("utf-8"))
    return relink(markdown, Path(str(page.file.abs_src_path)), url)
