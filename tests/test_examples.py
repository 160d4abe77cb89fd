"""The gyro example as a program: simulated, on a file, and told nonsense."""

import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import joblib
import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from skanfis.datasets import make_ofog

pytest.importorskip("matplotlib")
SCRIPT = Path(__file__).parents[1] / "examples" / "plot_gyro_compensation.py"
if not SCRIPT.is_file():
    pytest.skip("the examples are not here", allow_module_level=True)

PICTURES = {f"gyro_{name}.png" for name in ("comparison", "errors", "memberships", "output")}
COLUMNS = ["--temperature", "degC", "--rate", "counts", "--target", "true"]


def import_example():
    spec = spec_from_file_location("plot_gyro_compensation", SCRIPT)
    module = sys.modules[spec.name] = module_from_spec(spec)  # dataclasses look it up there
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def example():
    """The script as a module, with fewer data and a cheaper competitor."""
    module = import_example()
    simulate = module.simulate
    module.simulate = lambda: simulate(n_devices=2, n_runs=6, sampling_interval=60.0)
    module.N_ROWS_OF_GAUSSIAN_PROCESS = 100
    yield module
    del sys.modules[module.__name__]


@pytest.fixture(scope="module")
def study(example):
    return example.judge(example.simulated_campaign(example.simulate(), device=0))


@pytest.fixture
def table(example):
    """One gyro's measurements as a user may have them, with raw counts of the wrong sign."""
    gyro = example.simulate().query("device == 0")
    columns = {
        "seconds": gyro["time"],
        "degC": gyro["temperature"],
        "counts": -2000.0 * gyro["output"],
        "true": gyro["rate"],
        "label": "run " + gyro["run"].astype(str),
    }
    return pd.DataFrame(columns)


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


def run_on_csv(example, table, folder, *options):
    path = folder / "gyro.csv"
    table.to_csv(path, index=False)
    return example.main(["--csv", str(path), *options, "--output", str(folder / "made")])


def reduction_by_model_file(example, path, table, inputs, scale_factor):
    """By how much the saved model reduces the error in the runs that it was not trained on."""
    columns = example.Columns("degC", "counts", "true")
    campaign = example.make_campaign(table, columns, table["label"].to_numpy())
    test = table[example.hold_out(campaign)]
    error = scale_factor * test["counts"] - test["true"]
    residual = error - joblib.load(path).predict(test[inputs])
    assert residual.isna().mean() < 0.1
    return rms(error[residual.notna()]) / rms(residual.dropna())


def test_groups_held_out_are_apart_and_within_the_calibrated_temperatures(study):
    campaign, held_out = study.campaign, study.held_out
    calibrating, judging = campaign.groups[~held_out], campaign.groups[held_out]
    assert set(calibrating).isdisjoint(judging)
    assert len(set(judging)) == 2
    temperature = campaign.inputs["temperature"]
    assert temperature[~held_out].min() < temperature[held_out].min()
    assert temperature[~held_out].max() > temperature[held_out].max()


def test_table_of_merit_holds_what_it_says(example, study):
    table = example.table_of_merit(study)
    answered = study.judged
    assert answered.mean() > 0.9
    residual = study.residuals[example.CHOSEN][answered]
    row = table.loc[example.CHOSEN]
    assert row["RMS °/s"] == pytest.approx(rms(residual))
    assert row["RMS °/h"] == pytest.approx(3600 * rms(residual))
    assert row["RMS ppm"] == pytest.approx(1e6 * rms(residual) / study.campaign.full_scale)
    assert row["peak °/s"] == np.abs(residual).max()
    uncompensated = study.campaign.error[study.held_out][answered]
    assert row["reduction"] == pytest.approx(rms(uncompensated) / rms(residual))
    # Four runs calibrate here: enough for the sine, not for all of the temperature.
    assert row["reduction"] > 50
    assert row["reduction"] > 10 * table.loc["straight line", "reduction"]


def test_nonlinearity_is_that_of_the_scale_factor_alone(example):
    rate = np.linspace(-100.0, 100.0, 21)
    assert example.nonlinearity(3.0 * rate + 1.0, rate) == pytest.approx(0.0, abs=1e-9)
    # Of +1 and -1 by turns, as good as all is left by a line.
    assert example.nonlinearity(rate + (-1.0) ** np.arange(21), rate) == pytest.approx(1.0, rel=0.1)


@pytest.mark.parametrize("trained", [True, False])
def test_memberships_are_drawn_in_the_units_of_the_data(example, study, trained):
    pipeline, inputs = study.models[example.CHOSEN], study.campaign.inputs
    scaler, anfis = pipeline
    rule_base = anfis.model_.antecedent if trained else anfis.model_.initial_antecedent
    expected = np.exp(rule_base.log_memberships(scaler.transform(inputs).to_numpy().T))
    drawn = [
        np.exp(-0.5 * ((inputs[name] - center) / width) ** 2)
        for name in inputs
        for center, width in example.memberships_in_units(pipeline, name, trained)
    ]
    assert_allclose(drawn, expected, rtol=1e-9)


def test_verdict_names_whoever_is_better(example):
    residual = pd.Series({"straight line": 3.0, "cubic": 1.0, example.CHOSEN: 2.0})
    assert "cubic" in example.verdict(residual)
    assert "straight line" not in example.verdict(residual)
    assert "smallest" in example.verdict(residual.drop("cubic"))


def test_simulation_runs_through(example, tmp_path, capsys):
    assert example.main(["--output", str(tmp_path)]) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"compensator.joblib", *PICTURES}
    report = capsys.readouterr().out
    assert "equal to the last bit" in report
    assert "UnderdeterminedWarning: 36 rules with 3 coefficients" in report


def test_saved_model_predicts_the_same_to_the_last_bit(example, study, tmp_path):
    example.save_model(study, tmp_path / "model")
    inputs = study.campaign.inputs
    saved = joblib.load(tmp_path / "model").predict(inputs)
    assert saved.tobytes() == study.models[example.CHOSEN].predict(inputs).tobytes()


def test_file_with_time_and_groups(example, table, tmp_path):
    options = [*COLUMNS, "--time", "seconds", "--group", "label", "--scale-factor", "-0.0005"]
    assert run_on_csv(example, table, tmp_path, *options) == 0
    made = tmp_path / "made"
    assert {path.name for path in made.iterdir()} == {"compensator.joblib", *PICTURES}
    inputs = ["seconds", "degC", "counts"]
    path = made / "compensator.joblib"
    assert reduction_by_model_file(example, path, table, inputs, -0.0005) > 50


def test_file_without_time_and_groups(example, table, tmp_path, capsys):
    assert run_on_csv(example, table, tmp_path, *COLUMNS) == 0
    report = capsys.readouterr().out
    assert "12 contiguous blocks of rows" in report
    assert "levels" not in report
    assert "use: rate = -0.0005" in report


def test_levels_shared_by_groups_are_reported(example, capsys):
    few_levels = make_ofog(n_devices=1, n_runs=4, n_rate_levels=11, random_state=0)
    example.warn_of_levels(example.simulated_campaign(few_levels, device=0))
    assert "'rate' has only 11 levels" in capsys.readouterr().out


def spoil(table, column, value):
    """The table with another value in the fifth row, which is line 6 of the file."""
    values = table[column].astype(object)
    values.iloc[4] = value
    return table.assign(**{column: values})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.drop(columns="degC"), "No column 'degC'; the file has 'seconds', 'counts',"),
        (lambda t: spoil(t, "true", np.nan), "'true' has 1 missing or infinite values, the first"),
        (lambda t: spoil(t, "counts", np.inf), "infinite values, the first in line 6."),
        (lambda t: spoil(t, "counts", "n/k"), "'counts' has entries that are not numbers."),
        (lambda t: spoil(t, "label", None), "'label' has missing values."),
        (lambda t: t.assign(degC=20.0), "'degC' never changes"),
        (lambda t: t.assign(label="once"), "'label' has 1 groups; at least 4"),
        (lambda t: t.head(100), "100 rows are too few; at least 200"),
    ],
)
def test_file_that_cannot_be_used(example, table, tmp_path, capsys, change, message):
    assert run_on_csv(example, change(table), tmp_path, *COLUMNS, "--group", "label") == 2
    complaint = capsys.readouterr().err
    assert complaint.startswith("Error: ")
    assert message in complaint
    assert complaint.count("\n") == 1
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--csv", "nowhere.csv", *COLUMNS], "nowhere.csv cannot be read as a CSV file: No such"),
        (["--csv", "nowhere.csv", "--rate", "r"], "--csv needs --temperature, --target too."),
        (["--group", "run"], "--group tells of a file: give it by --csv."),
    ],
)
def test_options_that_cannot_be_used(example, capsys, options, message):
    assert example.main(options) == 2
    assert message in capsys.readouterr().err


def test_column_of_two_purposes(example, table, tmp_path, capsys):
    assert run_on_csv(example, table, tmp_path, *COLUMNS, "--group", "true") == 2
    assert "'true' was named for more than one purpose" in capsys.readouterr().err
