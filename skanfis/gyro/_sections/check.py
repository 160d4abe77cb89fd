"""How it was checked, and what is simpler on the same rows."""

from collections import Counter

import numpy as np

from .._headline import held_out_groups
from .._simpler import NOTHING
from ..displays._style import figures
from .words import terms_text

__all__ = ["check"]


def check(page, results):
    """The folds, the terms of each, and the comparison with simpler compensations."""
    calibration = results.calibration
    page.section("How it was checked")
    if calibration.is_thinned:
        page.paragraph(
            f"The log has {calibration.n_rows:,} rows. All were read and looked at for errors; "
            f"what is said here is of {len(calibration.log):,} of them, every k-th of each run. "
            "Figures that need every row, of bias stability and Allan's deviation, are left out."
        )
    page.paragraph(
        f"Every row was compensated by a model that had not seen its group: "
        f"{calibration.split.sentence}. A row outside the range of that model's training data is "
        "flagged, as it would be on board, and has a figure of its own above. All other figures "
        "and pictures, before and after compensation alike, are of the rows in range."
    )
    if calibration.fold_choices is not None:
        page.paragraph(_on_choices(calibration))
    for message in calibration.warnings:
        page.paragraph(message, kind="warn")
    _contest(page, results)
    tried = calibration.choice.tried
    if len(tried) > 1:
        text = "\n".join(
            f"{','.join(map(str, terms)):>12}  {results.shown(found)}" for terms, found in tried
        )
        page.preformatted(
            f"terms of {', '.join(calibration.recipe.inputs)}; RMS error on the folds that chose "
            f"among them [{results.symbol}]: no figure of merit\n{text}",
            "Structures that were tried for the final model",
        )


def _on_choices(calibration):
    found = Counter(terms_text(choice.terms) for choice in calibration.fold_choices)
    several = ", ".join(f"{text} in {count}" for text, count in found.most_common())
    return (
        "Within each fold the structure was chosen anew from the fold's training rows alone, so "
        f"that no figure here is of rows that had a say in it: {several} of "
        f"{len(calibration.fold_choices)} folds. The final model, fitted to all rows, has "
        f"{terms_text(calibration.choice.terms)}."
    )


def _contest(page, results):
    verdict = results.calibration.verdict
    page.heading("Beside simpler compensations")
    page.paragraph(
        "On the same folds, the same held-out rows in range and the same inputs. What this model "
        "is better by is the ratio of RMS errors, as the geometric mean over "
        f"{held_out_groups(results.calibration)}, with its 95 % interval by Student's t. "
        "Recommended is the simplest that no more elaborate one beats decisively: with an interval "
        "above 1.02.",
        kind="soft",
    )
    lines = []
    for name, error in verdict.rms.items():
        factor = verdict.rms[NOTHING] / error if error else float("inf")
        gain = verdict.gains.get(name)
        beside: str | tuple[str, str] = "–"
        if gain is not None:
            known = np.isfinite(gain.low)
            interval = f"[{figures(gain.low)}, {figures(gain.high)}]" if known else ""
            beside = (f"{figures(gain.factor)} ×", interval)
        use = "recommended" if name == verdict.recommended else ""
        lines.append((name, results.shown(error), f"{figures(factor)} ×", beside, use))
    page.table(
        (
            "compensation",
            f"RMS error [{results.symbol}]",
            "reduction",
            "this model better by",
            "result",
        ),
        lines,
    )
    for simple in results.calibration.simpler:
        if simple.missing:
            page.paragraph(f"{simple.name}: {simple.missing}", kind="soft")
