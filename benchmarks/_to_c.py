"""Turns a scikit-learn model into C, in the converters' own environment.

``python _to_c.py MODEL.joblib CONVERTER`` prints the C code; ``python _to_c.py`` the folder of
emlearn's headers. Imports nothing of skanfis or of these benchmarks, which are not installed there.
"""

import sys

import joblib


def by_m2cgen(model):
    import m2cgen

    return m2cgen.export_to_c(model, function_name="m2cgen_score")


def by_emlearn(model):
    import emlearn

    name = type(model).__name__
    if name == "MLPRegressor":
        return emlearn.convert(model, return_type="regressor").save(name="mlp")
    converted = emlearn.convert(model, dtype="float", method="inline", return_type="regressor")
    return converted.save(name="forest")


def main(path=None, converter=None):
    if path is None:
        import emlearn

        return emlearn.includedir
    return {"m2cgen": by_m2cgen, "emlearn": by_emlearn}[converter](joblib.load(path))


if __name__ == "__main__":
    sys.stdout.write(main(*sys.argv[1:]))
