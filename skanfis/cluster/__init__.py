"""Two clusterers with scikit-learn's interface, for rule bases and for use on their own."""

from .fuzzy_cmeans import FuzzyCMeans
from .subtractive import SubtractiveClustering

__all__ = ["FuzzyCMeans", "SubtractiveClustering"]
