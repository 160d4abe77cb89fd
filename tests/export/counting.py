"""What exported functions take at most: compiled as C++ with numbers that count."""

import re
import shutil
import subprocess

import numpy as np
import pytest

from skanfis.export.c.dialect import literals

from .c_compiler import run

needs_cpp = pytest.mark.skipif(shutil.which("g++") is None, reason="no C++ compiler")
# The order in which operations are counted, by their names in a header.
NAMES = ("exponentials", "logarithms", "square roots", "multipl", "divisions")
NUMBERS = re.compile(r"\b(double|float|int_least\d+_t)\b(?!\.h)")

# A number that counts what is done with it: exponentials, logarithms, roots, products, quotients.
COUNTED = """
#include <cmath>
#include <cstdio>
static long done[5];
struct Counted {
    double v;
    Counted(double u = 0.0) : v(u) {}
    explicit operator int() const { return (int)v; }
    Counted operator-() const { return Counted(-v); }
};
static Counted operator+(Counted a, Counted b) { return Counted(a.v + b.v); }
static Counted operator-(Counted a, Counted b) { return Counted(a.v - b.v); }
static Counted operator*(Counted a, Counted b) { ++done[3]; return Counted(a.v * b.v); }
static Counted operator/(Counted a, Counted b) { ++done[4]; return Counted(a.v / b.v); }
static Counted &operator+=(Counted &a, Counted b) { return a = a + b; }
static Counted &operator-=(Counted &a, Counted b) { return a = a - b; }
static Counted &operator*=(Counted &a, Counted b) { return a = a * b; }
static Counted &operator/=(Counted &a, Counted b) { return a = a / b; }
static bool operator==(Counted a, Counted b) { return a.v == b.v; }
static bool operator<(Counted a, Counted b) { return a.v < b.v; }
static bool operator>(Counted a, Counted b) { return a.v > b.v; }
static bool operator<=(Counted a, Counted b) { return a.v <= b.v; }
static bool operator>=(Counted a, Counted b) { return a.v >= b.v; }
static Counted exp(Counted a) { ++done[0]; return Counted(std::exp(a.v)); }
static Counted log(Counted a) { ++done[1]; return Counted(std::log(a.v)); }
static Counted asin(Counted a) { return Counted(std::asin(a.v)); }
static Counted sqrt(Counted a) { ++done[2]; return Counted(std::sqrt(a.v)); }
"""
COUNTING = """
static const double rows_$name[$n][$d] = $rows;
static void count_$name() {
    long most[5] = {0};
    for (int r = 0; r < $n; ++r) {
        Counted x[$d], y[9];
        for (int i = 0; i < $d; ++i) x[i] = rows_$name[r][i];
        for (int k = 0; k < 5; ++k) done[k] = 0;
        $name_predict(x, y);
        for (int k = 0; k < 5; ++k) if (done[k] > most[k]) most[k] = done[k];
    }
    for (int k = 0; k < 5; ++k) std::printf("%ld ", most[k]);
}
"""


def most_operations(codes, X, folder):
    """The most that a row of X takes, and what the header says, (n_codes, 5) each."""
    text, calls = COUNTED, ""
    for code in codes:
        source = code.header + code.source.partition("\n")[2]
        text += NUMBERS.sub("Counted", source)
        words = {"name": code.name, "n": len(X), "d": X.shape[1], "rows": literals(X)}
        for word, value in words.items():
            text += "" if word != "name" else COUNTING
            text = text.replace(f"${word}", str(value))
        calls += f"count_{code.name}();"
    (folder / "count.cpp").write_text(f"{text}int main() {{ {calls} }}\n", encoding="ascii")
    command = ["g++", "-std=c++11", "-O0", "count.cpp", "-o", "count"]
    subprocess.run(command, cwd=folder, check=True)
    taken = [int(number) for number in run(["./count"], folder).stdout.split()]
    return np.reshape(taken, (-1, 5)), np.array([said(code.header) for code in codes])


def said(header):
    """Operations at most, as the header tells them; none where it does not."""
    told = re.search(r"Whatever the inputs: at most (.*?)\.", header.replace("\n *", ""))[1]
    found = [re.search(rf"(\d+) {name}", told) for name in NAMES]
    return [int(each[1]) if each else 0 for each in found]
