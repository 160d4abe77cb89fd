"""DaskANFISRegressor: ANFISRegressor on dask collections."""

import warnings
from dataclasses import replace
from functools import partial
from typing import Any, Self

import numpy as np
from sklearn.utils.validation import check_is_fitted

from .._memory import keeps_freed_memory
from ..bounds.constraints import Constraints
from ..inspection.measures import TargetScale, rule_sums
from ..inspection.readability import Readability
from ..learning.sampling import is_many
from ..options import policy_of
from ..regressor import ANFISRegressor
from .blocks import Blocks, is_collection
from .rows import ClusterData, add_each, reduce_blocks

__all__ = ["DaskANFISRegressor"]


class DaskANFISRegressor(ANFISRegressor):
    r"""ANFISRegressor for dask arrays and DataFrames, trained on the cluster where they live.

    Every pass over the rows is one reduction on the cluster: a task per partition, and a tree that
    adds their sums. The rows stay where they are; what comes to the client are moments of a few
    hundred kilobytes, and one sample of 20,000 rows, on which the structure is searched and the
    memberships are trained before all rows have their say. Up to 100,000 rows are no work for a
    cluster: they are fetched, and trained on as :class:`skanfis.ANFISRegressor` does.

    The result is that of :class:`skanfis.ANFISRegressor` on the same rows up to rounding errors,
    whatever the partitions. All parameters and attributes are its own, and what is fitted is as
    small: it can be exported, drawn and pickled, and predicts NumPy arrays and pandas frames too.
    Data that are NumPy arrays or pandas frames from the beginning are left to it altogether.

    The scheduler is that which dask uses: the ``dask.distributed`` client that was made last, or
    else the threads of this process. Partitions are loaded anew for every pass, some eight
    times, unless they have been persisted (``X.persist()``): data may be larger than the memory of
    all workers.

    See Also
    --------
    skanfis.ANFISRegressor : What the parameters and attributes mean.

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

    def fit(self, X: Any, y: Any, sample_weight: Any = None, groups: Any = None) -> Self:
        """Train the model.

        Parameters
        ----------
        X : dask array or DataFrame of shape (n_samples, n_features)
            Inputs, in any units. Or whatever :class:`skanfis.ANFISRegressor` takes.
        y : dask array, Series or DataFrame of shape (n_samples,) or (n_samples, n_outputs)
            Targets, cut at the same rows as X.
        sample_weight : dask array or Series of shape (n_samples,), default=None
            Weights, zero or positive.
        groups : dask array or Series of shape (n_samples,), default=None
            The run, device or level that each row belongs to.

        Returns
        -------
        self : DaskANFISRegressor

        Raises
        ------
        TypeError
            If some of the data are dask collections and others are not.
        ValueError
            If partitions do not fit together, or hold what is not a finite number: the partition
            is named. If parameters need every row's residual; see Notes.
        RuntimeError
            If the cluster is closed, or workers die again and again on one partition.
        """
        return super().fit(X, y, sample_weight=sample_weight, groups=groups)

    def predict(self, X: Any, return_std: bool = False) -> Any:
        """Predict the target, block by block and lazily where X is a dask collection.

        Parameters
        ----------
        X : dask array or DataFrame, or array-like, of shape (n_samples, n_features)
        return_std : bool, default=False
            Whether to give standard deviations too.

        Returns
        -------
        y : of shape (n_samples,) or (n_samples, n_outputs)
            A dask array of a dask array, a dask Series or DataFrame of a DataFrame, else an
            ndarray. What would be warned of is in the workers' logs.
        y_std : likewise
            Only with ``return_std``: standard deviations, as of
            :meth:`skanfis.ANFISRegressor.predict`.

        Raises
        ------
        ValueError
            If X has other columns than in training. What is not finite is refused when blocks are
            computed.
        """
        if not is_collection(X):
            return super().predict(X, return_std)
        check_is_fitted(self)
        names = None if self._single_output else self.model_.output_names
        y = self._lazily("predict", X, names, self.model_.output_names[0])
        if not return_std:
            return y
        return y, self._lazily("_deviations", X, names, self.model_.output_names[0])

    def coverage(self, X: Any) -> Any:
        """Tell how well the training data cover each row, lazily where X is a dask collection.

        Parameters
        ----------
        X : dask array or DataFrame, or array-like, of shape (n_samples, n_features)

        Returns
        -------
        coverage : of shape (n_samples,)
            As from :meth:`predict`.
        """
        return self._lazily("coverage", X) if is_collection(X) else super().coverage(X)

    def in_bounds(self, X: Any) -> Any:
        """Tell which rows lie in the range of training, lazily where X is a dask collection.

        Parameters
        ----------
        X : dask array or DataFrame, or array-like, of shape (n_samples, n_features)

        Returns
        -------
        inside : of bool, of shape (n_samples,)
            As from :meth:`predict`.
        """
        return (
            self._lazily("in_bounds", X, dtype=bool) if is_collection(X) else super().in_bounds(X)
        )

    def strengths(self, X: Any) -> Any:
        """Tell how strongly each rule fires on each row, lazily where X is a dask collection.

        Parameters
        ----------
        X : dask array or DataFrame, or array-like, of shape (n_samples, n_features)

        Returns
        -------
        strengths : of shape (n_samples, n_rules)
            As from :meth:`predict`.
        """
        if not is_collection(X):
            return super().strengths(X)
        return self._lazily("strengths", X, tuple(range(self.n_rules_)))

    def score(self, X: Any, y: Any, sample_weight: Any = None) -> float:
        """Coefficient of determination R², a reduction where X and y are dask collections.

        Parameters
        ----------
        X : dask array or DataFrame, or array-like, of shape (n_samples, n_features)
        y : of the same kind, of shape (n_samples,) or (n_samples, n_outputs)
        sample_weight : of the same kind, of shape (n_samples,), default=None

        Returns
        -------
        score : float
            1 - (squared error) / (squares about the mean), the mean over outputs.

        Raises
        ------
        ValueError
            If X has other columns than in training, or y or weights are not cut as X is.
        """
        if not is_collection(X):
            return super().score(X, y, sample_weight)
        check_is_fitted(self)
        blocks = Blocks.of(X, y, sample_weight)
        self._check_names(blocks.layout.given_input_names, blocks.layout.n_inputs)
        # About the training mean: the squares lose no digits.
        origin = self.readability_.measures.mean
        of_block = partial(_error_sums, model=self._local(), origin=origin)
        weight, first, second, error = reduce_blocks(blocks, of_block, add_each)
        spread = second - first**2 / weight
        with np.errstate(divide="ignore", invalid="ignore"):
            by_output = np.where(error == 0.0, 1.0, np.where(spread > 0, 1 - error / spread, 0.0))
        return float(np.mean(by_output))

    def _local(self, has_names=True):
        """The model alone, as sent to the workers; of inputs without names it expects none."""
        local = ANFISRegressor(out_of_bounds=self.out_of_bounds)
        for name in ("model_", "n_features_in_", "feature_names_in_", "_single_output"):
            if hasattr(self, name) and (has_names or name != "feature_names_in_"):
                setattr(local, name, getattr(self, name))
        return local

    def _lazily(self, method, X, columns=None, name=None, dtype=float):
        """A method on every block; ``columns`` names those of a result of two dimensions."""
        check_is_fitted(self)
        names = getattr(X, "columns", None)
        self._check_names(None if names is None else tuple(names), X.shape[1])
        local = self._local(has_names=names is not None)
        of_block = partial(_apply, model=local, method=method, columns=columns, name=name)
        if names is not None:
            meta = _as_frame(np.empty((0, len(columns)) if columns else 0, dtype), columns, name)
            return X.map_partitions(of_block, meta=meta)
        X = X.rechunk({1: -1})
        if columns is None:
            return X.map_blocks(of_block, drop_axis=1, dtype=dtype, meta=np.empty(0, dtype))
        chunks = (X.chunks[0], (len(columns),))
        return X.map_blocks(of_block, chunks=chunks, dtype=dtype, meta=np.empty((0, 0), dtype))

    def _check_names(self, names, n_columns):
        """ValueError where X has other columns than in training; a warning where it has no names.

        Here, once: a worker would warn of each block, where nobody looks.
        """
        expected = getattr(self, "feature_names_in_", None)
        if names is not None and expected is not None and names != tuple(expected):
            raise ValueError(
                f"X has the columns {', '.join(map(str, names))}; the model was trained on "
                f"{', '.join(expected)}: give them by these names and in this order."
            )
        if n_columns != self.n_features_in_:
            raise ValueError(
                f"X has {n_columns} features, but {type(self).__name__} is expecting "
                f"{self.n_features_in_} features as input."
            )
        if names is None and expected is not None:
            warnings.warn(
                f"X does not have valid feature names, but {type(self).__name__} was fitted with "
                "feature names",
                UserWarning,
                stacklevel=3,
            )

    def _check_training_data(self, X, y, sample_weight, groups, *, is_chunk=False):
        if not any(is_collection(one) for one in (X, y, sample_weight, groups)):
            return super()._check_training_data(X, y, sample_weight, groups, is_chunk=is_chunk)
        if is_chunk:
            raise TypeError(
                "partial_fit takes rows that are at hand, and these are on a cluster: use fit, or "
                "give X.compute()."
            )
        data = ClusterData.of(Blocks.of(X, y, sample_weight, groups))
        layout = data.blocks.layout
        wishes = Constraints.read(
            self.monotonic_cst, self.constraints, layout.input_names, len(layout.output_names)
        )
        data = replace(data, wishes=wishes)
        if not is_many(data.rows()):
            return super()._check_training_data(*_named(layout, *data.gathered()))
        self._refuse_what_needs_residuals()
        self.n_features_in_, self._single_output = layout.n_inputs, layout.is_single_output
        self.__dict__.pop("feature_names_in_", None)
        if layout.given_input_names == layout.input_names:
            self.__dict__["feature_names_in_"] = np.array(layout.input_names, dtype=object)
        return data.kept()

    def _refuse_what_needs_residuals(self):
        for name, is_asked in (
            ("Huber's loss", self.loss != "squared_error"),
            ("early_stopping", self.early_stopping),
            (
                "max_iter=0 with a model as partition",
                self.max_iter == 0 and not isinstance(self.partition, str),
            ),
        ):
            if is_asked:
                raise ValueError(
                    f"{name} needs every row's own residual, which stays on the cluster. Leave it "
                    "out, or train an ANFISRegressor on a sample of the rows."
                )

    def _readability(self, data):
        if not isinstance(data, ClusterData):
            return super()._readability(data)
        rows, model = data.rows(), self.model_
        scale = rows.targets
        target = TargetScale(
            rows.total_weight, scale.offset, scale.scale, scale.minimum, scale.maximum
        )
        # Nothing is asked of the posterior, which is most of a model's bytes.
        sent = replace(model, posterior=None)
        sums = rows.reduce(partial(rule_sums, model=sent, target=target), _joined)
        return Readability(model, sums.measures())


def _named(layout, X, y, sample_weight, groups):
    """Rows that were fetched, with the names that their collections had."""
    import pandas as pd

    if layout.given_input_names is not None:
        X = pd.DataFrame(X, columns=list(layout.given_input_names))
    if layout.is_single_output:
        y = y[:, 0]
    if layout.given_output_names is not None:
        names = list(layout.given_output_names)
        y = pd.Series(y, name=names[0]) if y.ndim == 1 else pd.DataFrame(y, columns=names)
    return X, y, sample_weight, groups


def _joined(one, other):
    return one.joined(other)


def _apply(block, model, method, columns, name):
    """A method of the model on a block, as a frame where the block is one."""
    if len(block):
        with keeps_freed_memory():
            values = getattr(model, method)(block)
    else:
        values = np.empty((0, len(columns)) if columns else 0)
    return _as_frame(values, columns, name, block.index) if hasattr(block, "index") else values


def _as_frame(values, columns, name, index=None):
    import pandas as pd

    if columns is None:
        return pd.Series(values, index=index, name=name)
    return pd.DataFrame(values, index=index, columns=list(columns))


def _error_sums(loaded, model, origin):
    """Weight, target and its square about an origin, and squared error, of a block."""
    weight = np.ones(len(loaded.X)) if loaded.sample_weight is None else loaded.sample_weight
    if not len(loaded.X):
        return [0.0, *np.zeros((3, len(origin)))]
    predicted = model.model_.with_out_of_bounds(*policy_of(model.out_of_bounds)).predict(loaded.X)
    away = loaded.y - origin
    error = loaded.y - predicted
    return [weight.sum(), weight @ away, weight @ away**2, weight @ error**2]
