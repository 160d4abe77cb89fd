"""What the command says, and files that it writes all together or not at all."""

import os
import sys
import tempfile
import time
from contextlib import contextmanager, suppress
from pathlib import Path

from ..inspection.labels import printable
from .errors import ExistsError, LogError, UsageError

__all__ = ["Progress", "refuse_existing", "say", "say_error", "staged", "usage_errors"]


@contextmanager
def usage_errors():
    """Let what is wrong with options be a UsageError; what is wrong with a log stays a LogError."""
    try:
        yield
    except (LogError, UsageError):
        raise
    except ValueError as error:
        raise UsageError(str(error)) from error


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
    """An error in one sentence, to stderr; returns the exit code."""
    told = str(error) or type(error).__name__
    if isinstance(error, OSError) and error.filename is not None and error.strerror is not None:
        told = f"{error.filename}: {error.strerror}."
    _write_to(sys.stderr, f"{program}: {printable(told)}\n")
    return code


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
            for path in sorted(Path(name).iterdir()):
                os.replace(path, folder / path.name)
    except BaseException:
        for path in made:
            with suppress(OSError):  # another program has put something there
                path.rmdir()
        raise
