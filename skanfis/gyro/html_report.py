"""The report of a calibration as one page of HTML: verdict, tables, pictures, rules, limits."""

from ._html import Page
from ._pictures import PICTURES
from ._results import Results
from ._sections.check import check
from ._sections.head import cards, conclusion
from ._sections.identity import identity, programs
from ._sections.instead import instead
from ._sections.log import log
from ._sections.merit import merit
from ._sections.rules import reading, rules, rules_text
from ._sections.sure import sure
from ._sections.use import limits_of_use
from ._sections.words import words

__all__ = ["report_page", "rules_text"]


def report_page(calibration, title, dossier=None):
    """The report of a calibration, as the text of an HTML file.

    ``dossier`` tells of the device, the files, the options, the limits and the unit.
    """
    page = Page(f"Gyro compensation: {title}", _subtitle(calibration))
    results = Results(calibration, dossier)
    for section in (conclusion, cards, identity, check, instead, merit, _pictures):
        section(page, results)
    for section in (limits_of_use, sure, rules, reading, log):
        section(page, results)
    page.footer(f"Made by {programs()}. Figures of merit in the terms of IEEE Std 952.")
    return page.render()


def _subtitle(calibration):
    what = "Arcsine law and fuzzy rules" if calibration.recipe.physics else "Fuzzy rules (ANFIS)"
    target = "rate" if calibration.recipe.physics else "rate error"
    inputs = ", ".join(words(name) for name in calibration.recipe.inputs)
    return f"{what} that predict the gyro's {target} from {inputs}."


def _pictures(page, results):
    page.section("Pictures")
    page.figures([picture for draw in PICTURES if (picture := draw(results)) is not None])
    if results.why_no_allan:
        page.paragraph(f"Allan deviation: {results.why_no_allan}.", kind="soft")
