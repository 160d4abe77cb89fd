"""What watches a training from outside: a line of text, scikit-learn's callbacks."""

import sys
import time

__all__ = ["Callbacks", "Printer", "watch_all"]


def watch_all(*watchers):
    """Several watchers as one: every one sees every iteration, any one can end the run."""
    present = [watcher for watcher in watchers if watcher is not None]
    if not present:
        return None

    def watch(n_iter, evaluation):
        wishes = [watcher(n_iter, evaluation) for watcher in present]
        return any(wishes)

    return watch


class Printer:
    """Writes a line after every iteration to the standard output, as verbose does elsewhere."""

    def __init__(self, name):
        self._name, self._start = name, time.perf_counter()

    def tell_start(self, start):
        """Write what the structure and the weights are."""
        penalty, n_candidates = start.penalty, len(start.candidates)
        found = f"{n_candidates} candidates compared, " if n_candidates else ""
        self._write(
            f"{found}{start.antecedent.n_rules} rules, agreement {penalty.agreement:.3g}, "
            f"alpha {penalty.alpha:.3g}, stiffness {penalty.stiffness:.3g}"
        )

    def _write(self, text):
        sys.stdout.write(f"[{self._name}] {text}\n")
        sys.stdout.flush()

    def __call__(self, n_iter, evaluation):
        seconds = time.perf_counter() - self._start
        loss = evaluation.mean_squared_error
        self._write(f"iteration {n_iter}: loss {loss:.6g}, {seconds:.1f} s")
        return False


class Callbacks:
    """scikit-learn's callbacks: told of every iteration, and asked whether to go on.

    Parameters
    ----------
    estimator : ANFISRegressor
    context : sklearn.callback.CallbackContext
        Of the fit.
    data : dict
        "X", "y" and "metadata", as the user gave them.
    """

    def __init__(self, estimator, context, data):
        self.estimator, self.context, self.data = estimator, context, data

    def begin(self):
        """Tell of the beginning of the fit."""
        self.context.call_on_fit_task_begin(estimator=self.estimator, **self.data)

    def task(self, name, make_model):
        """Tell of a task that has just ended; whether a callback wants to stop.

        ``make_model`` makes the model as it is then, if a callback asks for it.
        """
        context = self.context.subcontext(task_name=name)
        context.call_on_fit_task_begin(estimator=self.estimator, **self.data)
        return self._end(context, make_model)

    def end(self, model):
        """Tell of the end of the fit."""
        self._end(self.context, lambda: model)

    def _end(self, context, make_model):
        return context.call_on_fit_task_end(
            estimator=self.estimator,
            reconstruction_attributes=lambda: {"model_": make_model()},
            **self.data,
        )
