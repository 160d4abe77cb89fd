"""What watches a training from outside: a line of text, scikit-learn's callbacks."""

import sys
import time

__all__ = ["CallbackBridge", "Printer", "watch_all"]


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

    def note(self, text):
        """Write a line of one's own."""
        sys.stdout.write(f"[{self._name}] {text}\n")
        sys.stdout.flush()

    def __call__(self, n_iter, evaluation):
        seconds = time.perf_counter() - self._start
        loss = evaluation.mean_squared_error
        self.note(f"iteration {n_iter}: loss {loss:.6g}, {seconds:.1f} s")
        return False


class CallbackBridge:
    """Tells scikit-learn's callbacks of every iteration, and passes their wish to stop on.

    Parameters
    ----------
    estimator : estimator
        With ``_init_callback_context`` where this scikit-learn has callbacks.
    context : sklearn.callback.CallbackContext
        Of the fit.
    data : dict
        "X", "y" and "metadata", as callbacks are given them.
    attributes : callable
        The fitted attributes of the estimator at an evaluation.
    """

    def __init__(self, estimator, context, data, attributes):
        self.estimator, self.context, self.data = estimator, context, data
        self.attributes = attributes

    def begin(self):
        """Tell of the beginning of the fit."""
        self.context.call_on_fit_task_begin(estimator=self.estimator, **self.data)

    def task(self, name, *state):
        """Tell of a task that has just ended; whether a callback wants to stop."""
        context = self.context.subcontext(task_name=name)
        context.call_on_fit_task_begin(estimator=self.estimator, **self.data)
        return context.call_on_fit_task_end(
            estimator=self.estimator,
            reconstruction_attributes=lambda: self.attributes(*state),
            **self.data,
        )

    def end(self, *state):
        """Tell of the end of the fit."""
        self.context.call_on_fit_task_end(
            estimator=self.estimator,
            reconstruction_attributes=lambda: self.attributes(*state),
            **self.data,
        )
