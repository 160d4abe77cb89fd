"""Data sets: a printed table of a real gyro, simulated gyros, and the benchmarks of Jang 1993."""

from ._ofog import make_ofog
from ._published import load_ofog, make_jang_sinc, make_jang_three_input, make_mackey_glass

__all__ = ["load_ofog", "make_jang_sinc", "make_jang_three_input", "make_mackey_glass", "make_ofog"]
