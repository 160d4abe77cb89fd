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
    "skanfis.bounds.constraints.FixedPoint",
    "skanfis.bounds.constraints.OutputLimits",
    "skanfis.learning.data.Scale",
    "skanfis.gyro.compose.ResidualRegressor",
    "skanfis.gyro.features.ThermalRate",
    "skanfis.gyro.physics.OpenLoopArcsineRegressor",
    "skanfis.intervals.conformal.ConformalRegressor",
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
    "skanfis.options.EarlyStopping",
    "skanfis.options.Huber",
    "skanfis.options.LinearExtrapolation",
    "skanfis.learning.penalty.Penalty",
    "skanfis.posterior.Posterior",
    "skanfis.inspection.measures.Measures",
    "skanfis.inspection.readability.Readability",
    "skanfis.regressor.ANFISRegressor",
    "skanfis.learning.descent.GradientDescent",
    "skanfis.learning.descent.Hybrid",
    "skanfis.learning.solver.LeastSquares",
    "skanfis.learning.varpro.VariableProjection",
    "skanfis.training.chunks.RowSums",
    "skanfis.support.RuleSupport",
    "skanfis.policies.TargetRange",
]
