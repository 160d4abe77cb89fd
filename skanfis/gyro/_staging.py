"""Files that appear all together or not at all: written aside, then given their names."""

import os
import shutil
import tempfile
from pathlib import Path

__all__ = ["Staging"]


class Staging:
    """A context in which files for ``folder`` are written to ``path``, and published at its end.

    What is written to a folder within ``path`` comes into that folder within ``folder``.

    It starts by making both, so that a folder that cannot be written to is found out before there
    is anything to write. Without :meth:`publish` it leaves nothing behind, folders included.
    """

    def __init__(self, folder):
        self._folder = Path(folder)
        self._made: list[Path] = []

    def __enter__(self):
        try:
            self._make(self._folder)
            self.path = Path(tempfile.mkdtemp(prefix=".skanfis-", dir=self._folder))
        except BaseException:
            self._unmake()
            raise
        return self

    def publish(self):
        """Give all files that were written their names, those of older ones included."""
        for path in sorted(path for path in self.path.rglob("*") if path.is_file()):
            target = self._folder / path.relative_to(self.path)
            self._make(target.parent)
            os.replace(path, target)
        self._made = []

    def __exit__(self, *_):
        shutil.rmtree(self.path, ignore_errors=True)
        self._unmake()

    def _make(self, folder):
        if folder.is_dir():
            return
        self._make(folder.parent)
        folder.mkdir()
        self._made.append(folder)

    def _unmake(self):
        for folder in reversed(self._made):
            # Another program may have put something there in the meantime.
            if not any(folder.iterdir()):
                folder.rmdir()
