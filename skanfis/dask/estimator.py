"""DaskANFISRegressor: ANFISRegressor for dask collections, trained on their cluster."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from sklearn.utils.validation import check_is_fitted, validate_data

from ..bounds.constraints import Constraints
from ..inspection.measures import measure_rows
from ..inspection.readability import Readability
from ..learning.data import column_statistics
from ..learning.sampling import is_many
from ..regressor import ANFISRegressor
from .rows import ClusterData, Partitions, computed, is_collection, joined, reduce_partitions


class DaskANFISRegressor(ANFISRegressor):
    r"""ANFISRegressor for dask arrays and DataFrames, trained on the cluster where they live.

    Every pass over the rows is one reduction on the cluster: a task per partition, and a tree that
    adds their sums. The rows stay there, except one sample of 20,000, on which the structure is
    searched and the memberships are trained first. Data of up to 100,000 rows are fetched whole.

    Parameters, attributes and results are those of :class:`skanfis.ANFISRegressor` on the same
    rows, up to rounding errors. Give X, y, weights and groups all as dask arrays or frames cut at
    the same rows, or all in memory. On dask collections ``predict`` is lazy, and ``score`` is a
    reduction. The scheduler is dask's current one. Partitions are loaded again for every pass, some
    ten times, unless they have been persisted (``X.persist()``).

    Notes
    -----
    ``loss="huber"``, ``early_stopping=True``, and ``max_iter=0`` with a model as ``partition`` need
    every row's own residual, and are refused beyond 100,000 rows.

    Examples
    --------
    >>> import dask.array as da
    >>> from skanfis.dask import DaskANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> X, y = make_jang_sinc()
    >>> X, y = da.from_array(X, chunks=(50, 2)), da.from_array(y, chunks=50)
    >>> model = DaskANFISRegressor(n_mfs=4).fit(X, y)
    >>> model.predict(X)
    dask.array<..., shape=(121,), dtype=float64, chunksize=(50,), chunktype=numpy.ndarray>
    """

    def predict(self, X: Any, return_std: bool = False) -> Any:
        """Predict the target, lazily if X is a dask collection; warnings go to the workers."""
        if not is_collection(X):
            return super().predict(X, return_std)
        check_is_fitted(self)
        self._check_columns(X)
        y = self._lazily(X)
        return (y, self._lazily(X, is_deviation=True)) if return_std else y

    def score(self, X: Any, y: Any, sample_weight: Any = None) -> float:
        """Coefficient of determination, by a reduction if X and y are dask collections."""
        if not is_collection(X):
            return super().score(X, y, sample_weight)
        check_is_fitted(self)
        partitions = Partitions.of(X, y, sample_weight)
        self._check_columns(X)
        of_rows = partial(_target_and_error, model=self._local(has_names=False))
        described, error = reduce_partitions(partitions, of_rows, _added)
        if described is None or described[0] < 2:
            return np.nan
        _, weight, _, target = described
        if not np.isfinite(error).all():
            raise ValueError(
                "y is not finite, or X is out of range where out_of_bounds='nan': drop these rows."
            )
        explained = np.where(target.is_constant, 0.0, 1.0 - error / (weight * target.scale**2))
        return float(np.mean(np.where(error == 0.0, 1.0, explained)))

    def _local(self, has_names):
        """The model alone, to send to the workers; without ``has_names`` it expects no names."""
        local = ANFISRegressor(out_of_bounds=self.out_of_bounds)
        for name in ("model_", "n_features_in_", "feature_names_in_", "_single_output"):
            if hasattr(self, name) and (has_names or name != "feature_names_in_"):
                setattr(local, name, getattr(self, name))
        return local

    def _lazily(self, X, is_deviation=False):
        """Predictions, or their standard deviations, block by block."""
        is_frame, names = hasattr(X, "columns"), self.model_.output_names
        local = self._local(has_names=is_frame)
        of_block = partial(_predicted, model=local, names=names, is_deviation=is_deviation)
        if is_frame:
            return X.map_partitions(of_block, meta=of_block(X._meta))
        X, nothing = X.rechunk({1: -1}), of_block(np.empty((0, X.shape[1])))
        if self._single_output:
            return X.map_blocks(of_block, drop_axis=1, dtype=float, meta=nothing)
        chunks = (X.chunks[0], (len(names),))
        return X.map_blocks(of_block, chunks=chunks, dtype=float, meta=nothing)

    def _check_columns(self, X, reset=False):
        """scikit-learn's checks of columns, once, here: workers would warn for each block."""
        import pandas as pd

        if X.ndim != 2:
            raise ValueError(f"X has ndim={X.ndim}, and that of a table is 2: rows and columns.")
        columns = getattr(X, "columns", None)
        empty = np.empty((0, X.shape[1])) if columns is None else pd.DataFrame(columns=columns)
        validate_data(self, empty, reset=reset, skip_check_array=True)

    def _check_inputs(self, X):
        if is_collection(X):
            raise TypeError("Only fit, predict and score take dask collections: give X.compute().")
        return super()._check_inputs(X)

    def _check_training_data(self, X, y, sample_weight, groups, *, is_chunk=False):
        if not any(is_collection(one) for one in (X, y, sample_weight, groups)):
            return super()._check_training_data(X, y, sample_weight, groups, is_chunk=is_chunk)
        if is_chunk:
            raise TypeError(
                "partial_fit takes rows that are at hand, and these are on a cluster: use fit, or "
                "give X.compute()."
            )
        data = ClusterData.of(Partitions.of(X, y, sample_weight, groups))
        if not is_many(data.rows()):
            here = computed(X, y, sample_weight, groups)
            return super()._check_training_data(*here)
        is_given = self.max_iter == 0 and hasattr(self.partition, "strengths")
        for name, is_asked in (
            ("Huber's loss", self.loss != "squared_error"),
            ("early_stopping", self.early_stopping),
            ("max_iter=0 with a model as partition", is_given),
        ):
            if is_asked:
                raise ValueError(
                    f"{name} needs every row's own residual, which stays on the cluster. Leave it "
                    "out, or train an ANFISRegressor on a sample of the rows."
                )
        self._check_columns(X, reset=True)
        self._single_output = y.ndim == 1
        constraints = Constraints.read(
            self.monotonic_cst, self.constraints, data.input_names, len(data.output_names)
        )
        return replace(data, constraints=constraints)

    def _readability(self, data):
        if not isinstance(data, ClusterData):
            return super()._readability(data)
        return Readability(self.model_, measure_rows(self.model_, data.rows()))


def _predicted(block, model, names, is_deviation):
    """Predictions of a block, or their standard deviations; a frame if the block is one."""
    if not len(block):
        values = np.empty(0 if model._single_output else (0, len(names)))
    elif is_deviation:
        values = model.predict(block, return_std=True)[1]
    else:
        values = model.predict(block)
    if not hasattr(block, "index"):
        return values
    import pandas as pd

    if values.ndim == 1:
        return pd.Series(values, index=block.index, name=names[0])
    return pd.DataFrame(values, index=block.index, columns=list(names))


def _target_and_error(rows, model):
    """As ``_describe``, for the target alone, without squared weights; and the squared error."""
    if not rows.n_rows:
        return None, 0.0
    predicted = model.predict(rows.X).reshape(rows.y.shape)
    target = column_statistics(rows.y, rows.sample_weight)
    return (rows.n_rows, rows.total_weight, 0.0, target), rows.weights @ (rows.y - predicted) ** 2


def _added(one, other):
    return joined(one[0], other[0]), one[1] + other[1]
