"""What may stand in a C file: literals, comments, identifiers."""

import re

import numpy as np

__all__ = [
    "LONGEST_NAME",
    "check_file_name",
    "check_name",
    "comment",
    "index_type",
    "literal",
    "literals",
    "loop",
]

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
# C99 tells identifiers apart by 31 characters; the longest suffix of ours takes the rest.
LONGEST_NAME = 31 - len("_SELF_TEST_MAIN")
# A name in a comment stays on its line.
_LONGEST_COMMENT = 60
# Decimal digits that give back the very same float or double.
_DIGITS = {np.dtype(np.float32): 9, np.dtype(np.float64): 17}


def index_type(values):
    """The smallest unsigned type that holds these positions whatever the width of a char is."""
    largest = max(map(int, np.ravel(values)), default=0)
    limits = [(255, "unsigned char"), (65535, "unsigned short")]
    return next((kind for limit, kind in limits if largest <= limit), "unsigned long")


def literal(value):
    """A NumPy floating-point number as a C constant that reads back as the same number."""
    if not np.isfinite(value):
        raise ValueError(f"The model holds {value}, which has no C constant.")
    text = f"{value:.{_DIGITS[value.dtype]}g}"
    if not set(text) & set(".e"):
        text += ".0"
    return text + ("f" if value.dtype == np.float32 else "")


def literals(values, indent=""):
    """Nested braces for an array of numbers of any kind and dimension."""
    if values.ndim == 2 and len(values) == 1:
        return f"{indent}{{ {literals(values[0])} }}"
    if values.ndim > 1:
        inner = ",\n".join(literals(part, indent + "    ") for part in values)
        return f"{indent}{{\n{inner}\n{indent}}}"
    write = literal if values.dtype.kind == "f" else str
    lines, line = [], ""
    for text in map(write, values):
        if line and len(indent) + len(line) + len(text) > 90:
            lines.append(line)
            line = ""
        line += f"{text}, " if line else f" {text}, "
    lines.append(line)
    return f"{indent}{{{f'{chr(10)}{indent} '.join(x.rstrip() for x in lines).rstrip(',')} }}"


def loop(index, count, body, pad="    "):
    """Lines of a loop around those of its body."""
    head = f"{pad}for ({index} = 0; {index} < {count}; ++{index}) {{"
    return [head, *(f"{pad}    {line}" for line in body), f"{pad}}}"]


def comment(text):
    """Any text as something that cannot end a comment, continue a line or make a trigraph."""
    text = str(text)
    shown = text[:_LONGEST_COMMENT]
    safe = re.sub(r"[^ -~]|[*?\\]", lambda found: f"<U+{ord(found[0]):04X}>", shown)
    return safe + ("..." if len(text) > len(shown) else "")


def check_name(name, longest=LONGEST_NAME):
    """The name that all identifiers start with, if C can do with it."""
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
        return name
    raise ValueError(f"name={name!r} {reason}.")


def check_file_name(stem):
    """The last part of the path, which an #include line repeats."""
    if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]*", stem):
        raise ValueError(
            f"path ends in {stem!r}; C can include files of letters, digits, '_', '.' and '-'."
        )
    return stem
