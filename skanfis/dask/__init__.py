"""Training and prediction on a dask cluster: each pass over the rows is a reduction there."""

from .estimator import DaskANFISRegressor

__all__ = ["DaskANFISRegressor"]
