"""Put a built documentation beside those of other versions, and list them for the menu.

python .ci/publish_docs.py docs/_build/html PAGES https://OWNER.github.io/skanfis
"""

import json
import shutil
import sys
from pathlib import Path

from release import version


def publish(built, pages, url):
    """Copy the pages into PAGES/VERSION, and write versions.json and the page that leads there."""
    shutil.rmtree(pages / version(), ignore_errors=True)
    shutil.copytree(built, pages / version())
    found = [path.name for path in pages.iterdir() if (path / "index.html").is_file()]
    newest_first = sorted(found, key=lambda name: [int(n) for n in name.split(".")], reverse=True)
    versions = [{"version": name, "url": f"{url}/{name}/"} for name in newest_first]
    versions[0] |= {"name": f"{newest_first[0]} (stable)", "preferred": True}
    (pages / "versions.json").write_text(json.dumps(versions, indent=1), encoding="utf-8")
    page = f'<meta http-equiv="refresh" content="0; url={newest_first[0]}/">\n'
    (pages / "index.html").write_text(page, encoding="utf-8")
    (pages / ".nojekyll").touch()


if __name__ == "__main__":
    publish(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3].rstrip("/"))
