"""Reading a log, and refusing what no compensator should learn from."""

import numpy as np
import pandas as pd
import pytest

from skanfis.datasets import make_ofog
from skanfis.gyro import LogError, check_log, read_log
from skanfis.gyro._checks import check_at_rest
from skanfis.gyro._oddities import find_glitches, find_standing_thermometer

CALLED_T = {"columns": {"temperature": "T"}}
MEASURED = ["time", "temperature", "output", "rate", "run"]


@pytest.fixture
def log():
    return make_ofog(n_devices=1, n_runs=3, duration=600.0, random_state=0)[MEASURED]


def written(folder, text, name="log.csv"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def table(folder, log, name="log.csv", **options):
    path = folder / name
    log.to_csv(path, index=False, **options)
    return path


@pytest.mark.parametrize(
    ("device", "run", "labels"),
    [
        (["a", "a", "b", "b"], [1, 2, 1, 2], ["a / 1", "a / 2", "b / 1", "b / 2"]),
        # Blanks at their ends are none of theirs.
        (["a", "a ", "a"], ["1 ", " 1", "2"], ["1", "1", "2"]),
        # Those that read alike are numbered.
        (["x", "x / y", "w"], ["y / z", "z", "z"], ["x / y / z", "x / y / z (2)", "w / z"]),
    ],
)
def test_runs_of_two_devices_are_told_apart(tmp_path, device, run, labels):
    frame = pd.DataFrame({"device": device, "run": run}).assign(temperature=20, output=1, rate=1)
    assert list(read_log(table(tmp_path, frame))["run"]) == labels


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        ("temp,output,rate\n1,2,3\n", {}, "no column 'temperature' .* temperature=temp"),
        ("run,output,rate\n1,2,3\n", {}, "no column 'temperature' .* temperature=NAME"),
        ("temperature,output,rate\n1,2,3\n1,2,x\n", {}, r"line 3, column 'rate': 'x' is not a num"),
        ("temperature,output,rate\n1,2,3\n\n1,,3\n", {}, r"line 4, column 'output': .* missing"),
        ("T,output,rate\n1,2,3\n,2,3\n", CALLED_T, r"line 3, column 'T' \(temperature\)"),
        ("temperature,output,rate\n1,2,inf\n", {}, r"line 2, column 'rate': .* infinite"),
        ("temperature,output,rate\n1,2,3\n\n1,2,3,4,5\n", {}, "line 4: has . values"),
        ('temperature,output,rate\n1,2,"3\n', {}, "is no table"),
        ("temperature,output,rate,run\n1,2,3,\n", {}, "line 2, column 'run': the label is missing"),
        ("temperature,output,rate\n1,2,3\n", {"columns": {"rate": "output"}}, "'output' cannot"),
        ("temperature,output,rate\n1,2,3\n", {"columns": {"time": "t"}}, "'t' for the time"),
        ("temperature,output,rate,rate\n1,2,3,4\n", {}, "header has 'rate' and 'rate'; which"),
        ('a,temperature,output,rate\n"b,\nc",1,2,x\n', {}, "line 2, column 'rate': 'x' is not"),
        ('a,temperature,output,rate\n"b\nc",1,2,3\n"d",1,2,3,4\n', {}, "line 4: has 5 values"),
        (f"temperature,output,rate\n1,2,{'3' * 200_000}x\n", {}, "line 2, column 'rate'"),
    ],
)  # fmt: skip
def test_files_that_are_refused(tmp_path, text, options, message):
    with pytest.raises(LogError, match=message):
        read_log(written(tmp_path, text), **options)


@pytest.mark.parametrize("note", ['"a, b,\nc, d"', '"say ""so"", twice"', f'"{200_000 * "long,"}"'])
def test_quotes_hide_separators_and_line_ends(tmp_path, note):
    text = f"note,temperature,output,rate,run\n{note},20,1,2,{note}\n\nb,21,3,4,b\n"
    read = read_log(written(tmp_path, text))
    assert read["rate"].tolist() == [2.0, 4.0]
    assert set(read["run"]) == {note[1:-1].replace('""', '"'), "b"}


@pytest.mark.parametrize(
    ("header", "columns"),
    [
        (" Temperature ,OUTPUT\t, Rate,x", {}),
        # A name that fits to the letter comes first, and a column plays one part.
        ("temperature,Output,rate,Rate", {"output": "Output"}),
        ("temperature,speed,Output,x", {"rate": "Output", "output": "speed"}),
    ],
)
def test_names_of_columns_up_to_blanks_and_capitals(tmp_path, header, columns):
    read = read_log(written(tmp_path, f"{header}\n20,1,2,9\n"), columns=columns)
    assert read.to_dict("records") == [{"temperature": 20.0, "output": 1.0, "rate": 2.0}]


def test_files_that_are_no_log_together_are_refused(tmp_path, log):
    path = table(tmp_path, log)
    for again in (path, table(tmp_path, log, "a.csv")):
        with pytest.raises(LogError, match=rf"{again.name}: holds the same bytes as .*log.csv"):
            read_log([path, again])
    with pytest.raises(LogError, match=r"b.csv: some of the files have no column for the time"):
        read_log([path, table(tmp_path, log.drop(columns="time"), "b.csv")])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"columns": {"speed": "v"}}, "columns: there is no 'speed'"),
        ({"units": {"run": "s"}}, "units: there is no 'run'"),
        ({"units": {"time": "deg/s"}}, "time has no unit 'deg/s'.* s, ms"),
        ({"units": {"time": 1}}, "time has no unit 1: it may be in s, ms"),
        ({"require": ["speed"]}, "require: there is no 'speed'"),
    ],
)
def test_unknown_names_are_no_matter_of_the_log(tmp_path, log, options, message):
    with pytest.raises(ValueError, match=message) as caught:
        read_log(table(tmp_path, log), **options)
    assert not isinstance(caught.value, LogError)


def test_good_logs_pass(log):
    assert check_log(log, inputs=("time", "temperature", "temperature_rate", "output")) is log
    check_log(log.assign(output=-3e4 * log["output"]), units={"output": "counts"})
    # A coarse output stands at its ends too, and is not saturated.
    for unit in (1.0, 5.0, 20.0):
        check_log(log.assign(output=unit * (log["output"] / unit).round()))
    check_log(log.sort_values("time", kind="stable").reset_index(drop=True))


def bad(part, row, value):
    return lambda log: log.assign(**{part: log[part].mask(log.index == row, value)})


def scaled(part, factor):
    return lambda log: log.assign(**{part: factor * log[part]})


def of_today(log):
    """Stamps of the time, of which one falls by little."""
    times = 1_767_225_600.0 + log["time"] + 3600.0 * log["run"]
    return log.assign(time=times.mask(log.index == 11, times[10] - 0.05))


TO_RADIANS = np.pi / 180


@pytest.mark.parametrize(
    ("spoil", "column", "row", "message"),
    [
        (bad("output", 7, np.nan), "output", 7, "missing"),
        (bad("rate", 9, np.inf), "rate", 9, "infinite"),
        (bad("run", 4, np.nan), "run", 4, "label is missing"),
        (bad("temperature", 5, -999.0), "temperature", 5, "not plausible"),
        (lambda log: log.assign(temperature=270 + log.index), "temperature", 0, "is it in K"),
        (scaled("rate", 3600), "rate", 0, "is it in deg/h"),
        (bad("time", 11, 100.0), "time", 11, r"not increase .*\(1 such row\)"),
        (of_today, "time", 11, r"1767225699.95 s after 1767225700 s"),
        (lambda log: log.drop(columns="run"), "time", 60, "which column tells them apart"),
        (scaled("time", 1e6), "time", None, "smaller unit than s"),
        (scaled("time", 1e-4), "time", None, "larger unit than s"),
        (lambda log: log[log["run"] == 0], "temperature", None, "at least 10 degC"),
        (lambda log: log.iloc[:3], None, None, "has 3 rows; it takes 20"),
        (lambda log: log.assign(rate=0.0), "rate", None, "leave output out"),
        (lambda log: log.assign(rate=5.0), "rate", None, r"Log at several rates\.$"),
        (lambda log: log.assign(output=log["output"].clip(upper=40.0)), "output", 36, "saturated"),
        (lambda log: log.assign(output=log["rate"]), "output", None, "one of them is not that"),
        (lambda log: log.assign(output=log["temperature"]), "output", None, "does not follow"),
        (scaled("output", -1), "output", None, "sign is reversed"),
        (scaled("output", TO_RADIANS), "output", None, "is the output in rad/s"),
        (scaled("rate", TO_RADIANS), "output", None, "the rate in rad/s"),
        (scaled("output", 3), "output", None, "are the units right"),
        (lambda log: log.assign(run=np.arange(len(log))), "run", None, "180 runs in 180 rows are"),
    ],
)
def test_logs_that_are_refused(log, spoil, column, row, message):
    with pytest.raises(LogError, match=message) as caught:
        check_log(spoil(log).reset_index(drop=True))
    assert (caught.value.column, caught.value.row) == (column, row)


def test_a_log_without_an_input_or_beyond_any_converter_is_refused(log):
    for part, name in (("output", "output"), ("time", "temperature_rate")):
        with pytest.raises(LogError, match=f"the log has no {part}"):
            check_log(log.drop(columns=part), inputs=[name])
    for factor in (1e-40, 1e40):
        with pytest.raises(LogError, match="counts are not plausible"):
            check_log(scaled("output", factor)(log), units={"output": "counts"})


def test_a_gyro_at_rest_that_is_stuck_is_told_from_one_of_a_coarse_output():
    rng, n_rows = np.random.default_rng(0), 6000
    temperature = 20.0 + 40.0 * np.sin(np.arange(n_rows) / 600.0)
    log = pd.DataFrame({"time": np.arange(n_rows), "temperature": temperature})
    noise, bias = rng.normal(size=n_rows), 0.05 * temperature
    stuck = bias + noise
    stuck[2000:2200] = 7.0
    for decimals in (9, 0):
        with pytest.raises(LogError, match="in 200 rows on end, and has noise") as caught:
            check_log(log.assign(output=stuck.round(decimals)), inputs=["temperature"])
        assert (caught.value.column, caught.value.row) == ("output", 2000)
    for size in (0.0, 0.1, 0.3, 0.5, 1.0):
        # Rounded values, and a counter of pulses, which are of the angle: in 200 rows on end both
        # may be equal.
        coarse = (bias + size * noise).round()
        pulses = np.diff(np.floor(np.cumsum(bias + size * noise)), prepend=0.0)
        for output in (coarse, pulses):
            check_log(log.assign(output=output), inputs=["temperature"])


def test_a_log_at_rest_is_told_from_one_that_moves(log):
    at_rest = make_ofog(n_devices=1, n_runs=3, rates=[0.0], profile="ramps", random_state=0)
    check_at_rest(at_rest, "deg/s")
    check_at_rest(at_rest.assign(output=3e4 * at_rest["output"]).round(0), "counts")
    check_at_rest(at_rest.assign(rate=0.0042), "deg/s")
    with pytest.raises(LogError, match="deg/s: the gyro was not at rest") as caught:
        check_at_rest(log, "deg/s")
    assert (caught.value.column, caught.value.row) == ("rate", log["rate"].abs().idxmax())
    unknown = log.drop(columns="rate")
    with pytest.raises(LogError, match=r"spans -\d+\S* to \d+\S* deg/s: no bias does"):
        check_at_rest(unknown, "deg/s")
    levels = unknown.assign(output=np.random.default_rng(0).normal(size=len(log)))
    check_at_rest(levels, "counts")
    levels["output"] += 300.0 * (np.arange(len(log)) // 10 % 3)
    with pytest.raises(LogError, match=r"jumps \d+ times by more than 20 times its usual step"):
        check_at_rest(levels, "counts")


def test_a_value_that_is_implausible_is_named_as_the_file_has_it(log):
    colder = log["temperature"].where(log.index != 5, -237.0 * 5.0 / 9.0 - 160.0 / 9.0)
    with pytest.raises(LogError, match=r"^column 'temperature', row 5: -149.4 degC \(-237 in degF"):
        check_log(log.assign(temperature=colder), units={"temperature": "degF"})


def simulated(**options):
    return make_ofog(n_devices=1, n_runs=4, duration=900.0, random_state=0, **options)


def glitches(log):
    return [row for row, _ in find_glitches(log, (log["output"] - log["rate"]).to_numpy())]


@pytest.mark.parametrize(("part", "by"), [("output", 20.0), ("rate", -50.0), ("temperature", 40.0)])
def test_one_row_that_no_other_supports_is_named(part, by):
    log, row = simulated(), 77
    log.loc[row, part] += by
    assert glitches(log) == [row]


@pytest.mark.parametrize("part", ["time", "temperature", "output", "rate"])
def test_check_log_names_a_column_that_holds_no_numbers(part):
    """As pandas reads decimal commas, dates and durations."""
    log = simulated(sampling_interval=60.0)
    for values in (log[part].astype(str), log[part].astype(object), pd.to_timedelta(log[part])):
        with pytest.raises(LogError, match=f"column '{part}': is of type .*; it must"):
            check_log(log.assign(**{part: values}))


def test_glitches_are_named_that_the_curve_of_the_gyro_would_hide():
    """The sine of the open loop leaves 4 deg/s; rows of a minute are far apart in rate."""
    log = make_ofog(n_devices=1, n_runs=6, sampling_interval=60.0, random_state=0)
    rows = [60, 150, 290]
    log.loc[rows, "output"] += [3.0, -4.0, 2.0]
    assert glitches(log) == rows


def test_more_outputs_than_are_named_are_counted():
    log = simulated(sampling_interval=2.0)
    rows = [77, 300, 500, 901, 1200]
    log.loc[rows, "output"] += [-70.0, 200.0, 30.0, 90.0, -50.0]
    named = dict(find_glitches(log, (log["output"] - log["rate"]).to_numpy()))
    assert list(named) == [77, 300, 901]  # the largest
    assert [row for row, told in named.items() if "(and that of 2 rows more)" in told] == [77]


def test_however_many_temperatures_are_glitches_and_a_step_is_none():
    log = simulated(sampling_interval=2.0)
    cold = log.loc[log.index[::400], "temperature"].index
    log.loc[cold, "temperature"] = 85.0  # a thermometer that starts anew
    named = find_glitches(log, (log["output"] - log["rate"]).to_numpy())
    assert [row for row, _ in named] == cold[:3].tolist()
    assert named[2][1] == f"the temperature of 85 degC (and that of {cold.size - 3} rows more)"
    # Soaks, with nothing logged on the way from one to the next.
    soak = np.repeat([-20.0, 60.0, 20.0], len(log) // 3 + 1)[: len(log)]
    assert glitches(log.assign(temperature=soak, run=0)) == []
    # Runs of two rows, with the step within one.
    assert glitches(log[1:].assign(temperature=soak[1:], run=np.arange(1, len(log)) // 2)) == []


@pytest.mark.parametrize(
    "options", [{}, {"profile": "ramps"}, {"profile": "ramps", "rates": [-100, 0, 100]}]
)
def test_sound_logs_have_no_glitches(options):
    log, g = simulated(**options), np.random.default_rng(0)
    assert glitches(log) == []
    # Digits lost, and noise of heavy tails.
    assert glitches(log.round({"temperature": 0, "output": 2})) == []
    assert glitches(log.assign(output=log["output"] + 0.05 * g.standard_t(3, len(log)))) == []


def test_an_output_saturated_at_one_rate_of_a_table_is_refused(rng):
    log = simulated(rates=[-100.0, -50.0, 0.0, 50.0, 100.0], sampling_interval=10.0)
    counts = (1e3 * log["output"] + 5.0 * rng.normal(size=len(log))).round()
    check_log(log.assign(output=counts), units={"output": "counts"})
    clipped = log.assign(output=counts.clip(lower=0.9 * counts.min()))
    with pytest.raises(LogError, match=r"in 72 rows at -100 deg/s, and has noise at other rates"):
        check_log(clipped, units={"output": "counts"})
    # A coarse output has no noise anywhere, and at rest no gyro is saturated.
    check_log(log.assign(output=(0.1 * log["output"]).round()), units={"output": "counts"})
    rest = log.assign(output=counts.where(log["rate"] > 0.0, 0.0))[log["rate"] >= 0.0]
    check_log(rest.reset_index(drop=True), units={"output": "counts"})


def test_a_thermometer_that_is_stuck_in_a_run_is_named():
    log = simulated(sampling_interval=10.0)
    assert find_standing_thermometer(log) == []
    stuck = log["temperature"].where(log["run"] != 2, 25.0)
    assert find_standing_thermometer(log.assign(temperature=stuck)) == [2]
    # Half of all runs at a soak, with a coarse thermometer: none stands out.
    coarse = log["temperature"].where(log["run"] > 1, 25.0).round(-1)
    assert find_standing_thermometer(log.assign(temperature=coarse)) == []
    assert find_standing_thermometer(log.drop(columns="run").assign(temperature=stuck)) == []


def test_an_output_too_late_to_follow_the_rate_is_told_by_how_much(rng):
    log = simulated(sampling_interval=10.0).assign(run=0)
    log["rate"] = rng.uniform(-100.0, 100.0, len(log))
    for rows, told in ((3, "3 rows before"), (-1, "1 row after")):
        late = log["rate"].shift(rows, fill_value=0.0) + 0.1
        with pytest.raises(LogError, match=rf"wrong one\? It follows that of {told}: align the"):
            check_log(log.assign(time=np.arange(len(log)), output=late))


def test_an_output_that_is_stuck_is_refused_wherever_it_stands(log):
    """Also where the rest of the log follows the rate so well that no correlation tells it."""
    for n_rows in (20, 90):
        stuck = log.copy()
        stuck.loc[40 : 39 + n_rows, "output"] = log["output"].abs().min()
        told = rf"stands at \S+ in {n_rows} rows on end, at rates from .* deg/s: it is stuck"
        with pytest.raises(LogError, match=told) as caught:
            check_log(stuck)
        assert (caught.value.column, caught.value.row) == ("output", 40)
