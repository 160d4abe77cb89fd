"""A log in a Parquet file: its columns, and its rows piece by piece."""

import pandas as pd

from .errors import LogError

__all__ = ["ParquetLog", "is_parquet"]

_SUFFIXES = (".parquet", ".pq")


def is_parquet(path):
    """Whether a file is one, by its name."""
    return str(path).lower().endswith(_SUFFIXES)


class ParquetLog:
    """As :class:`TextLog`; rows have no lines, and times that are such come in seconds."""

    decimal = "."
    no_value = ()

    def __init__(self, path):
        try:
            import pyarrow
            from pyarrow import parquet
        except ImportError as error:
            message = f"{path}: Parquet needs pyarrow: pip install 'skanfis[parquet]'"
            raise ImportError(message) from error
        self.path = path
        self.notes: list[str] = []
        self._errors = pyarrow.ArrowException
        with open(path, "rb"):
            pass  # what cannot be opened is told as of any other file
        try:
            # Not buffered ahead: what was read would stay as long as the file is open.
            self._file = parquet.ParquetFile(path, pre_buffer=False)
            self.header = list(self._file.schema_arrow.names)
        except (self._errors, OSError, ValueError) as error:
            raise self._damaged(error) from error
        if len(set(self.header)) < len(self.header):
            raise LogError(f"{path}: two columns have one name; rename one of them.")
        self.units = [""] * len(self.header)
        # Moments and durations, which come in seconds whatever unit is declared.
        self.in_seconds = {
            place
            for place, kind in enumerate(self._file.schema_arrow.types)
            if pyarrow.types.is_temporal(kind)
        }

    def _damaged(self, error):
        reason = str(error).strip().partition("\n")[0].removesuffix(".")
        return LogError(f"{self.path}: is no Parquet that can be read: {reason}.")

    def check_lengths(self):
        """Every row of such a file has every column."""

    def place_of(self, row):
        """In words, where a row is."""
        return f"row {row}"

    def sample(self, n_rows):
        """The first rows; columns by their places."""
        names = list(enumerate(self.header))
        for table in self._batches(names, n_rows):
            return table
        return pd.DataFrame({place: pd.Series(dtype=float) for place, _ in names})

    def pieces(self, kinds, n_rows):
        """Tables of so many rows at most: columns by their places.

        ValueError where a number is none.
        """
        names = [(place, self.header[place]) for place in kinds]
        for table in self._batches(names, n_rows):
            for place, kind in kinds.items():
                if kind is float:
                    table[place] = table[place].astype(float)
                elif table[place].dtype != object:
                    table[place] = table[place].astype("string").astype(object)
            yield table

    def _batches(self, names, n_rows):
        try:
            for batch in self._file.iter_batches(n_rows, columns=[name for _, name in names]):
                yield pd.DataFrame(
                    {place: _plain(batch.column(name).to_pandas()) for place, name in names}
                )
        except (self._errors, OSError) as error:
            raise self._damaged(error) from error


def _plain(column):
    """Moments and durations in seconds; all else as it is."""
    if isinstance(column.dtype, pd.DatetimeTZDtype):
        column = column.dt.tz_convert("UTC").dt.tz_localize(None)
    if column.dtype.kind == "M":
        return (column - pd.Timestamp(0)) / pd.Timedelta(seconds=1)
    return column / pd.Timedelta(seconds=1) if column.dtype.kind == "m" else column
