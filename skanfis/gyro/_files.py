"""Which files an argument of the command names: a file, a folder, a pattern; no log twice."""

import glob
import hashlib
import os
import re
from pathlib import Path

from .errors import LogError

__all__ = ["check_different", "find_logs"]

# Of a folder: tables first; what may as well be a note only where there is no table.
_SUFFIXES = ((".csv", ".tsv", ".parquet", ".pq"), (".txt", ".dat", ".log"))
# Bytes read at once for a hash.
_BLOCK = 2**20


def find_logs(arguments):
    """The files that are named, folders and patterns filled in; those of each in natural order.

    A name that is no pattern stays as it is, whether there is such a file or not.
    """
    found: list[str] = []
    for argument in arguments:
        if os.path.isdir(argument):
            found += _logs_in(argument)
        elif glob.has_magic(argument) and not os.path.lexists(argument):
            matches = [path for path in glob.glob(argument, recursive=True) if os.path.isfile(path)]
            if not matches:
                raise LogError(f"{argument}: no file matches this pattern.")
            found += sorted(matches, key=_natural)
        else:
            found.append(argument)
    return found


def _logs_in(folder):
    names = [name for name in os.listdir(folder) if not name.startswith(".")]
    for suffixes in _SUFFIXES:
        paths = [os.path.join(folder, name) for name in names if name.lower().endswith(suffixes)]
        paths = [path for path in paths if os.path.isfile(path)]
        if paths:
            return sorted(paths, key=_natural)
    known = ", ".join(suffix for suffixes in _SUFFIXES for suffix in suffixes)
    raise LogError(f"{folder}: is a folder without logs ({known}).")


def _natural(path):
    """A key by which run2 comes before run10."""
    return [
        (0, int(part), "") if part.isdecimal() else (1, 0, part)
        for part in re.split(r"([0-9]{1,15})", path)
    ]


def check_different(paths):
    """LogError where one log is there twice: as two runs, each would be tested by the other."""
    by_file: dict = {}
    by_size: dict = {}
    for path in paths:
        try:
            status = os.stat(path)
        except OSError:
            continue  # said when it is read
        key = status.st_dev, status.st_ino
        if status.st_ino and key in by_file:
            raise LogError(f"{path}: is the same file as {by_file[key]}; name every log once.")
        by_file[key] = path
        if Path(path).is_file() and status.st_size:
            by_size.setdefault(status.st_size, []).append(path)
    for alike in by_size.values():
        _check_contents(alike if len(alike) > 1 else [])


def _check_contents(paths):
    seen: dict = {}
    for path in paths:
        digest = hashlib.sha256()
        with open(path, "rb") as file:
            while block := file.read(_BLOCK):
                digest.update(block)
        other = seen.setdefault(digest.digest(), path)
        if other is not path:
            raise LogError(
                f"{path}: holds the same bytes as {other}; a run that is there twice would be "
                "tested by itself. Leave one of them out."
            )
