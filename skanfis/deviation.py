"""Local shim until C deviations are removed."""

DerivativeRows = DeviationTables = rulers = None
