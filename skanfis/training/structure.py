"""Where a training starts from."""

from dataclasses import dataclass, field

from ..antecedent import Antecedent

__all__ = ["Structure"]


@dataclass(frozen=True, eq=False)
class Structure:
    """A rule base in standardised units, and how stiff to be."""

    antecedent: Antecedent
    alpha: float
    stiffness: float
    candidates: list[dict] = field(default_factory=list)  # what was compared, best first
    term_names: tuple[str, ...] = ()  # where they are given with the rules
