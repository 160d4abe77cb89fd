"""Simple functions that replace a compensator, each with a proven bound of its difference."""
