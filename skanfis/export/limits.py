"""Limits of model files: size, checked before memory is taken, and range of the numbers."""

import os

import numpy as np

# 160 MB: a rule base has rules x terms numbers, consequents rules x (1 + inputs) x outputs.
MOST_NUMBERS = 20_000_000
# A model of 27 rules takes 10 kB: enough for thousands of rules, too little to fill the memory.
MOST_BYTES = 2**24
# Squares of numbers up to this size, and of their ratios, are finite.
LARGEST_NUMBER = 1e50
# Lengths and factors are no smaller, because they are divided by.
SMALLEST_NUMBER = 1e-50
_SHOWN = 60  # characters of a value in a message


def check_size(n_rules, n_terms, n_inputs, n_outputs):
    """Raise ValueError if the model is larger than this reader takes."""
    needed = n_rules * (n_terms + (1 + n_inputs) * n_outputs)
    if needed > MOST_NUMBERS:
        raise ValueError(
            f"{n_rules} rules over {n_terms} terms, {n_inputs} inputs and {n_outputs} outputs are "
            f"{needed:,} numbers; at most {MOST_NUMBERS:,} are read."
        )


def number(value, where, lowest=-LARGEST_NUMBER, highest=LARGEST_NUMBER, kind=float):
    """A number, as from a file; ValueError, with its place, if it is out of range."""
    value = value.item() if isinstance(value, np.generic) else value
    if type(value) not in (int, kind) or not lowest <= value <= highest:
        noun = "number" if kind is float else "whole number"
        ends = f"from {lowest:g} to {highest:g}"
        if lowest == -highest:
            ends = f"of size up to {highest:g}"
        raise ValueError(f"{where}: {shown(value)} is not a {noun} {ends}.")
    return kind(value)


def numbers(values, where, shape):
    """Nested lists of numbers as an array of this shape."""
    if not shape:
        return number(values, where)
    if not isinstance(values, list) or len(values) != shape[0]:
        raise ValueError(f"{where}: {shown(values)} is not a list of {shape[0]}.")
    found = [numbers(value, f"{where}[{k}]", shape[1:]) for k, value in enumerate(values)]
    return np.array(found, dtype=float).reshape(shape)


def shown(value):
    """The value, shortened and safe to print."""
    text = repr(value)
    return text if len(text) <= _SHOWN else text[:_SHOWN] + "..."


def read_bytes(path, most_bytes):
    """The bytes of a file; ValueError, without reading all, if there are over ``most_bytes``."""
    text = os.fsdecode(path)
    if "\n" in text or text.lstrip().startswith("{"):
        raise ValueError(
            "path is the text of a model, not the path of a file: write it to a file first."
        )
    with open(path, "rb") as file:
        data = file.read(most_bytes + 1)
    if len(data) > most_bytes:
        raise ValueError(f"{path} is larger than {most_bytes:,} bytes, the most that is read.")
    return data
