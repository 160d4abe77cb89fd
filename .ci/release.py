"""What a release writes and asks before it is published; see `make release`.

python .ci/release.py prepare --url https://HOST/OWNER/skanfis [--dry-run]
python .ci/release.py tag
"""

import argparse
import re
import subprocess
import sys
from datetime import date
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
VERSION = re.compile(r'^__version__ = "(.+)"$', re.MULTILINE)


def version():
    return VERSION.search((ROOT / "skanfis/__init__.py").read_text(encoding="utf-8"))[1]


def edits(url, today):
    """File, pattern and what is to stand there, of all that names version, date or address."""
    number = re.escape(version())
    return [
        ("pyproject.toml", r'^url = ".*"$', f'url = "{url}"'),
        ("CHANGELOG.md", rf"^## \[{number}\] - (unreleased|\S+)$", f"## [{version()}] - {today}"),
        ("docs/CITATION.cff", r"^version: .*$", f"version: {version()}"),
        (
            "docs/CITATION.cff",
            r"^license: (\S+)\n(date-released: .*\nrepository-code: .*\n)?",
            rf"license: \1\ndate-released: {today}\nrepository-code: {url}\n",
        ),
    ]


def objections(url):
    """Why there can be no release now."""
    if not re.fullmatch(r"https://[\w.-]+(/[\w.~-]+)+", url):
        yield f"URL={url!r} must be the address of the public repository, https://HOST/OWNER/skanfis"
    if git("status", "--porcelain"):
        yield "there are changes that are not committed"
    if git("tag", "--list", f"v{version()}"):
        yield f"version {version()} is tagged already: raise __version__ in skanfis/__init__.py"


def prepare(url, dry_run):
    url = url.rstrip("/")
    reasons = list(objections(url))
    for name, pattern, replacement in edits(url, date.today().isoformat()):
        text = (ROOT / name).read_text(encoding="utf-8")
        changed, n_found = re.subn(pattern, replacement, text, flags=re.MULTILINE)
        if n_found != 1:
            reasons.append(f"{name} has {n_found} places like {pattern}, not one")
        elif not (dry_run or reasons):
            (ROOT / name).write_text(changed, encoding="utf-8")
    if reasons:
        sys.exit("No release: " + "; ".join(reasons) + ".")


def tag():
    git("commit", "--all", "--message", f"Version {version()}")
    git("tag", "--annotate", f"v{version()}", "--message", f"Version {version()}")
    print(f"Tagged v{version()}; push it with: git push --follow-tags")


def git(*arguments):
    done = subprocess.run(["git", *arguments], cwd=ROOT, check=True, capture_output=True, text=True)
    return done.stdout.strip()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    preparing = commands.add_parser("prepare")
    preparing.add_argument("--url", required=True)
    preparing.add_argument("--dry-run", action="store_true")
    commands.add_parser("tag")
    given = parser.parse_args()
    if given.command == "tag":
        tag()
    else:
        prepare(given.url, given.dry_run)


if __name__ == "__main__":
    main()
