"""Names every link of a finished site that leads nowhere: python docs/site/links.py SITE.

A link leads to a file below SITE, and to an anchor of that file. Links to other sites are not followed.
"""

from __future__ import annotations

import posixpath
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote


class Page(HTMLParser):
    """Links of a page, and its targets of links."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: set[str] = set()
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        for name, value in attributes:
            if value is not None and name in ("href", "src"):
                self.links.add(value)
            elif value is not None and name in ("id", "name"):
                self.anchors.add(value)

    handle_startendtag = handle_starttag


def is_elsewhere(link: str) -> bool:
    # rustdoc asks for the implementations in other crates also where there are none.
    return "://" in link or link.startswith(("data:", "javascript:")) or "trait.impl/" in link


def leads_somewhere(origin: str, link: str, files: set[str], pages: dict[str, Page]) -> bool:
    file, _, fragment = link.partition("#")
    file = unquote(file.partition("?")[0])
    found = posixpath.normpath(posixpath.join(posixpath.dirname(origin), file)) if file else origin
    if found not in files:
        found = posixpath.normpath(posixpath.join(found, "index.html"))
    if found not in files:
        return False
    if found not in pages or not fragment:
        return True
    # Lines of a source file are numbers, or two of them.
    return not pages[found].anchors.isdisjoint({fragment, unquote(fragment), fragment.partition("-")[0]})


def main(arguments: list[str]) -> int:
    if len(arguments) != 1:
        print("usage: links.py SITE", file=sys.stderr)
        return 2
    site = Path(arguments[0])
    files = {path.relative_to(site).as_posix() for path in site.rglob("*") if path.is_file()}
    pages = {name: Page((site / name).read_text(encoding="utf-8")) for name in sorted(files) if name.endswith(".html")}
    links = [(name, link) for name, page in pages.items() for link in sorted(page.links) if not is_elsewhere(link)]
    wrong = [f"{name}: {link}" for name, link in links if not leads_somewhere(name, link, files, pages)]
    if wrong or not pages:
        print("\n".join(["links that lead nowhere:", *wrong]) if wrong else f"{site}: no pages", file=sys.stderr)
        return 1
    print(f"{len(pages)} pages, {len(links)} links, each leads somewhere")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
