"""What must hold of the pages as built: a hook of MkDocs, whose warnings a strict build fails on.

Every link leads to a page, a file or an anchor that is there; nothing is taken from the network;
the search finds what people look for.
"""

import json
import logging
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from mkdocs.plugins import event_priority

SOUGHT = ["gaussian", "splat", "unity", "three.js", "texture", "torch", "gpu", "tutorial", "tpu"]
SOUGHT += ["multi-gpu", "cluster", "dask", "out of core", "memory"]
_LOG = logging.getLogger("mkdocs.hooks.checks")
# What a browser loads by itself, with the attribute that says from where.
_LOADED = {"img": "src", "script": "src", "iframe": "src", "link": "href", "source": "src"}


class _Page(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: set[str] = set()
        self.loaded: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        has = dict(attrs)
        self.anchors |= {value for name in ("id", "name") if (value := has.get(name))}
        source = has.get(_LOADED.get(tag, ""))
        if source and has.get("rel") != "canonical":
            self.loaded.add(source)
        if tag == "a" and (target := has.get("href")):
            self.links.add(target)


@event_priority(-200)
def on_post_build(config: Any, **_: Any) -> None:
    """Look at all that was written."""
    site = Path(config["site_dir"])
    pages = {path: _read(path) for path in site.rglob("*.html")}
    for path, page in pages.items():
        for target in sorted(page.links | page.loaded):
            problem = _problem(path, target, target in page.loaded, site, pages)
            if problem:
                _LOG.warning("%s: %s %s", path.relative_to(site), target, problem)
    for sheet in site.rglob("*.css"):
        for address in re.findall(r"url\(['\"]?(https?:[^)'\"]+)", sheet.read_text("utf-8")):
            _LOG.warning("%s: %s is on the network", sheet.relative_to(site), address)
    for word in SOUGHT:
        if not found(word, site / "search" / "search_index.json"):
            _LOG.warning("the search does not find %r", word)


def _read(path: Path) -> _Page:
    page = _Page()
    page.feed(path.read_text("utf-8"))
    return page


def _problem(
    path: Path, target: str, loaded: bool, site: Path, pages: dict[Path, _Page]
) -> str | None:
    address = urlsplit(target)
    if address.scheme or address.netloc:
        return "is on the network" if loaded and address.scheme != "data" else None
    if path.name == "404.html" and address.path.startswith("/"):
        return None  # served from the root, wherever the missing page was sought
    there = (path.parent / unquote(address.path)).resolve() if address.path else path
    if there.is_dir():
        there /= "index.html"
    if not there.is_relative_to(site.resolve()) or not there.exists():
        return "leads nowhere"
    if address.fragment and there in pages:
        anchor = unquote(address.fragment)
        if anchor not in pages[there].anchors and not anchor.startswith("__"):
            return "has no such anchor"
    return None


def found(word: str, index: Path) -> list[str]:
    """Titles of the sections in which the search's own terms have all of the word's."""
    stored = json.loads(index.read_text("utf-8"))
    split = re.compile(stored["config"]["separator"])
    sought = set(split.split(word))

    def terms(text: str) -> set[str]:
        plain = re.sub(r"<[^>]+>", " ", text).lower()
        return {term.strip(".,;:!?'`") for term in split.split(plain)}

    return [
        section["title"]
        for section in stored["docs"]
        if all(
            any(term.startswith(part) for term in terms(section["title"] + " " + section["text"]))
            for part in sought
        )
    ]
