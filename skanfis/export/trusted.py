"""The types that a model of this package is made of, for loaders that want them listed."""

__all__ = ["TRUSTED_TYPES"]

#: Every type of skanfis that a fitted estimator may hold. None of them runs anything when it is
#: loaded. ``skops.io.load(path, trusted=TRUSTED_TYPES)``; what stands beside them in a pipeline
#: is scikit-learn's own, which skops knows.
TRUSTED_TYPES = [
    "skanfis.antecedent.base.TermGroup",
    "skanfis.antecedent.grid.GridAntecedent",
    "skanfis.antecedent.rule_table.RuleTableAntecedent",
    "skanfis.antecedent.scattered.ScatteredAntecedent",
    "skanfis.cluster.fuzzy_cmeans.FuzzyCMeans",
    "skanfis.cluster.subtractive.SubtractiveClustering",
    "skanfis.membership.bell.Bell",
    "skanfis.membership.flanked.PiShaped",
    "skanfis.membership.flanked.SShaped",
    "skanfis.membership.flanked.Trapezoidal",
    "skanfis.membership.flanked.Triangular",
    "skanfis.membership.flanked.TwoSidedGaussian",
    "skanfis.membership.flanked.ZShaped",
    "skanfis.membership.gaussian.Gaussian",
    "skanfis.membership.sigmoid.SigmoidDifference",
    "skanfis.membership.sigmoid.SigmoidProduct",
    "skanfis.model.TSKModel",
    "skanfis.model.TargetRange",
    "skanfis.posterior.Posterior",
    "skanfis.readable.measures.Measures",
    "skanfis.readable.report.Readability",
    "skanfis.regressor.ANFISRegressor",
    "skanfis.support.RuleSupport",
]
