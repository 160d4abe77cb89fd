"""A .fis file written by hand, and ways to spoil it."""

import re

# Rule 1 looks at both inputs, rule 2 at the second alone; low and high of "x y" have two families.
BY_HAND = """\
% A comment, as MATLAB writes them
[System]
Name='by hand'
Type='sugeno'
Version=2.0
NumInputs=2
NumOutputs=2
NumRules=3
AndMethod='prod'
OrMethod='probor'
ImpMethod='prod'
AggMethod='sum'
DefuzzMethod='wtaver'

[Input1]
Name='x y'
Range=[0 10]
NumMFs=2
MF1='low':'trimf',[0 0 8]
MF2 = 'high' : 'gaussmf', [2.5 1e1]

[Input2]
Name='z'
Range=[-1, +1.0]
NumMFs=1
MF1='about zero':'gbellmf',[.5 2 0]

[Output1]
Name='u'
Range=[0 1]
NumMFs=2
MF1='flat':'constant',[3]
MF2='sloped':'linear',[1 -2 0.5]

# Another comment
[Output2]
Name='v'
Range=[0 1]
NumMFs=3
MF1='a':'constant',[1]
MF2='b':'constant',[2]
MF3='c':'constant',[4]

[Rules]
1 1, 2 1 (1) : 1
0 1, 1 2 (1) : 1
2 0, 2 3 (1.0) : 2
"""


def with_line(old, new):
    """BY_HAND with the line that begins with ``old`` replaced by ``new``, and its number."""
    found = re.search(rf"^{re.escape(old)}.*$", BY_HAND, re.MULTILINE)
    text = BY_HAND[: found.start()] + new + BY_HAND[found.end() :]
    return text, 1 + BY_HAND.count("\n", 0, found.start())
