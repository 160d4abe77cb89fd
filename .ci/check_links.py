"""Check the built documentation: every link within it leads somewhere, and no page needs a network.

    python .ci/check_links.py docs/_build/html

Names every link to a page, picture or anchor that is not there, and every script, style or picture
that would be fetched from elsewhere.
"""

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

LOADED = {("script", "src"), ("img", "src"), ("link", "href"), ("iframe", "src")}
# Of <link>, those that a browser follows by itself.
FETCHED = {"stylesheet", "preload", "icon", "shortcut icon"}


class Page(HTMLParser):
    """Anchors and links of one page."""

    def __init__(self, path):
        super().__init__()
        self.anchors, self.links, self.foreign = {""}, set(), set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.anchors |= {given[name] for name in ("id", "name") if given.get(name)}
        for name in ("href", "src"):
            link = given.get(name)
            if not link or link.startswith(("data:", "mailto:", "javascript:")):
                continue
            parts = urlsplit(link)
            if not (parts.scheme or parts.netloc):
                self.links.add((unquote(parts.path), unquote(parts.fragment)))
            elif (tag, name) in LOADED and (tag != "link" or given.get("rel") in FETCHED):
                self.foreign.add(link)


def problems(root):
    """Sentences, one for each link that fails."""
    # The theme's own files, templates among them, are not pages.
    paths = [path for path in sorted(root.rglob("*.html")) if "_static" not in path.parts]
    pages = {path.resolve(): Page(path) for path in paths}
    if not pages:
        yield f"{root} has no pages"
    for path, page in pages.items():
        place = path.relative_to(root.resolve())
        yield from (f"{place}: fetches {link}" for link in sorted(page.foreign))
        for target, anchor in sorted(page.links):
            found = (path.parent / target).resolve() if target else path
            found = found / "index.html" if found.is_dir() else found
            if not found.is_file():
                yield f"{place}: no file {target}"
            elif found in pages and anchor not in pages[found].anchors:
                yield f"{place}: no anchor #{anchor} in {target or place}"


def main():
    found = list(problems(Path(sys.argv[1])))
    print("\n".join(found) or "All links within the documentation lead somewhere.")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
