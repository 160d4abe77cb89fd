"""The figures of one group of rows, and how far they scatter: a bootstrap of runs or blocks."""

from dataclasses import dataclass

import numpy as np

from ._figures_of_merit import runs_of

__all__ = ["VALUES", "Bootstrap", "units_to_resample"]

VALUES = ["before", "before_low", "before_high", "after", "after_low", "after_high"]

# With fewer runs than this, blocks of rows are resampled: two or three runs say little of others.
_FEWEST_RUNS = 5
# Few enough to be long against what drifts within one, enough for a spread.
_N_BLOCKS = 30
# Row figures of a resample cost time in proportion to its rows, and their spread comes from the
# runs or blocks: evenly thinned rows show it as well.
_MOST_ROWS = 2_000
_FEWEST_DEFINED = 0.9  # part of the resamples that must have the figure

_NAN = float("nan")


def units_to_resample(part):
    """The rows of each run, or of blocks of rows within the runs; and which of both."""
    n_rows = part["rate"].size
    if n_rows == 0:
        return [], "blocks of rows"
    runs = runs_of(part)
    if len(runs) >= _FEWEST_RUNS:
        return runs, "runs"
    length = max(1, -(-n_rows // _N_BLOCKS))
    blocks = [run[i : i + length] for run in runs for i in range(0, run.size, length)]
    return blocks, "blocks of rows"


@dataclass(frozen=True)
class Bootstrap:
    """The figures of one group and their intervals."""

    rows: dict
    units: list  # positions of the rows of each run or block
    kind: str
    n_resamples: int
    confidence_level: float
    seed: int

    def lines(self, figures):
        """Name, unit, six values and a note, for each figure."""
        sides = [side for side in ("before", "after") if side in self.rows]
        if not self.rows["rate"].size:
            note = "no row is left in this group"
            return [[figure.name, figure.unit, *6 * [_NAN], note] for figure in figures]
        with np.errstate(divide="ignore", invalid="ignore"):
            spreads = self._resampled(figures, sides) if self.n_resamples else {}
            return [self._line(figure, sides, spreads) for figure in figures]

    def _line(self, figure, sides, spreads):
        values, notes = dict.fromkeys(VALUES, _NAN), []
        for side in sides:
            if figure.only_after and side == "before":
                continue
            value, note = _evaluated(figure, self.rows, side)
            values[side] = value
            if np.isfinite(value) and self.n_resamples:
                spread = spreads.get((figure.name, side))
                note = self._interval(figure, spread, side, values)
            notes.append(note if len(sides) == 1 or not note else f"{side}: {note}")
        both = {note.partition(": ")[2] for note in notes}
        if len(notes) == 2 and len(both) == 1 and "" not in both:
            notes = [both.pop()]
        return [figure.name, figure.unit, *values.values(), "; ".join(filter(None, notes))]

    def _interval(self, figure, spread, side, values):
        """Put in the interval, or say why there is none."""
        if figure.no_interval:
            return figure.no_interval
        if spread is None:
            return f"no interval: fewer than {_FEWEST_RUNS} runs"
        defined = spread[np.isfinite(spread)]
        if defined.size < _FEWEST_DEFINED * spread.size:
            return "no interval: too many resamples do not have this figure"
        tail = 50.0 * (1.0 - self.confidence_level)
        values[f"{side}_low"], values[f"{side}_high"] = np.percentile(defined, [tail, 100.0 - tail])
        return ""

    def _resampled(self, figures, sides):
        """Values of every figure over the resamples, by name and side."""
        random_state = np.random.RandomState(self.seed)
        step = max(1, -(-self.rows["rate"].size // _MOST_ROWS))
        thinned = [unit[::step] for unit in self.units]
        by_run = {
            (figure.name, side): _per_run(figure, self.rows, side)
            for figure in figures
            for side in sides
            if figure.combine and self.kind == "runs"
        }
        of_rows = [figure for figure in figures if not (figure.combine or figure.no_interval)]
        spreads: dict = {}
        for _ in range(self.n_resamples):
            drawn = random_state.randint(len(thinned), size=len(thinned))
            chosen = np.concatenate([thinned[i] for i in drawn])
            sample = {name: column[chosen] for name, column in self.rows.items()}
            for side in sides:
                for figure in of_rows:
                    value = _evaluated(figure, sample, side)[0]
                    spreads.setdefault((figure.name, side), []).append(value)
                for figure in figures:
                    found = by_run.get((figure.name, side))
                    if found is not None:
                        value = _or_nan(figure.combine, found[drawn])[0]
                        spreads.setdefault((figure.name, side), []).append(value)
        return {key: np.array(values) for key, values in spreads.items()}


def _evaluated(figure, rows, side):
    """The figure's value and "", or NaN and why there is none."""
    if figure.only_after and side == "before":
        return _NAN, ""
    return _or_nan(figure.value, rows, side)


def _or_nan(function, *arguments):
    """What the function gives and "", or NaN and what its ValueError says."""
    try:
        return function(*arguments), ""
    except ValueError as error:
        return _NAN, str(error)


def _per_run(figure, rows, side):
    found, missing = _or_nan(figure.of, rows, side)
    return None if missing else found
