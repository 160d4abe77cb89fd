"""The package as it is installed: every module, every way out, and the files beside the code.

`make test-wheel` runs these alone against the built wheel, away from the source: what a wheel may
lack is files, whole modules or the command, and what they compute is tested elsewhere.
"""

import pkgutil
from importlib import import_module
from importlib.metadata import entry_points, requires, version
from importlib.resources import files

import numpy as np
import pytest

import skanfis
from skanfis import ANFISRegressor, export, inspection
from skanfis.datasets import make_ofog
from skanfis.intervals import ConformalRegressor

X = np.random.default_rng(0).uniform(-1.0, 1.0, (100, 2))
Y = np.sin(3.0 * X[:, 0]) + X[:, 1]


@pytest.fixture(scope="module")
def model():
    return ANFISRegressor(n_mfs=[3, 1], agreement=0.01).fit(X, Y)


def test_every_module_can_be_imported():
    found = [module.name for module in pkgutil.walk_packages(skanfis.__path__, "skanfis.")]
    # The one that is not imported but run.
    names = [name for name in found if not name.endswith("__main__")]
    assert {f"skanfis.{part}" for part in ("gyro.displays", "export.c", "dask")} <= set(names)
    for name in names:
        import_module(name)


def test_types_are_announced():
    assert files("skanfis").joinpath("py.typed").is_file()


def test_metadata_are_those_of_the_package():
    assert version("skanfis") == skanfis.__version__
    needed = {line.split(">=")[0] for line in requires("skanfis") if "extra ==" not in line}
    assert {"numpy", "scipy", "scikit-learn"} <= needed


def test_the_command_is_there(capsys):
    (command,) = entry_points(group="console_scripts", name="skanfis-gyro")
    with pytest.raises(SystemExit, match="0"):
        command.load()(["--version"])
    assert capsys.readouterr().out == f"skanfis {skanfis.__version__}\n"


def test_every_text_that_a_model_is_written_to(model, tmp_path):
    assert "IF x0 is" in inspection.export_text(model)
    export.export_json(model, tmp_path / "m.json")
    export.export_fis(model, tmp_path / "m.fis")
    read = export.read_json(tmp_path / "m.json")
    np.testing.assert_array_equal(read.predict(X)[:, 0], model.predict(X))
    assert "m_predict" in export.export_c(model, tmp_path / "m").header
    rules = export.read_fis(tmp_path / "m.fis")
    np.testing.assert_allclose(rules.predict(X)[:, 0], model.predict(X), rtol=1e-6)
    sure = ConformalRegressor(model, method="split").fit(X, Y)
    assert (np.diff(np.stack(sure.predict_interval(X, 0.9)), axis=0) > 0.0).all()


def test_pictures(model):
    pytest.importorskip("matplotlib")
    display = inspection.MembershipDisplay.from_estimator(model)
    display.figure_.canvas.draw()
    assert len(display.figure_.axes) >= 1


def test_a_report_from_a_log(tmp_path):
    pytest.importorskip("matplotlib")
    main = import_module("skanfis.gyro.command").main
    log = make_ofog(n_devices=1, n_runs=3, duration=300.0, random_state=0)
    log[["time", "temperature", "output", "rate", "run"]].to_csv(tmp_path / "log.csv", index=False)
    arguments = ["--inputs", "temperature", "output", "--terms", "1,1", "--quiet"]
    arguments += ["--output", str(tmp_path / "out")]
    assert main([str(tmp_path / "log.csv"), *arguments]) == 0
    assert (tmp_path / "out" / "report.html").stat().st_size > 10_000
