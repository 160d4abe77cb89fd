"""Simple functions in the place of a compensator, each with its certain largest difference."""
