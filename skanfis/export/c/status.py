"""The status word of generated C, and of Python that flags rows as it does."""

STATUS = {"IN_RANGE": 0, "OUT_OF_RANGE": 1, "NOT_FINITE": 2, "UNCOVERED": 4, "NO_OUTPUT": 8}

_MEANING = {
    "OUT_OF_RANGE": "an input lies outside the range of the training data",
    "NOT_FINITE": "an input is infinite or not a number",
    "UNCOVERED": "hardly any training data lie near the inputs",
    "NO_OUTPUT": "y holds no answer",
}


def status_lines() -> str:
    """Macros of a header, one for each bit; ``$NAME`` is the prefix."""
    return "\n".join(
        f"#define $NAME_{name} {bit}" + (f" /* {_MEANING[name]} */" if bit else "")
        for name, bit in STATUS.items()
    )
