"""A person with the text of a model in hand, who knows the names of its inputs and nothing else."""

import re
from dataclasses import dataclass

import numpy as np

from ..oracles import by_formula, sigmoid

NUMBER = r"[-+]?\d[\d.]*(?:e[-+]?\d+)?"


@dataclass
class Read:
    """What stands in a text.

    Of every rule its number; pairs (input, term); by output its value, what of it is the common
    line's, and {input: (slope, place)}. The common line by output; terms; the formulas of their
    families; limits of the outputs.
    """

    rules: list
    common: dict
    terms: dict
    formulas: dict
    limits: dict

    def predict(self, row):
        """One row, a dict; outputs in the order of the sentences."""
        firing = [np.prod([self.truth(*asked, row) for asked in rule[1]]) for rule in self.rules]
        values = [[self.value(*said, row) for said in rule[2].items()] for rule in self.rules]
        outputs = np.array(firing) @ values / np.sum(firing)
        limits = [self.limits.get(name, (-np.inf, np.inf)) for name in self.rules[0][2]]
        return np.clip(outputs, *np.transpose(limits))

    def truth(self, name, term, row):
        """How true "name is term" is of a row."""
        if (name, term) in self.terms:
            function, numbers = self.terms[name, term]
            return by_formula(self.formulas[function], row[name], numbers)
        if re.fullmatch("[01]", term):
            return float(row[name] == float(term))
        sign, place, *half = term.replace("± ", "").split()
        away = row[name] - float(place)
        if sign == "near":
            return np.exp(-0.5 * (away / float(half[0])) ** 2)
        away *= 1.0 if sign == ">" else -1.0
        return sigmoid(away * np.log(9.0) / float(half[0])) if half else float(away > 0.0)

    def value(self, output, said, row):
        """What a rule says: its value, less the common line's part, and the lines."""
        value, part, own = said
        common = {k: v for k, v in self.common.get(output, {}).items() if k not in own}
        lines = [*own.items(), *common.items()]
        return value - part + sum(slope * (row[j] - place) for j, (slope, place) in lines)


def read_text(text, names):
    """Read what export_text has written of inputs with these names."""
    # Sentences are wrapped; a paragraph is one line again.
    paragraphs = [part for part in text.split("\n\n") if not part.startswith("Inputs")]
    rules, common = [], {}
    for paragraph in paragraphs:
        joined = re.sub(r"\n(?!  (?:IF|THEN| AND) |Common to)\s*", " ", paragraph)
        if heading := re.match(r"Rule (\d+)[,:]", joined):
            _, premise, *conclusions = joined.split("\n")
            said = dict(_conclusion(line[7:], names) for line in conclusions)
            rules.append((int(heading[1]), _premise(premise[5:]), said))
        for line in re.findall(r"Common to the rules, (.*?)\.(?:\n| Every value|$)", joined):
            output, _, slopes = line.partition(": ")
            common[output] = _slopes(slopes, names)
    joined = " ".join(text.split())
    formulas = dict(re.findall(r"The truth of (\w+) terms is (.*?)\. (?=[A-Z])", joined))
    return Read(rules, common, _terms(text), formulas, _limits(text))


def _premise(text):
    parts = [] if text == "anything" else text.split(" AND ")
    asked = []
    for part in parts:
        name, term, sides = re.fullmatch(r"(.+?) (?:is (.+)|([<>] .+))", part).groups()
        asked += [(name, one) for one in (sides.split(" and ") if sides else [term])]
    return asked


def _conclusion(text, names):
    output, said = text.split(" is ", 1)
    found = re.match(
        rf"(?:about )?({NUMBER})(?:, of it ({NUMBER}) from the common line)?(?:: (.*))?$", said
    )
    value, part, slopes = found.groups()
    return output, (float(value), float(part or 0.0), _slopes(slopes or "", names))


def _slopes(text, names):
    """{input: (slope, place)} of "+5.8 per rooms from 6.3, -2 if new is 1, no change with age"."""
    name = "|".join(map(re.escape, names))
    unchanged = re.findall(rf"no change (?:with ({name})|if ({name}) is [01])(?:, |$)", text)
    found = {one or other: (0.0, 0.0) for one, other in unchanged}
    pattern = rf"({NUMBER}) (?:per ({name}) from ({NUMBER})|if ({name}) is ([01]))(?:, |$)"
    for slope, by, place, column, other in re.findall(pattern, text):
        if by:
            found[by] = float(slope), float(place)
        else:
            # From 0 to 1, or from 1 to 0.
            found[column] = float(slope) * (2.0 * float(other) - 1.0), 1.0 - float(other)
    return found


def _terms(text):
    """{(input, term): (function, {parameter: number})}."""
    terms, name = {}, None
    for line in text.partition("Inputs, as they were trained:\n")[2].splitlines():
        if heading := re.match(r"  (\S.*): \S+ to \S+$", line):
            name = heading[1]
        elif term := re.match(r"    (.+?): +(\w+), (.*)", line):
            numbers = dict(pair.rsplit(" ", 1) for pair in term[3].split(", "))
            terms[name, term[1]] = term[2], {k: float(v) for k, v in numbers.items()}
    return terms


def _limits(text):
    pattern = rf"No prediction leaves these limits: (.+), ({NUMBER}|-inf) to ({NUMBER}|inf)\."
    return {name: (float(low), float(high)) for name, low, high in re.findall(pattern, text)}
