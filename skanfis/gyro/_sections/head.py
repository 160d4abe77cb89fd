"""What is seen first: the verdict, the limits, the warnings, and a handful of figures."""

import numpy as np

from .._columns import RATE_UNITS
from .._headline import ARTICLES, headline
from .._simpler import NOTHING
from ..displays._style import figures
from ..metrics import rms
from .words import terms_text

__all__ = ["cards", "conclusion"]


def conclusion(page, results):
    """Which compensation to use, whether the limits are kept, what to be careful of."""
    calibration = results.calibration
    verdict = calibration.verdict
    title, reason = headline(calibration, results.unit)
    sentences = [reason, *_on_limits(results)]
    if not verdict.model_is_worth_it:
        sentences.append(
            "The files of this calibration hold the fuzzy rules all the same, and what follows is "
            'about them; "What to use instead" has the simpler compensation.'
        )
    if results.readability.findings:
        sentences.append(
            'The rules are not fit to be read one by one: "Can the rules be read?" says why.'
        )
    is_good = verdict.model_is_worth_it and all(check.is_kept for check in results.checks)
    page.banner(title, sentences, "good" if is_good else "bad")
    for sentence in calibration.cautions_in(results.symbol, RATE_UNITS[results.unit]):
        page.paragraph(f"Warning: {sentence}", kind="warn")


def _on_limits(results):
    """One sentence where the specification has limits."""
    checks = results.checks
    if not checks:
        return []
    failed = [check.words for check in checks if check.is_kept is False]
    missing = [check.words for check in checks if check.is_kept is None]
    parts = [f"{sum(check.is_kept is True for check in checks)} of {len(checks)} limits are kept"]
    if failed:
        parts.append(f"not kept: {', '.join(failed)}")
    if missing:
        parts.append(f"could not be measured: {', '.join(missing)}")
    return [f"Specification: {'; '.join(parts)}."]


def cards(page, results):
    """The error before and after, on the same rows."""
    calibration = results.calibration
    unit, after = results.symbol, results.error_after
    facts = [
        (
            "RMS error before",
            f"{results.shown(rms(results.error_before))} {unit}",
            "the same held-out rows in range",
        ),
        ("RMS error after", f"{results.shown(rms(after))} {unit}", "held-out rows in range"),
        ("Reduction", f"{figures(results.gain)} ×", _beside(results)),
        ("Largest error after", f"{results.shown(np.abs(after).max())} {unit}", "same rows"),
        ("Rules", f"{calibration.rules[-1].n_rules_}", terms_text(calibration.choice.terms)),
    ]
    if results.beyond.any():
        remark = f"{results.beyond.mean():.1%} of the held-out rows, all flagged"
        error = (calibration.after - results.rate)[results.beyond]
        facts.append(("RMS out of range", f"{results.shown(rms(error))} {unit}", remark))
    page.cards(facts)


def _beside(results):
    """The reduction by the best of what is simpler."""
    errors = results.calibration.verdict.rms
    simpler = [name for name in errors if name in ARTICLES and name != NOTHING]
    best = min(simpler, key=errors.get)
    factor = errors[NOTHING] / errors[best] if errors[best] else float("inf")
    return f"{ARTICLES[best]} alone: {figures(factor)} ×"
