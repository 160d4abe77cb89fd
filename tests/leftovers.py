"""What the tests leave in the folder that holds them; it may be no repository."""

from fnmatch import fnmatch

# Environments, caches and what is built from the sources, by name, wherever they are.
BUILT = [
    *(".git", ".venv*", "__pycache__", "*.pyc", "*_cache", ".cache", ".hypothesis", ".coverage*"),
    *("build", "dist", "*.egg-info"),
]
# Those of the documentation, which may be built at the same time.
DOCUMENTATION = ["docs/_build", "docs/auto_examples", "docs/generated", "docs/sg_*"]


def listing(root):
    """Paths below the folder, but for what is built."""
    found, folders = set(), [root]
    while folders:
        for path in folders.pop().iterdir():
            place = path.relative_to(root).as_posix()
            if any(fnmatch(path.name, name) for name in BUILT) or any(
                fnmatch(place, name) for name in DOCUMENTATION
            ):
                continue
            found.add(place)
            if path.is_dir() and not path.is_symlink():
                folders.append(path)
    return found


def left_behind(before, after):
    """Sentences, one for each path that is there and was not, or the other way round."""
    new = [f"left behind: {place}" for place in sorted(after - before)]
    return new + [f"gone: {place}" for place in sorted(before - after)]
