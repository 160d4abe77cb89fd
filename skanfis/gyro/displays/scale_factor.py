"""ScaleFactorErrorDisplay: what is left of the scale factor's error, by rate and temperature."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from ._base import CompensationDisplay, binned, check_rows, mean_by_cell
from ._style import dress, figures, make_axes

__all__ = ["ScaleFactorErrorDisplay"]

_PPM = 1e6
# Odd, so that a bin has the rest in its middle.
_N_RATES = 41
# Nearer to rest, a bias divided by the rate would fill the picture.
_SMALLEST_SHARE = 0.05


@dataclass(kw_only=True, eq=False, repr=False)
class ScaleFactorErrorDisplay(CompensationDisplay):
    r"""Scale-factor error against rate, at several temperatures, before and after compensation.

    The temperature's range is cut into equal bands, and the rate's into equal bins. In each, the
    error is taken off the band's bias, the error at rest of its least-squares line, and divided by
    the rate:

    .. math:: 10^6 \, \frac{\overline{\text{error}} - \text{bias}}{\overline{\text{rate}}} .

    Rates below 5 % of the largest are left out: an error of any size is a large one in ppm there.

    Make it with :meth:`from_estimator` or :meth:`from_predictions`.

    Parameters
    ----------
    rate : ndarray of shape (n_bands, n_bins)
        Mean rate of each bin [deg/s]; NaN where a bin has no rows.
    before, after : ndarray of shape (n_bands, n_bins)
        Scale-factor error [ppm].
    temperature_edges : ndarray of shape (n_bands + 1,)
        Ends of the bands [degC].

    Attributes
    ----------
    figure_, axes_ : matplotlib figure, ndarray of matplotlib axes of shape (2,)
        Before, after; once drawn.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import ScaleFactorErrorDisplay
    >>> rate, temperature = np.meshgrid(np.linspace(-100, 100, 41), [0.0, 25.0, 50.0])
    >>> error = (-410e-6 * (temperature - 25) * rate).ravel()  # -410 ppm/degC
    >>> rate, temperature = rate.ravel(), temperature.ravel()
    >>> display = ScaleFactorErrorDisplay.from_predictions(
    ...     rate, rate + error, rate, temperature=temperature
    ... )
    >>> display.before[:, 0].round()
    array([ 10250.,      0., -10250.])
    """

    _PER_ROW = ("temperature",)

    rate: np.ndarray
    before: np.ndarray
    after: np.ndarray
    temperature_edges: np.ndarray

    @classmethod
    def from_predictions(
        cls,
        rate: ArrayLike,
        before: ArrayLike,
        after: ArrayLike,
        *,
        temperature: ArrayLike,
        n_temperatures: int = 3,
        ax: Any = None,
    ) -> Self:
        """Compute from rates, and draw.

        Parameters
        ----------
        rate, before, after : array-like of shape (n_rows,)
            True, indicated and compensated rate [deg/s]. NaN: the compensator refused the row.
        temperature : array-like of shape (n_rows,)
            Temperature [degC].
        n_temperatures : int, default=3
            Number of bands of the temperature.
        ax : array of two matplotlib axes, default=None
            For before and after; None makes a figure.

        Returns
        -------
        display : ScaleFactorErrorDisplay

        Raises
        ------
        ValueError
            If the rate never changes: then there is no scale factor.
        """
        rate, before, after, temperature = check_rows(
            rate=rate, before=before, after=after, temperature=temperature
        )
        if rate.max() == rate.min():
            raise ValueError(f"rate is {rate[0]:g} in all rows: there is no scale factor in that.")
        edges, bands = binned(temperature, n_temperatures)
        _, bins = binned(rate, _N_RATES)
        cells = bands * _N_RATES + bins
        shape = (n_temperatures, _N_RATES)
        far = np.abs(rate) >= _SMALLEST_SHARE * np.abs(rate).max()
        results = [
            _in_ppm(rate, indicated - rate, bands, cells, far, shape)
            for indicated in (before, after)
        ]
        display = cls(
            rate=_mean_of_rows(rate, cells, far, shape),
            before=results[0],
            after=results[1],
            temperature_edges=edges,
        )
        return display.plot(ax=ax)

    def plot(self, ax: Any = None) -> Self:
        """Draw.

        Parameters
        ----------
        ax : array of two matplotlib axes, default=None
            For before and after; None makes a figure.

        Returns
        -------
        display : ScaleFactorErrorDisplay
            Itself.
        """
        import matplotlib

        self.figure_, self.axes_ = make_axes(ax, 2, (6.2, 4.6), nrows=2, sharex=True)
        middles = 0.5 * (self.temperature_edges[:-1] + self.temperature_edges[1:])
        colors = matplotlib.colormaps["plasma"](np.linspace(0.05, 0.75, len(middles)))
        for axes, name in zip(self.axes_, ("before", "after"), strict=True):
            values = getattr(self, name)
            for rate, ppm, middle, color in zip(self.rate, values, middles, colors, strict=True):
                known = np.isfinite(ppm)
                label = f"{middle:.0f} °C"
                # The line is broken at rest.
                for side in (rate < 0, rate > 0):
                    axes.plot(
                        rate[known & side],
                        ppm[known & side],
                        ".-",
                        color=color,
                        label=label,
                        linewidth=1.2,
                        markersize=4,
                    )
            largest = np.nanmax(np.abs(values))
            dress(
                axes,
                ylabel="scale-factor error [ppm]",
                title=f"{name}: largest {figures(largest)} ppm",
            )
        self.axes_[1].set_xlabel("true rate [°/s]")
        _legend(self.axes_[0])
        return self

    def tables(self) -> dict[str, pd.DataFrame]:
        """What is drawn.

        Returns
        -------
        tables : dict of str to DataFrame
            "scale-factor", one row per band of temperature and bin of rate that has rows.
        """
        shape = self.rate.shape
        low, high = (
            np.repeat(ends[:, None], shape[1], axis=1).ravel()
            for ends in (self.temperature_edges[:-1], self.temperature_edges[1:])
        )
        table = pd.DataFrame(
            {
                "temperature, from [degC]": low,
                "temperature, to [degC]": high,
                "true rate [deg/s]": self.rate.ravel(),
                "scale-factor error before [ppm]": self.before.ravel(),
                "scale-factor error after [ppm]": self.after.ravel(),
            }
        )
        return {"scale-factor": table[np.isfinite(self.rate.ravel())].reset_index(drop=True)}


def _legend(axes):
    handles, labels = axes.get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    axes.legend(
        unique.values(),
        unique.keys(),
        title="around",
        loc="upper left",
        bbox_to_anchor=(1.0, 1.0),
        frameon=False,
        fontsize="small",
    )


def _in_ppm(rate, error, bands, cells, far, shape):
    known = np.isfinite(error)
    bias = np.zeros(shape[0])
    for band in range(shape[0]):
        rows = known & (bands == band)
        if np.ptp(rate[rows]) > 0 if rows.any() else False:
            bias[band] = np.polyfit(rate[rows], error[rows], 1)[1]
    means = _mean_of_rows(error - bias[bands], cells, far & known, shape)
    return _PPM * means / _mean_of_rows(rate, cells, far & known, shape)


def _mean_of_rows(values, cells, rows, shape):
    return mean_by_cell(values[rows], cells[rows], shape[0] * shape[1]).reshape(shape)
