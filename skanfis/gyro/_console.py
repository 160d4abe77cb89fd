"""What the command says, and files that it writes all together or not at all."""

import os
import sys
import tempfile
import time
from contextlib import contextmanager, suppress
from pathlib import Path

from ..inspection.labels import printable
from .errors import LogError

__all__ = [
    "ExistsError",
    "Progress",
    "UsageError",
    "refuse_existing",
    "say",
    "say_error",
    "staged",
    "usage_errors",
]


class UsageError(ValueError):
    """Options that make no sense."""


@contextmanager
def usage_errors():
    """Let what is wrong with options be a UsageError; what is wrong with a log stays a LogError."""
    try:
        yield
    except (LogError, UsageError):
        raise
    except ValueError as error:
        raise UsageError(str(error)) from error


class ExistsError(Exception):
    """A file that would be replaced."""


class Progress:
    """Lines on stderr, with the time since the start."""

    def __init__(self, quiet):
        self._quiet = quiet
        self._start = time.monotonic()

    def __call__(self, text):
        if not self._quiet:
            seconds = time.monotonic() - self._start
            _write_to(sys.stderr, f"{seconds:7.1f} s  {printable(text)}\n")
            sys.stderr.flush()


def say(lines):
    """Lines of the summary, to stdout."""
    for line in lines:
        _write_to(sys.stdout, f"{printable(line)}\n")


def say_error(program, error, code):
    """An error, to stderr; returns the exit code."""
    _write_to(sys.stderr, f"{program}: {printable(told(error))}\n")
    return code


def told(error):
    """An error in one sentence."""
    if isinstance(error, LogError) or not isinstance(error, OSError):
        return str(error) or type(error).__name__
    if error.filename is None or error.strerror is None:
        return str(error)
    return f"{error.filename}: {error.strerror}."


def _write_to(stream, text):
    """Text to a stream, with escapes for what its encoding lacks."""
    encoding = getattr(stream, "encoding", None) or "utf-8"
    stream.write(text.encode(encoding, "backslashreplace").decode(encoding))


def refuse_existing(paths, force):
    """ExistsError where a file is there already, or a folder in its place."""
    for path in paths:
        if path.is_dir():
            raise ExistsError(f"{path} is a folder: choose another --output.")
        if path.exists() and not force:
            raise ExistsError(f"{path} exists already: choose another --output, or --force.")


@contextmanager
def staged(folder):
    """A folder to write to; at the end its files go to ``folder`` all together.

    Where that cannot be, or an error ends it, no file or folder is left behind.
    """
    made = [path for path in (folder, *folder.parents) if not path.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".skanfis-", dir=folder) as name:
            yield Path(name)
            for path in sorted(path for path in Path(name).rglob("*") if path.is_file()):
                target = folder / path.relative_to(name)
                target.parent.mkdir(exist_ok=True)
                os.replace(path, target)
    except BaseException:
        for path in made:
            with suppress(OSError):  # another program has put something there
                path.rmdir()
        raise
