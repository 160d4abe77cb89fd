"""What the functions that write C ask of their arguments; and the two files."""

import re
from numbers import Real
from pathlib import Path

import numpy as np

from ..._validation import check_choice
from .._numbers import rounded_within
from ._dialect import DTYPES, STANDARDS

__all__ = ["LONGEST_NAME", "check_arguments", "read_limits", "write_files"]

# C99 tells identifiers apart by 31 characters; the longest suffix of ours takes the rest.
LONGEST_NAME = 31 - len("_SELF_TEST_MAIN")
# Of C89, C99, C11, C23 and C++: the files may be compiled as any of them.
_KEYWORDS = """
    alignas alignof and and_eq asm auto bitand bitor bool break case catch char class compl concept
    const const_cast consteval constexpr constinit continue co_await co_return co_yield decltype
    default delete do double dynamic_cast else enum explicit export extern false float for friend
    goto if inline int long mutable namespace new noexcept not not_eq nullptr operator or or_eq
    private protected public register reinterpret_cast requires restrict return short signed sizeof
    static static_assert static_cast struct switch template this thread_local throw true try typedef
    typeof typeof_unqual typeid typename union unsigned using virtual void volatile wchar_t while
    xor xor_eq
"""


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
    stem = None if path is None else Path(path).name
    if stem is not None and not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]*", stem):
        raise ValueError(
            f"path ends in {stem!r}; C can include files of letters, digits, '_', '.' and '-'."
        )
    name = stem if name is None else name
    _check_name(name, longest_name)
    return stem or name, name


def _check_name(name, longest):
    if not isinstance(name, str) or not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
        reason = "must be a C identifier: a letter, then letters, digits and underscores"
    elif "__" in name:
        reason = "must not have two underscores in a row, which C++ keeps for itself"
    elif name.lower() in _KEYWORDS.split():
        reason = "is a keyword of C or C++"
    elif len(name) > longest:
        reason = (
            f"has {len(name)} characters; with {longest} or fewer, all identifiers differ "
            f"in the 31 that a C compiler must look at"
        )
    else:
        return
    raise ValueError(f"name={name!r} {reason}.")


def read_limits(saturate, numbers):
    """Limits (n_outputs, 2) in the type of the code, none beyond what is given; or None."""
    if saturate is None:
        return None
    if hasattr(saturate, "lower") and hasattr(saturate, "upper"):
        given = np.stack([saturate.lower, saturate.upper], axis=-1).astype(float)
    else:
        given = np.array(saturate, dtype=float)
    n_outputs = numbers.n_outputs
    if given.shape != (n_outputs, 2):
        raise ValueError(
            f"saturate must have (low, high) for each of the {n_outputs} outputs, or be what "
            f"skanfis.bounds.bounds returns for this model; got an array of shape {given.shape}."
        )
    if not (np.isfinite(given).all() and (given[:, 0] < given[:, 1]).all()):
        raise ValueError(f"saturate={given.tolist()} must be finite, each low below its high.")
    return rounded_within(given.T, numbers.dtype).T


def write_files(code, path):
    """Write a CCode beside each other as .h and .c, or nothing where ``path`` is None."""
    if path is None:
        return
    folder, stem = Path(path).parent, Path(path).name
    (folder / f"{stem}.h").write_text(code.header, encoding="ascii", newline="\n")
    (folder / f"{stem}.c").write_text(code.source, encoding="ascii", newline="\n")
