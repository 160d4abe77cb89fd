"""CoverageDisplay: where the compensator knows what it says, and where it only goes on."""

import numpy as np

from ...inspection.labels import as_label
from .._ask import ask
from ._style import dress, make_axes

__all__ = ["CoverageDisplay"]

_N_POINTS = 2_000
_COLORS = ["#c8654a", "#f0c9b8", "#f7f7f7", "#cfe3ef", "#8ebbd8"]  # none, some, full
_SYMBOLS = {"degC": "°C", "deg/s": "°/s", "degC/min": "°C/min"}


class CoverageDisplay:
    """Where the calibration data cover what a compensator may be asked: a mask over two inputs.

    The colour is :meth:`skanfis.ANFISRegressor.coverage`, from 0 (no data speak here) to 1. Outside
    the dashed line the compensator follows its policy for rows out of bounds and flags them. All
    other inputs are held at one value.

    Make it with :meth:`from_estimator`.

    Parameters
    ----------
    x, y : ndarray of shape (n_x,), (n_y,)
        Values of the two inputs.
    coverage : ndarray of shape (n_y, n_x)
        Coverage at each pair.
    inside : ndarray of bool of shape (n_y, n_x)
        Whether the pair is within the bounds of the training data.
    rows : ndarray of shape (n_points, 2)
        Some rows of the data.
    names : tuple of two str
        Names of the two inputs, with units where these are known.

    Attributes
    ----------
    ax_ : matplotlib axes
        Once drawn.
    figure_ : matplotlib figure
        The figure that it is part of.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_ofog
    >>> from skanfis.gyro import CoverageDisplay
    >>> log = make_ofog(n_devices=1, n_runs=4, random_state=0)
    >>> X = log[["temperature", "output"]]
    >>> model = ANFISRegressor(2).fit(X, log["error"])
    >>> display = CoverageDisplay.from_estimator(model, X)
    >>> display.coverage.shape, bool(display.inside[0, 0])
    ((80, 80), False)
    """

    def __init__(self, *, x, y, coverage, inside, rows, names):
        self.x = x
        self.y = y
        self.coverage = coverage
        self.inside = inside
        self.rows = rows
        self.names = names

    @classmethod
    def from_estimator(
        cls,
        estimator,
        X,
        *,
        x="temperature",
        y="output",
        others=None,
        units=None,
        n_points=80,
        margin=0.15,
        ax=None,
    ):
        """Compute from a fitted estimator, and draw.

        Parameters
        ----------
        estimator : estimator
            Fitted, with methods ``coverage`` and ``in_bounds``, or a Pipeline that ends in such.
        X : DataFrame of shape (n_rows, n_inputs)
            Rows to draw, and from which the values of other inputs are taken.
        x, y : str, default="temperature", "output"
            Columns of X that the axes stand for.
        others : dict of str to float, default=None
            Values to hold other inputs at; the median of X where they are not named.
        units : dict of str to str, default=None
            Units of the columns, for the labels; None stands for degC, deg/s, s and degC/min for
            temperature, output, time and temperature_rate.
        n_points : int, default=80
            Number of values on each axis.
        margin : float, default=0.15
            How far the picture goes beyond the data, as a part of their range.
        ax : matplotlib axes, default=None
            Where to draw; None makes a figure.

        Returns
        -------
        display : CoverageDisplay

        Raises
        ------
        ValueError
            If ``x``, ``y`` or ``others`` name no column of X.
        """
        others = {} if others is None else others
        for name in (x, y, *others):
            if name not in X:
                raise ValueError(f"{name!r} is no column of X, which has {', '.join(X)}.")
        axes = [_values(X[name].to_numpy(dtype=float), n_points, margin) for name in (x, y)]
        grid = X.median().to_frame().T.assign(**others)
        grid = grid.loc[grid.index.repeat(n_points**2)].reset_index(drop=True)
        grid[x], grid[y] = (values.ravel() for values in np.meshgrid(*axes))
        some = np.unique(np.linspace(0, len(X) - 1, min(len(X), _N_POINTS)).astype(int))
        units = {
            "temperature": "degC",
            "output": "deg/s",
            "time": "s",
            "temperature_rate": "degC/min",
        } | (units or {})
        display = cls(
            x=axes[0],
            y=axes[1],
            coverage=ask(estimator, "coverage", grid).reshape(n_points, n_points),
            inside=ask(estimator, "in_bounds", grid).reshape(n_points, n_points),
            rows=X[[x, y]].to_numpy(dtype=float)[some],
            names=tuple(_label(name, units) for name in (x, y)),
        )
        return display.plot(ax=ax)

    def plot(self, ax=None):
        """Draw.

        Parameters
        ----------
        ax : matplotlib axes, default=None
            Where to draw; None makes a figure.

        Returns
        -------
        display : CoverageDisplay
            Itself.
        """
        from matplotlib.colors import LinearSegmentedColormap

        self.figure_, axes = make_axes(ax, 1, (6.2, 4.0))
        self.ax_ = axes[0]
        cmap = LinearSegmentedColormap.from_list("coverage", _COLORS)
        mesh = self.ax_.pcolormesh(
            self.x, self.y, self.coverage, cmap=cmap, vmin=0, vmax=1, rasterized=True
        )
        self.figure_.colorbar(mesh, ax=self.ax_).set_label("coverage")
        self.ax_.plot(*self.rows.T, ".", color="0.15", markersize=1.5, alpha=0.35, mew=0)
        x, y = (values[inside] for values, inside in self._box())
        if x.size and y.size:
            self.ax_.plot(
                x[[0, -1, -1, 0, 0]], y[[0, 0, -1, -1, 0]], "--", color="0.15", linewidth=1.2
            )
        dress(
            self.ax_,
            as_label(self.names[0]),
            as_label(self.names[1]),
            "outside the dashed line every row is flagged",
        )
        self.ax_.grid(False)
        return self

    def _box(self):
        return (self.x, self.inside.any(axis=0)), (self.y, self.inside.any(axis=1))


def _values(column, n_points, margin):
    low, high = column.min(), column.max()
    beyond = margin * (high - low)
    return np.linspace(low - beyond, high + beyond, n_points)


def _label(name, units):
    unit = units.get(name)
    return f"{name.replace('_', ' ')} [{_SYMBOLS.get(unit, unit)}]" if unit else name
