"""Two users' first hours, from nothing: install, paste, look. Run it with any Python 3.11 or newer.

    python .ci/first_hour.py           # or, in an environment that has it: ... PYTHON
                                       # (`make first-hour`: that of the built wheel)

In a folder away from the source, with an environment of its own, it installs the package as a user
does. A data scientist pastes README's code and the pages of docs/ that are there to be pasted, and
makes the mistakes that newcomers make; an inertial test engineer has raw logs of four kinds, and a
command. What it shows is what they see. It fails where one of these ends otherwise than in an
answer or in a sentence.
"""

import json
import re
import subprocess
import sys
import tempfile
import textwrap
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

README_BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PAGE_BLOCK = re.compile(r"^\.\. code-block:: python\n\n((?:   .*\n|\n)+)", re.MULTILINE)

# What newcomers type, and a part of the sentence that they are to get.
MISTAKES = {
    "a column of text": (
        """
        import pandas as pd
        from skanfis import ANFISRegressor
        table = pd.DataFrame({"age": [1.0, 2.0, 3.0], "site": ["a", "b", "c"]})
        ANFISRegressor().fit(table, [1.0, 2.0, 3.0])
        """,
        "text in column 'site', first at row 0",
    ),
    "MATLAB's name of a family": (
        """
        from skanfis import ANFISRegressor
        from skanfis.datasets import make_jang_sinc
        ANFISRegressor(n_mfs=2, mf="gbellmf").fit(*make_jang_sinc())
        """,
        "use mf='bell'",
    ),
    "a missing value": (
        """
        import numpy as np
        from skanfis import ANFISRegressor
        ANFISRegressor().fit([[1.0], [np.nan], [3.0]], [1.0, 2.0, 3.0])
        """,
        "NaN in column 'x0', first at row 1",
    ),
    "a picture without matplotlib": (
        """
        import sys
        sys.modules["matplotlib"] = sys.modules["matplotlib.pyplot"] = None
        from skanfis import ANFISRegressor
        from skanfis.datasets import make_jang_sinc
        from skanfis.inspection import MembershipDisplay
        MembershipDisplay.from_estimator(ANFISRegressor(n_mfs=2).fit(*make_jang_sinc()))
        """,
        "pip install matplotlib",
    ),
}

# A search over four values with five folds warns of rows that its folds leave out of range, as
# scikit-learn does of what does not converge: whoever knows of it filters it.
SEARCH = """
    import warnings
    from sklearn.datasets import load_diabetes
    from sklearn.model_selection import GridSearchCV
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler
    from skanfis import ANFISRegressor
    from skanfis.exceptions import OutOfBoundsWarning
    X, y = load_diabetes(return_X_y=True, as_frame=True)
    pipe = make_pipeline(StandardScaler(), ANFISRegressor(n_mfs=1))
    grid = {"anfisregressor__alpha": [0.01, 0.1, 1.0, 10.0]}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", OutOfBoundsWarning)
        search = GridSearchCV(pipe, grid).fit(X, y)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        search.predict(X.assign(bmi=9.0))
    assert len(caught) == 1
    print(caught[0].category.__name__, caught[0].message)
    assert "'x2' in 442 of 442 rows (trained on [-1.89" in str(caught[0].message)
"""


# Raw logs, as loggers write them. Only the first has the names that the command itself would give.
LOGS = """
    import numpy as np
    import pandas as pd
    from skanfis.datasets import make_ofog
    table = make_ofog(n_devices=1, n_runs=4, sampling_interval=60.0, random_state=0)
    three = table["run"].isin(table["run"].unique()[:3])
    plain = table.loc[three, ["time", "temperature", "output", "rate", "run"]]
    plain.to_csv("plain.csv", index=False)
    # Runs of an hour, two hours without power between them, on one clock.
    clock = table["time"] + 10_800.0 * table["run"].astype(float)
    moments = pd.Timestamp("2026-02-27 08:00") + pd.to_timedelta(clock, unit="s")
    local = pd.DataFrame({"Zeitstempel": moments.dt.strftime("%Y-%m-%dT%H:%M:%S.%f")})
    local["Temperatur [°C]"] = table["temperature"].round(3)
    local["Kreisel [°/s]"] = table["output"].round(6)
    local["Drehtisch Soll [°/s]"] = table["rate"]
    local["Bemerkung"] = "ok"
    two = table["run"].isin(table["run"].unique()[:2])
    local[two].to_csv("iso.csv", sep=";", decimal=",", index=False, encoding="cp1252")
    wide = pd.DataFrame({"t_ms": (1000.0 * clock).astype(int), "temp_c": table["temperature"]})
    wide = wide.assign(gyro_counts=table["counts"], rate_true_deg_s=table["rate"])
    wide.iloc[7, 1] = np.nan
    for run, rows in wide.groupby(table["run"]):
        rows.to_csv(f"utf16-{run}.txt", sep="\\t", index=False, encoding="utf-16")
    # A MEMS gyro at rest while the chamber goes down and up twice; its bias lags behind.
    rng = np.random.default_rng(0)
    t = np.arange(0.0, 14_400.0, 20.0)
    chamber = 25.0 + 45.0 * np.sin(2 * np.pi * t / 7200.0)
    drift = 0.3 + 4e-3 * chamber + 2e-5 * chamber**2 + 3.0 * np.gradient(chamber, t)
    noise = 0.01 * rng.standard_normal(t.size)
    mems = pd.DataFrame({"Time [s]": t, "Temp (degC)": chamber, "Gyro Z (dps)": drift + noise})
    mems.to_csv("mems.csv", index=False)
"""
# Arguments, and a part of what is to be told. The first log and the last are left to the command
# wholly; of the others it is the reading that differs, and the search for terms takes longest.
COMMANDS = {
    "plain, and what it gives as C": (["plain.csv", "--c", "c99"], "as recommended"),
    "ISO 8601, semicolons, decimal commas, an encoding of Windows, two runs": (
        ["iso.csv", "--terms", "2,1,2"],
        "split into 2 runs",
    ),
    "UTF-16, tabs, counts, a file for each run, a row without its temperature": (
        [*(f"utf16-{run}.txt" for run in range(4)), "--terms", "1,2,1,1"],
        "temp_c",
    ),
    "a thermal cycle of a MEMS gyro at rest": (["mems.csv"], "5 legs"),
}
SHORT = {
    "which version": (["--version"], "skanfis "),
    "what the compensator does to a flight": (
        ["--apply", "made plain, and what it gives as C/compensator.json", "plain.csv"],
        "compensated",
    ),
}
# And what is to end in one sentence.
REFUSED = {
    "no such file": (["nowhere.csv"], "nowhere.csv"),
    "a column that is not there": (["plain.csv", "--columns", "rate=truth"], "rate=rate"),
    "more rules than atoms": (["plain.csv", "--terms", "99999999,1,1,1"], "--terms"),
    "the same file twice": (["plain.csv", "plain.csv"], "plain.csv"),
}


# Each by itself, in a namespace with nothing in it, but all in one interpreter: what takes time is
# to import the libraries.
SESSION = """
    import contextlib, io, json, sys, traceback
    for code in json.loads({codes!r}):
        status, told = 0, io.StringIO()
        with contextlib.redirect_stdout(told), contextlib.redirect_stderr(told):
            try:
                exec(compile(code, "pasted.py", "exec"), {{"__name__": "__main__"}})
            except SystemExit as error:
                status = error.code
            except BaseException:
                status = 1
                traceback.print_exc()
        print(json.dumps([status, told.getvalue()]))
"""
COMMAND = """
    import sys
    from skanfis.gyro.command import main
    sys.exit(main({arguments!r}))
"""


def blocks(path, pattern):
    found = pattern.findall(path.read_text(encoding="utf-8"))
    return [textwrap.dedent(block) for block in found]


def run(python, code, folder):
    """Paste code into a fresh interpreter; what it prints, and whether it failed."""
    (folder / "pasted.py").write_text(textwrap.dedent(code), encoding="utf-8")
    options = {"capture_output": True, "text": True, "encoding": "utf-8", "cwd": folder}
    done = subprocess.run([python, "-X", "utf8", "pasted.py"], **options)
    return done.returncode, done.stdout + done.stderr


def session(python, codes, folder):
    """Paste one code after another into one interpreter; whether each failed, and what it told."""
    codes = [textwrap.dedent(code) for code in codes]
    crashed, told = run(python, SESSION.format(codes=json.dumps(codes)), folder)
    answers = [json.loads(line) for line in told.splitlines() if line.startswith("[")]
    if crashed or len(answers) != len(codes):
        sys.exit(f"the interpreter that code is pasted into ended:\n{told}")
    return answers


def install(folder):
    """An environment with the package in it; its Python."""
    venv.create(folder / "environment", with_pip=True)
    place = "Scripts/python.exe" if sys.platform == "win32" else "bin/python"
    python = str(folder / "environment" / place)
    subprocess.run([python, "-m", "pip", "install", "--quiet", f"{ROOT}[plot]"], check=True)
    return python


def command(python, arguments, folder):
    """Run the gyro command as a user does; whether it failed, and what it says."""
    options = {"capture_output": True, "text": True, "encoding": "utf-8", "cwd": folder}
    given = [python, "-X", "utf8", "-m", "skanfis.gyro", *arguments]
    done = subprocess.run(given, **options)
    return done.returncode, done.stdout + done.stderr


def engineer(python, folder):
    """Logs, a report for each, and mistakes; titles of what did not go as it should."""
    failed, told = run(python, LOGS, folder)
    if failed:
        yield f"writing logs: {told}"
        return
    typed = {
        title: ([*arguments, "--output", f"made {title}"], part)
        for title, (arguments, part) in COMMANDS.items()
    }
    typed |= SHORT | REFUSED
    # The first by itself: the module is run, and everything that it needs is imported by itself.
    first, *others = ([*arguments] for arguments, _ in typed.values())
    codes = [COMMAND.format(arguments=arguments) for arguments in others]
    answers = [command(python, first, folder), *session(python, codes, folder)]
    for (title, (_, part)), (failed, told) in zip(typed.items(), answers, strict=True):
        print(f"=== {title}\n{told}")
        unlike = bool(failed) is not (title in REFUSED) or part not in told or "Traceback" in told
        if unlike or (title in COMMANDS and not (folder / f"made {title}/report.html").is_file()):
            yield title


def data_scientist(python, folder):
    """Everything in order; titles of what did not go as it should."""
    pastes = {
        f"README.md, block {i}": code
        for i, code in enumerate(blocks(ROOT / "README.md", README_BLOCK), start=1)
    }
    for page in ("quickstart", "from_matlab"):
        pastes[f"docs/{page}.rst"] = "".join(blocks(ROOT / "docs" / f"{page}.rst", PAGE_BLOCK))
    pastes["a search"] = SEARCH
    mistakes = [code for code, _ in MISTAKES.values()]
    answers = session(python, [*pastes.values(), *mistakes], folder)
    for title, (failed, told) in zip([*pastes, *MISTAKES], answers, strict=True):
        print(f"=== {title}\n{told}")
        if title in pastes:
            unlike = bool(failed)
        else:
            unlike = not failed or MISTAKES[title][1] not in told.strip().splitlines()[-1]
        if unlike:
            yield title


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        python = sys.argv[1] if len(sys.argv) == 2 else install(folder)
        failed = [*data_scientist(python, folder), *engineer(python, folder)]
    print(f"FAILED: {', '.join(failed)}" if failed else "Both hours went as they should.")
    return bool(failed)


if __name__ == "__main__":
    sys.stdout.reconfigure(encoding="utf-8", line_buffering=True)
    sys.exit(main())
