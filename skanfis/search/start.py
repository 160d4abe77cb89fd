"""Where a training starts from."""

from dataclasses import dataclass, field

import numpy as np

from ..antecedent import Antecedent
from ..learning.penalty import Penalty

__all__ = ["Start"]


@dataclass(frozen=True, eq=False)
class Start:
    """A rule base in standardised units, what its parameters pay, and where they stand already."""

    antecedent: Antecedent
    penalty: Penalty
    displacement: np.ndarray | None = None  # of the premises; None is zero
    is_free: bool = False  # whether terms may become what nobody can read (see ``premise``)
    is_apart: bool = False  # the strongest rule does not hold alone, and making it would be dear
    # Agreement is such that the strongest rule holds alone: it does not fall as the rows rise.
    is_held: bool = False
    candidates: list[dict] = field(default_factory=list)  # what was compared, best first
    term_names: tuple[str, ...] = ()  # where they are given with the rules
    expected_error: float = np.nan  # mean square on new rows, as far as it was sought
    unknown_between: float = 0.0  # part of the places between the rows (see ``between``)
