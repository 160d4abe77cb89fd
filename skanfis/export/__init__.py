"""Export of trained models to other formats and languages: JSON, .fis, C, ONNX."""

from ..membership import FAMILIES
from .c import CCode, CCost, export_c
from .fis import export_fis, read_fis
from .folding import fold, fold_with_rows
from .model_json import export_json, read_json
from .onnx import register_onnx_converter

__all__ = [
    "TRUSTED_TYPES",
    "CCode",
    "CCost",
    "export_c",
    "export_fis",
    "export_json",
    "fold",
    "fold_with_rows",
    "read_fis",
    "read_json",
    "register_onnx_converter",
]

#: Every type of skanfis that a fitted estimator may hold, for
#: ``skops.io.load(path, trusted=TRUSTED_TYPES)``. Loading them runs no code. Other steps of a
#: pipeline are scikit-learn's own, which skops knows.
TRUSTED_TYPES = [
    *(f"{family.__module__}.{family.__name__}" for family in FAMILIES.values()),
    "skanfis.antecedent.base.TermGroup",
    "skanfis.antecedent.grid.GridAntecedent",
    "skanfis.antecedent.rule_table.RuleTableAntecedent",
    "skanfis.antecedent.tree.TreeAntecedent",
    "skanfis.cluster.fuzzy_cmeans.FuzzyCMeans",
    "skanfis.cluster.subtractive.SubtractiveClustering",
    "skanfis.bounds.constraints.FixedPoint",
    "skanfis.bounds.constraints.OutputLimits",
    "skanfis.learning.data.Scale",
    "skanfis.gyro.compose.ResidualRegressor",
    "skanfis.gyro.physics.OpenLoopArcsineRegressor",
    "skanfis.gyro.thermal_rate.ThermalRate",
    "skanfis.intervals.conformal.ConformalRegressor",
    "skanfis.model.TSKModel",
    "skanfis.options.EarlyStopping",
    "skanfis.options.Huber",
    "skanfis.options.LinearExtrapolation",
    "skanfis.posterior.Posterior",
    "skanfis.inspection.measures.Measures",
    "skanfis.inspection.readability.Readability",
    "skanfis.regressor.ANFISRegressor",
    "skanfis.learning.descent.GradientDescent",
    "skanfis.learning.descent.Hybrid",
    "skanfis.learning.solver.LeastSquares",
    "skanfis.learning.varpro.VariableProjection",
    "skanfis.training.chunks.RowSums",
    "skanfis.training.rule_rows.RuleRows",
    "skanfis.support.RuleSupport",
    "skanfis.policies.TargetRange",
]
