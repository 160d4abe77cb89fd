"""What the functions that write C ask of their arguments, and the two files."""

from numbers import Real
from pathlib import Path

from ..._validation import check_choice
from ._dialect import DTYPES, STANDARDS
from ._text import LONGEST_NAME, check_file_name, check_name

__all__ = ["check_arguments", "write_files"]


def check_arguments(path, name, dtype, std, min_coverage, longest_name=LONGEST_NAME):
    """The name of the files, without a suffix, and what identifiers start with."""
    check_choice("dtype", dtype, DTYPES)
    check_choice("std", std, STANDARDS)
    if min_coverage is not None and not (
        isinstance(min_coverage, Real) and 0.0 < float(min_coverage) <= 1.0
    ):
        raise ValueError(
            f"min_coverage={min_coverage!r} must be a number above 0 and at most 1, or None."
        )
    if name is None and path is None:
        raise ValueError("name=None takes the name from path, and path is None too: give either.")
    stem = check_file_name(Path(path).name) if path is not None else None
    name = check_name(stem if name is None else name, longest_name)
    return stem or name, name


def write_files(code, path):
    """Write a CCode beside each other as .h and .c, or nothing where ``path`` is None."""
    if path is None:
        return
    folder, stem = Path(path).parent, Path(path).name
    (folder / f"{stem}.h").write_text(code.header, encoding="ascii", newline="\n")
    (folder / f"{stem}.c").write_text(code.source, encoding="ascii", newline="\n")
