"""The log: its size, ranges and scale factor; and the options of the command."""

from .._columns import SIGNALS
from .words import unit_of

__all__ = ["log"]


def log(page, results):
    """What the calibration was made from."""
    calibration = results.calibration
    rows = results.log
    page.section("The log and the options")
    lines = [("rows", f"{calibration.n_rows:,}", "")]
    if calibration.is_thinned:
        lines.append(("rows kept, drawn at random", f"{len(rows):,}", ""))
    for name in ("run", "device"):
        if name in rows:
            lines.append((f"{name}s", f"{rows[name].nunique():,}", ""))
    if calibration.n_fit_rows < len(rows):
        lines.append(("rows fitted to, chosen at random", f"{calibration.n_fit_rows:,}", ""))
    if results.time is not None:
        which = "rows kept" if calibration.is_thinned else "rows"
        lines.append((f"time between {which}, median", f"{results.interval:.4g}", "s"))
    ranges = {"temperature": "°C", "rate": "°/s", "output": unit_of(calibration, "output")}
    for name, unit in ranges.items():
        lines.append((name, f"{rows[name].min():.5g} to {rows[name].max():.5g}", unit))
    if calibration.recipe.output_unit in SIGNALS:
        unit = f"{calibration.recipe.output_unit} per °/s"
        lines.append(("scale factor", f"{calibration.compensator.scale_factor:.8g}", unit))
    page.table(("quantity", "value", "unit"), lines)
    if results.dossier.options:
        text = "\n".join(f"{name}: {value}" for name, value in results.dossier.options)
        page.preformatted(text, "Options of the command")
