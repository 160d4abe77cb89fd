"""What an estimator gains by keeping sums over its rows: partial_fit and merge."""

from copy import copy
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils.metaestimators import available_if

from .._memory import keeps_freed_memory
from .._sklearn import fit_context
from ..inspection.readability import readability_of_rows
from ..learning import MESSAGES
from ..model import TSKModel
from ..options import policy_of
from ..parameters import found_weights, given_weights, keep_weights, solver_of, structure_request
from .asked import (
    can_learn_from_chunks,
    check_finds_structure,
    check_first_chunk,
    check_forgetting,
    check_outputs,
    check_settings,
    faded_weights,
    held_model,
    structure_settings,
    warn_of_fit,
)
from .information import Information
from .merging import check_same_premises, stream_of
from .stream import Stream
from .window import check_window, latest_rows

__all__ = ["LearnsFromChunksMixin"]


class LearnsFromChunksMixin:
    """Adds ``partial_fit`` and ``merge`` to the estimator, whose ``fit`` finds the premises."""

    # What the estimator brings.
    fit: Any
    out_of_bounds: Any
    _tell_noise: Any
    _check_training_data: Any

    @available_if(can_learn_from_chunks)
    @fit_context(prefer_skip_nested_validation=False)
    def partial_fit(
        self,
        X: ArrayLike,
        y: ArrayLike,
        sample_weight: ArrayLike | None = None,
        *,
        forgetting: float = 1.0,
        window: int | None = None,
    ) -> Self:
        r"""Learn from a chunk of rows, going on from those before; premises stay.

        The first call is ``fit`` on its rows, which finds the structure and the premises; or, with
        ``solver="lse"`` and a model as ``partition``, takes both from there. Every further call
        adds its rows to the sums that the consequents are solved from. Whatever the chunks, the
        model is the one that ``fit`` with ``solver="lse"`` makes of all rows at these premises.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            Inputs, with the columns of the first call; a single row will do after the first call.
        y : array-like of shape (n_samples,) or (n_samples, n_outputs)
            Targets.
        sample_weight : array-like of shape (n_samples,), default=None
            Weights, zero or positive, relative to those of all other calls.
        forgetting : float, default=1.0
            Above 0 and at most 1: with every row that has weight, the weights of all rows before it
            are multiplied by this. 1 forgets nothing; at 0.999 about the last 1,000 rows count.
            The box, coverage, and what has ever been seen do not forget.
        window : int, default=None
            2 or more: only the last so many rows with weight count, of this call and those before;
            they are kept, in the model and its pickle. The model, its box and coverage are then
            those of ``fit`` with ``solver="lse"`` on these rows, at the same premises. To be given
            from the first call on, and not beside ``forgetting``. None keeps sums alone, and
            forgets no row.

        Returns
        -------
        self : ANFISRegressor

        Raises
        ------
        ValueError
            If the data are empty or not finite, or have other columns than those before; if
            ``forgetting`` or ``window`` is out of its range, both are given, or ``window`` only
            after rows were taken in without it; if the first call has a single row but must find
            the structure; if what that depends on has been changed since the first call.
        AttributeError
            If ``loss``, ``early_stopping`` or constraints ask for what needs all rows again.

        Warns
        -----
        ForgottenRowsWarning
            If ``fit`` came before: its premises stay, its rows do not count.

        Notes
        -----
        Weights of the penalty that are "auto" are found anew in every call, by the evidence of all
        rows. ``readability_`` is of the latest chunk. :meth:`merge` adds what several machines have
        seen. See :doc:`/streaming`.

        Examples
        --------
        >>> from skanfis import ANFISRegressor
        >>> from skanfis.datasets import make_jang_sinc
        >>> X, y = make_jang_sinc()
        >>> model = ANFISRegressor(n_mfs=4)
        >>> for start in (0, 60):
        ...     model = model.partial_fit(X[start : start + 60], y[start : start + 60])
        >>> model.n_samples_seen_
        120
        """
        before = self.__dict__.copy()
        try:
            with keeps_freed_memory():
                self._take_in(X, y, sample_weight, forgetting, window)
        except BaseException:
            self.__dict__ = before
            raise
        return self

    def _take_in(self, X, y, sample_weight, forgetting, window):
        """Add a chunk, or make the first one."""
        forgetting = check_forgetting(forgetting)
        check_window(window, forgetting)
        check_settings(self)
        base, stream = getattr(self, "model_", None), getattr(self, "_stream", None)
        single_output = getattr(self, "_single_output", None)
        data = self._check_training_data(X, y, sample_weight, None, is_chunk=True)
        weight = faded_weights(data.sample_weight, data.X.shape[0], forgetting)
        if base is not None:
            self._single_output = single_output
            check_outputs(base, data.y.shape[1], data.output_names)
        before, rows = getattr(self, "_window", None), (data.X, data.y, weight)
        kept = latest_rows(before, stream is not None, *rows, window)
        if stream is None:
            stream = self._first_chunk(X, y, data, weight, kept)
        else:
            if data.X.shape[0] == 0:
                return
            if kept is None:
                chunk = stream.chunk(*rows)
                stream = stream.faded(forgetting ** data.X.shape[0]).plus(chunk)
            else:
                stream = stream.anew(*kept.rows)
            self._learn_from(stream)
            self.readability_ = readability_of_rows(self.model_, *rows)
        self._stream, self._window = stream, kept
        self.n_samples_seen_ = getattr(self, "n_samples_seen_", 0) + data.X.shape[0]

    def _first_chunk(self, X, y, data, weight, kept):
        """The stream of a first chunk, or of the rows of it that are kept; its model is learnt."""
        check_first_chunk(self, data.X.shape[0])
        request = structure_request(self, data.input_names)
        after_fit = hasattr(self, "model_")
        holds = after_fit or (
            not solver_of(self).moves_premises and isinstance(request.partition, TSKModel)
        )
        if after_fit:
            warn_of_fit(self)
            base = self.model_
        elif holds:
            base = held_model(request.partition, data)
        else:
            check_finds_structure(data.X.shape[0])
            self.fit(X, y, data.spread_weights(weight))
            base = self.model_
        rows = (data.X, data.y, weight) if kept is None else kept.rows
        stream = Stream.of(base, request.consequent_inputs, *rows)
        self._stream_settings = structure_settings(self)
        if holds:
            self.stiffness_, self.structures_ = 0.0, []
            self.robust_weights_ = self.validation_loss_curve_ = self.constraints_ = None
            self._learn_from(stream)
            self.readability_ = readability_of_rows(self.model_, data.X, data.y, weight)
        else:
            stream = stream.starting_from(found_weights(self))
            if stream.n_rows < data.X.shape[0]:
                self._learn_from(stream)
        return stream

    def _learn_from(self, stream):
        """The model of a stream."""
        solved = stream.solved(given_weights(self))
        self.model_ = solved.model.with_out_of_bounds(*policy_of(self.out_of_bounds))
        self.n_iter_ = 1
        self.loss_curve_ = np.full(2, solved.mean_squared_error)
        self.status_ = MESSAGES["no_premise"]
        keep_weights(self, solved.penalty)
        self.redundant_rules_ = solved.redundant_rules
        self._tell_noise()

    def _forget_chunks(self):
        """Nothing is left of rows that came in chunks."""
        for name in ("_stream", "_stream_settings", "_window", "n_samples_seen_"):
            self.__dict__.pop(name, None)

    def merge(self, *others: Any) -> Self:
        """Add up what models trained apart by ``partial_fit`` have seen.

        Parameters
        ----------
        *others : ANFISRegressor
            Trained by ``partial_fit``, on rows of their own, at the same premises: such as each
            with ``solver="lse"`` and the same model as ``partition``.

        Returns
        -------
        merged : ANFISRegressor
            With the parameters of this one, as after ``partial_fit`` with all rows. The models stay
            as they are. ``readability_`` it has after its next ``partial_fit``: it is of rows.
            Of models with a window the rows in it are added, and do not leave any more.

        Raises
        ------
        ValueError
            If a model has seen no chunk, or the premises, inputs or outputs differ; the message
            says in what.

        Examples
        --------
        >>> from skanfis import ANFISRegressor
        >>> from skanfis.datasets import make_jang_sinc
        >>> X, y = make_jang_sinc()
        >>> first = ANFISRegressor(n_mfs=4).fit(X, y)
        >>> devices = [ANFISRegressor(partition=first, solver="lse") for _ in range(2)]
        >>> devices[0] = devices[0].partial_fit(X[:60], y[:60])
        >>> devices[1] = devices[1].partial_fit(X[60:], y[60:])
        >>> devices[0].merge(devices[1]).n_samples_seen_
        121
        """
        models = (self, *others)
        streams = [stream_of(model, place) for place, model in enumerate(models)]
        stream = streams[0]
        for place, other in enumerate(streams[1:], start=1):
            check_same_premises(stream, other, place)
            stream = stream.plus(other)
        merged = copy(self)
        merged.__dict__.pop("readability_", None)
        merged._learn_from(stream)
        merged._stream, merged._window = stream, None
        merged.n_samples_seen_ = sum(model.n_samples_seen_ for model in models)
        return merged

    @property
    def information_(self) -> Information | None:
        """How well ``partial_fit`` has determined the consequents.

        None where the model has not been trained by it.
        """
        stream = getattr(self, "_stream", None)
        return None if stream is None else stream.information(found_weights(self))
