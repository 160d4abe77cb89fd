"""How a fitted estimator shows itself in notebooks: scikit-learn's diagram, and the rules below."""

__all__ = ["RulesReprMixin"]


class RulesReprMixin:
    """Adds the rules of a fitted estimator to scikit-learn's HTML representation of it.

    scikit-learn 1.6 and 1.9 make the representation in different places, but both reach it through
    the two methods here, and only while ``sklearn.set_config(display="diagram")`` holds. The import
    is inside, so that pandas is loaded only where there is something to show.
    """

    def _repr_html_inner(self):
        return super()._repr_html_inner() + self._rules_html()  # type: ignore[misc]

    def _repr_mimebundle_(self, **kwargs):
        bundle = super()._repr_mimebundle_(**kwargs)  # type: ignore[misc]
        if "text/html" in bundle:
            bundle["text/html"] += self._rules_html()
        return bundle

    def _rules_html(self):
        if not hasattr(self, "model_"):
            return ""
        from .inspection import rules_html

        return rules_html(self)
