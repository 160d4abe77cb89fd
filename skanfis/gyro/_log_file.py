"""One file of a log, in pieces: its parts in the units of a log, and its runs."""

import numpy as np
import pandas as pd

from ._checks import LABELS, QUANTITIES, check_values
from ._clock import Clock
from ._columns import SIGNALS, convert
from ._guess import settle
from ._source import NO_VALUE, open_source
from .errors import LogError, shortened

__all__ = ["LogFile", "RunFinder"]

_ROWS = 200_000  # of a piece, which is all that is held beside the log itself
_PIECES_TOLD = 10  # from one line of progress to the next
_CLOCK_ROWS = 200  # by which the form of a clock is told
# A rest without power is longer than what a logger drops, and than a few of its steps.
_SHORTEST_GAP = 60.0  # s
_STEPS = 50.0
_FEWEST_ROWS = 20  # shorter pieces are no runs, but a logger that stutters
_BEGINNING = 0.1  # part of a run, where a clock is again that has been set anew


class LogFile:
    """A file of a log; ``first`` is the first file of the same log, whose columns hold.

    LogError where it is no log, or not like the first.
    """

    def __init__(self, path, request, first=None):
        self.path, self.request = path, request
        self.source = open_source(path, request.separator, request.decimal, request.encoding)
        self.layout = settle(self.source, request, None if first is None else first.layout)
        self.notes = [*self.source.notes, *self.layout.notes]
        self.n_rows, self.devices = 0, set()
        if first is not None:
            self._check_like(first)
        if request.device is not None and "device" not in self.layout.places:
            raise ValueError("--device: the log has no column for the device.")

    def _check_like(self, first):
        differ = sorted(set(self.layout.places) ^ set(first.layout.places))
        if differ:
            raise LogError(f"{self.path}: the files differ in having {', '.join(differ)}.")
        own, other = self.layout.units["output"], first.layout.units["output"]
        if own != other and {own, other} & set(SIGNALS):
            raise LogError(
                f"{self.path}: the output is in {own}, in {first.path} in {other}; say which it is "
                "(units: output=UNIT)."
            )

    def pieces(self, tell=None):
        """Tables of the parts, with the position of each row in the file as "row".

        Rows that lack a value are left out if that is asked for. ``tell`` is called with a line of
        text now and then.
        """
        self.source.check_lengths()
        pieces = self._pieces(tell)
        yield from pieces if self.request.average is None else self._averaged(pieces)

    def _pieces(self, tell):
        clock = self._clock()
        places, kinds = self.layout.places, {}
        for part, place in places.items():
            is_text = part in LABELS or (part == "time" and clock is not None)
            kinds[place] = str if is_text else float
        if clock is not None and self.layout.date is not None:
            kinds[self.layout.date] = str
        lacking = pd.Series(0, index=list(places))
        n_left_out, first = 0, None
        try:
            for number, table in enumerate(self.source.pieces(kinds, _ROWS), start=1):
                piece, missing = self._converted(table, clock)
                self.n_rows += len(piece)
                bad = missing.any(axis=1)
                if bad.any():
                    lacking += missing.sum()
                    n_left_out += int(bad.sum())
                    first = piece["row"][bad.idxmax()] if first is None else first
                    piece = piece[~bad]
                if self.request.device is not None:
                    self.devices |= set(piece["device"])
                    piece = piece[piece["device"] == self.request.device]
                if len(piece):
                    yield piece.reset_index(drop=True)
                if tell is not None and number % _PIECES_TOLD == 0:
                    tell(f"{self.path}: {self.n_rows:,} rows so far")
        except LogError:
            raise
        except ValueError as error:
            raise self._no_number(kinds, error) from error
        self._report_missing(n_left_out, lacking[lacking > 0], first)

    def located(self, error, rows=None, where=None):
        """An error of one part and row, in terms of this file; ``rows`` are positions in it."""
        where = where or self.path
        if error.row is not None:
            row = error.row if rows is None else int(rows.iloc[error.row])
            where = f"{self.path}, {self.source.place_of(row)}"
        if error.column is None:
            return error
        name = self.layout.name(error.column)
        part = "" if name == error.column else f" ({error.column})"
        return LogError(f"{where}, column {name!r}{part}: {error.reason}")

    def _clock(self):
        """What reads the time, where it is no number."""
        if "time" not in self.layout.places:
            return None
        kinds = {self.layout.places["time"]: str}
        kinds |= {} if self.layout.date is None else {self.layout.date: str}
        table = next(self.source.pieces(kinds, _CLOCK_ROWS), None)
        if table is None:
            return None
        texts = table[self.layout.places["time"]].dropna()
        plain = texts.str.replace(self.source.decimal, ".")
        if pd.to_numeric(plain, errors="coerce").notna().mean() > 0.5:
            return None
        clock = Clock(self._moments(table))
        if not clock.form:
            return None
        self.notes.append(f"the time is read as {clock.note}")
        return clock

    def _moments(self, table):
        texts = table[self.layout.places["time"]]
        return texts if self.layout.date is None else table[self.layout.date] + " " + texts

    def _converted(self, table, clock):
        """The parts of a piece in the units of a log, and where a value is missing."""
        piece = pd.DataFrame({"row": self.n_rows + np.arange(len(table))})
        for part, place in self.layout.places.items():
            column, unit = table[place], self.layout.units.get(part)
            if part in LABELS:
                piece[part] = column.astype(object).to_numpy()
            elif part == "time" and clock is not None:
                piece[part] = clock.seconds(self._moments(table))
                bad = (piece[part].isna() & column.notna().to_numpy()).to_numpy()
                if bad.any():
                    row = int(bad.argmax())
                    reason = f"{shortened(column.iloc[row])} is no time like those before."
                    raise self.located(LogError(reason, part, row), piece["row"])
            else:
                is_moment = part == "time" and place in self.source.in_seconds
                piece[part] = convert(column.to_numpy(), part, "s" if is_moment else unit)
        try:
            for part in self.layout.places:
                check_values(piece[part], part, self.request.drop_missing)
        except LogError as error:
            raise self.located(error, piece["row"]) from error
        return piece, piece.drop(columns="row").isna()

    def _no_number(self, kinds, error):
        """The error for the first value in the file that should be a number and is none."""
        for part, place in self.layout.places.items():
            start = 0
            for table in self.source.pieces({place: str}, _ROWS) if kinds[place] is float else ():
                texts = table[place].mask(table[place].isin(NO_VALUE))
                plain = texts.str.replace(self.source.decimal, ".")
                bad = (pd.to_numeric(plain, errors="coerce").isna() & texts.notna()).to_numpy()
                if bad.any():
                    row = int(bad.argmax())
                    reason = f"{shortened(texts.iloc[row])} is not a number."
                    return self.located(LogError(reason, part, start + row))
                start += len(table)
        return error

    def _report_missing(self, n_rows, lacking, first):
        if n_rows == 0:
            return
        parts = ", ".join(f"{self.layout.name(part)!r} in {n:,}" for part, n in lacking.items())
        said = f"{n_rows:,} of {self.n_rows:,} rows lack a value ({parts})"
        if 2 * n_rows > self.n_rows:
            raise LogError(f"{self.path}: {said}: too many to go on without them.")
        place = self.source.place_of(int(first))
        self.notes.append(f"{said}; they are left out, the first of them {place}")

    def _averaged(self, pieces):
        """Means over so many seconds, of rows that follow each other in a run of a device."""
        seconds, n_rows, n_means, rest = self.request.average, 0, 0, None
        for piece in pieces:
            piece = pd.concat([rest, piece], ignore_index=True)
            cell = piece[[part for part in LABELS if part in piece]].assign(
                cell=np.floor(piece["time"] / seconds)
            )
            number = (cell != cell.shift()).any(axis=1).cumsum()
            is_last = number == number.iloc[-1]
            rest, piece = piece[is_last], piece[~is_last]
            n_rows, n_means = n_rows + len(piece), n_means + int(number.iloc[-1]) - 1
            if len(piece):
                yield _means(piece, number[~is_last])
        if rest is not None:
            yield _means(rest, np.zeros(len(rest)))
            n_rows, n_means = n_rows + len(rest), n_means + 1
            self.notes.append(
                f"{n_rows:,} rows are averaged over {seconds:g} s each, to {n_means:,}"
            )


def _means(piece, number):
    kinds = {name: "mean" if name in QUANTITIES else "first" for name in piece}
    return piece.groupby(number, sort=False).agg(kinds).reset_index(drop=True)


class RunFinder:
    """Finds the runs of a log that comes in pieces: by labels, else by its clock; and by files.

    ``max_gap`` is the longest step of the time within a run [s], "auto", or None, which splits no
    file. ``runs`` are the files, devices and labels of the runs, in the order in which they came.
    """

    def __init__(self, max_gap):
        self._max_gap = max_gap
        self._longest = None if max_gap == "auto" else max_gap
        self._codes: dict = {}
        # By file and device: when its clock began, its last time, the number of its run.
        self._open: dict = {}
        self._n_gaps = self._n_restarts = 0

    @property
    def runs(self):
        return pd.DataFrame(list(self._codes), columns=["file", "device", "run"])

    def codes(self, piece, file):
        """Position of each row's run among ``runs``; ``file`` tells files apart."""
        device = piece["device"] if "device" in piece else pd.Series("", piece.index)
        if "run" in piece:
            run = piece["run"]
        elif "time" in piece and self._max_gap is not None:
            run = self._split(device, piece["time"], file).astype(str)
        else:
            run = pd.Series("", piece.index)
        groups = pd.DataFrame({"device": device, "run": run}).groupby(["device", "run"], sort=False)
        own = [
            self._codes.setdefault((file, *key), len(self._codes))
            for key in groups.head(1).itertuples(index=False, name=None)
        ]
        return np.array(own)[groups.ngroup().to_numpy()]

    def _split(self, device, time, file):
        if self._longest is None:
            self._longest = _longest_step(time, device)
        number = pd.Series(1, time.index)
        for name, values in time.groupby(device, sort=False):
            begin, last, before = self._open.get((file, name), (values.iloc[0],) * 2 + (1,))
            steps = np.diff(values, prepend=last)
            gaps = steps > self._longest
            restarts = np.zeros(steps.size, dtype=bool)
            for row in np.flatnonzero(steps < 0.0).tolist():
                restart = values.iloc[row]
                if restart <= begin + _BEGINNING * (restart - steps[row] - begin):
                    restarts[row], begin = True, restart
            number[values.index] = before + np.cumsum(gaps | restarts)
            self._open[file, name] = begin, values.iloc[-1], int(number[values.index[-1]])
            self._n_gaps += int(gaps.sum())
            self._n_restarts += int(restarts.sum())
        return number

    @property
    def note(self):
        """What the clock has told, in words; empty where it tells one run."""
        parts = []
        if self._n_gaps:
            gaps = _counted(self._n_gaps, "gap")
            parts.append(f"at {gaps} of the time longer than {self._longest:.4g} s")
        if self._n_restarts:
            times = _counted(self._n_restarts, "time")
            parts.append(f"where the time begins anew ({times})")
        if not parts:
            return ""
        return (
            f"the log is split into {_counted(len(self._codes), 'run')}, {' and '.join(parts)}; "
            "--max-gap says otherwise, inf for no such gap"
        )

    def names(self, file_names, has_labels):
        """The shortest label of each run that tells it from all others; None of a single run."""
        keys: dict = dict(
            zip(("file", "device", "run"), zip(*self._codes, strict=True), strict=False)
        )
        owners = ["file"] if len(file_names) > 1 else []
        owners += ["device"] if any(keys.get("device", ())) else []
        owners += ["run"] if has_labels or self.note else []
        if not keys or not {"file", "run"} & set(owners):
            return None
        keys["file"] = [file_names[file] for file in keys["file"]]
        for parts in (["run"], ["file"], ["device", "run"], ["file", "run"], owners):
            if set(parts) <= set(owners):
                names = [" / ".join(row) for row in zip(*map(keys.get, parts), strict=True)]
                if len(set(names)) == len(names):
                    break
        return names


def _longest_step(time, device):
    """The longest step of the time within a run, by the first piece of a log."""
    order = np.argsort(pd.factorize(device)[0], kind="stable")
    device, time = device.to_numpy()[order], time.to_numpy()[order]
    steps = np.diff(time, prepend=time[0])
    is_first = np.append(True, device[1:] != device[:-1])
    forward = steps[(steps > 0.0) & ~is_first]
    if forward.size == 0:
        return np.inf
    longest = max(_SHORTEST_GAP, _STEPS * float(np.median(forward)))
    lengths = np.diff(np.flatnonzero(is_first | (steps > longest)), append=time.size)
    return longest if np.median(lengths) >= _FEWEST_ROWS else np.inf


def _counted(n, noun):
    return f"{n} {noun}{'s' if n > 1 else ''}"
