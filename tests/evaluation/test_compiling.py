"""Machine code: its numbers are Python's, nobody waits for it unasked, no file stops anybody."""

import os
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from sympy import Max, Piecewise, Rational, acos, atan2, cos, floor, log, sin, sqrt

from kfsheet import (
    RMS,
    Largest,
    Last,
    Mean,
    Missing,
    ModelError,
    Recurrence,
    Smallest,
    Std,
    Sum,
    evaluate,
    study,
    t,
    warm_up,
    when_observed,
)
from kfsheet.ensemble import executors
from kfsheet.ensemble import study as study_module
from kfsheet.ensemble.study import ARRAYS
from kfsheet.errors import EngineError, WorkbookError
from kfsheet.evaluation import compiling, model_cache
from kfsheet.evaluation import evaluate as evaluation
from kfsheet.evaluation.compiling import compiled_function, is_ready
from kfsheet.evaluation.kernel import kernel_of
from kfsheet.evaluation.model_cache import cache_of
from kfsheet.exercises.cannonball import cannonball
from kfsheet.exercises.football import football

pytest.importorskip("numba")
ROWS = 25


def mixed():
    """Lags, start rows, gaps, several passes and every kind of function."""
    m = Recurrence("mixed", title="A bit of everything")
    a = m.parameter("a", 0.3, "", "a", sign="positive")
    p = m.parameter("p", 1.5, "", "an exponent")
    values = np.random.RandomState(1).standard_normal(ROWS)
    gaps = values.copy()
    gaps[[3, 7, 8]] = np.nan
    x = m.data("x", values, "", "complete", section="S")
    y = m.data("y", gaps, "", "with gaps", section="S", may_be_missing=True)
    u, v, w, z, c = m.columns("u", "v", "w", "z", "c", section="S")
    m.define(u[t], u[t - 1] + a * v[t - 2] - x[t], "", "u", start=[0, 1 + a])
    m.define(v[t], cos(u[t]) * (1 + x[t] ** 2) ** p, "", "v", start=[sqrt(a)])
    m.define(w[t], when_observed(y[t], atan2(y[t], x[t - 1]) + floor(2 * y[t])), "", "w", start=[0])
    mean = m.summary("mean_w", Mean(w), "", "mean")
    m.define(z[t], log(1 + v[t] ** 2) * mean + z[t - 1] / 2, "", "second pass", start=[mean])
    m.summary("std_z", Std(z), "", "spread")
    clipped = Piecewise((Missing, z[t] > 1), (Max(z[t], acos(sin(x[t])), Rational(1, 3)), True))
    m.define(c[t], clipped, "", "gaps of its own")
    for aggregate in (RMS, Sum, Largest, Smallest, Last):
        m.summary(f"{aggregate.__name__.lower()}_c", aggregate(c), "", "of c")
    return m


def small():
    """Two columns and a scalar, compiled in a moment."""
    m = Recurrence("small", title="Small", rows=ROWS)
    a = m.parameter("a", 0.3, "", "a")
    v, w = m.columns("v", "w", section="S")
    m.define(v[t], a * v[t - 1] + sqrt(t + 1), "", "v", start=[1])
    m.define(w[t], cos(v[t]), "", "w")
    m.summary("rms_w", RMS(w), "", "rms")
    return m


def assert_same(ours, theirs, tolerance):
    assert list(ours.columns) == list(theirs.columns)
    for name in ours:
        a, b = ours[name].to_numpy(), theirs[name].to_numpy()
        assert (np.isnan(a) == np.isnan(b)).all(), name
        scale = np.sqrt(np.nanmean(b**2)) if not np.isnan(b).all() else 1
        assert np.nanmax(np.abs(a - b), initial=0) <= tolerance * max(scale, 1e-300), name


@pytest.mark.parametrize("model", [mixed(), football], ids=["mixed", "football"])
def test_compiled_and_python_agree(model):
    ours, theirs = evaluate(model, compiled=True), evaluate(model, compiled=False)
    assert_same(ours, theirs, 1e-13)
    for name, value in theirs.attrs["scalars"].items():
        found = ours.attrs["scalars"][name]
        assert found == pytest.approx(value, rel=1e-12, nan_ok=True), name


@pytest.mark.parametrize("section", ["EKF", "Linear"])
def test_compiled_and_python_agree_in_a_long_filter(section):
    columns = [c.name for c in cannonball.sections[section] if not c.is_data]
    ours = evaluate(cannonball, columns=columns, compiled=True)
    assert_same(ours, evaluate(cannonball, columns=columns, compiled=False), 2e-12)


def test_a_few_columns_are_the_same_as_all():
    some = ["z", "u"]
    model = mixed()
    few = evaluate(model, columns=some, compiled=True)
    assert few.equals(evaluate(model, compiled=True)[some])
    with pytest.raises(ModelError, match="no column 'q'"):
        evaluate(model, columns=["q"])


# -- who waits for the compiler --------------------------------------------------------------


@pytest.fixture
def compilers(monkeypatch):
    """Sources that were compiled here, and those that were given to another process."""
    here, elsewhere = [], []
    monkeypatch.setattr(compiling, "_compiled", lambda source: here.append(source) or STOP)
    monkeypatch.setattr(compiling._BACKGROUND, "compile", elsewhere.append)
    return here, elsewhere


def STOP(*arguments):
    raise ValueError("a compiled run, which Python then explains")


def unlike(number):
    """A model that nobody has compiled."""
    model = small()
    model.parameter(f"unlike_{number}", 0, "", "so that its kernel is a new one")
    return model


def test_neither_a_first_run_nor_a_small_study_waits_for_a_compiler(compilers):
    model = unlike(1)
    evaluate(model)
    evaluate(model, columns=["v"])
    for _ in range(20):
        study(model, 10, columns=["v"])
    assert compilers == ([], [])


def test_after_some_runs_another_process_compiles_what_is_run_often_and_nothing_else(
    compilers, monkeypatch
):
    model, cells = unlike(2), ROWS * 2
    monkeypatch.setattr(compiling, "COMPILING", 4 * cells)
    for module in (compiling, model_cache, study_module):
        monkeypatch.setattr(module, "LOADING", 2 * cells)
    for _ in range(4):
        evaluate(model)
    assert compilers == ([], [])
    evaluate(model)
    assert compilers == ([], [kernel_of(model, model.version, ("v", "w")).source])
    evaluate(model, columns=["v"])  # its own kernel, run once
    of_study = kernel_of(model, model.version, ("w",)).source
    study(model, 4 * ARRAYS, columns=["w"])
    assert of_study not in compilers[1]
    study(model, 4 * ARRAYS, columns=["w"])
    assert of_study in compilers[1]
    assert not compilers[0]


def test_who_asks_for_much_waits_and_who_says_so_never_or_always(compilers, monkeypatch):
    model = unlike(3)
    source = kernel_of(model, model.version, ("v", "w")).source
    monkeypatch.setattr(compiling, "WAITING", ROWS * 2)
    monkeypatch.setattr(compiling, "LOADING", 0)
    monkeypatch.setattr(model_cache, "LOADING", 0)
    evaluate(model, compiled=False)
    study(model, 2, compiled=False)
    assert compilers == ([], [])
    evaluate(model)
    assert compilers == ([source], [])
    monkeypatch.undo()
    assert not is_ready(kernel_of(model, model.version, ("v",), ()).source)
    evaluate(model, columns=["v"], compiled=True)
    assert is_ready(kernel_of(model, model.version, ("v",), ()).source)


def test_python_goes_on_until_the_other_process_is_done(monkeypatch):
    model = unlike(4)
    monkeypatch.setattr(compiling, "COMPILING", 1)
    monkeypatch.setattr(compiling, "LOADING", 1)
    monkeypatch.setattr(model_cache, "LOADING", 1)
    python = evaluate(model, compiled=False)
    end, runs = time.monotonic() + 120, 0
    while not cache_of(model).kernels and time.monotonic() < end:
        assert_same(evaluate(model), python, 1e-13)
        runs += 1
    assert runs > 1
    assert evaluate(model).equals(evaluate(model, compiled=True))


def test_a_compiler_that_fails_is_told_of_once_and_python_goes_on(monkeypatch):
    model = unlike(5)
    background = compiling._Background()
    failing = [sys.executable, "-c", "raise SystemExit(3)"]
    monkeypatch.setattr(compiling, "command", lambda *_: failing)
    monkeypatch.setattr(compiling, "_BACKGROUND", background)
    for name in ("LOADING", "COMPILING"):
        monkeypatch.setattr(compiling, name, 0)
    monkeypatch.setattr(model_cache, "LOADING", 1)
    evaluate(model)
    background._process.wait()
    with pytest.warns(RuntimeWarning, match="the compiler failed, so Python goes on"):
        evaluate(model)
    assert evaluate(model).equals(evaluate(model, compiled=False))


LEAVES = """
import sys
from kfsheet.evaluation import compiling
compiling.LOADING = compiling.COMPILING = 1
assert not compiling.pays(open(sys.argv[1]).read(), 1, 1)
print(compiling._BACKGROUND._process.pid)
"""


def run(program, source, folder, **environment):
    """What a program prints that is given the source of a kernel, in a process of its own."""
    file = folder / "source.txt"
    file.write_text(source)
    done = subprocess.run(
        [sys.executable, "-c", program, str(file)],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@pytest.mark.skipif(os.name == "nt", reason="asks for a process as Unix does")
def test_a_program_that_ends_leaves_no_compiler_behind(source, tmp_path):
    (child,) = run(LEAVES, source, tmp_path, KFSHEET_CACHE=str(tmp_path))
    with pytest.raises(ProcessLookupError):
        os.kill(int(child), 0)


def test_threads_that_ask_at_once_get_one_function(source, cache):
    with ThreadPoolExecutor(4) as pool:
        assert len(set(pool.map(compiled_function, [source] * 4))) == 1


def test_a_machine_without_a_compiler_says_so(monkeypatch):
    for module in (compiling, evaluation):
        monkeypatch.setattr(module, "can_compile", lambda: False)
    for ask in (evaluate, lambda model, **options: study(model, 3, **options)):
        with pytest.raises(EngineError, match=r"install kfsheet\[fast\], or compiled=False"):
            ask(small(), compiled=True)
    warm_up(small())


def test_a_study_says_when_it_waits_for_the_compiler(monkeypatch, cache):
    said, bar = [], executors._bar

    def watched(members, shown, words=""):
        said.extend([words] if shown else [])
        return bar(members, shown, words)

    monkeypatch.setattr(executors, "_bar", watched)
    for _ in range(2):
        study(small(), 3, compiled=True)
    assert said == ["compiling"]


# -- on disk ---------------------------------------------------------------------------------

PROGRAM = """
import sys
from kfsheet.evaluation.compiling import compiled_function
stats = compiled_function(open(sys.argv[1]).read()).stats
print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))
"""


@pytest.fixture
def source():
    """That of a small kernel."""
    model = small()
    return kernel_of(model, model.version).source


def test_a_second_process_finds_the_machine_code_on_disk(source, tmp_path):
    found = [run(PROGRAM, source, tmp_path, KFSHEET_CACHE=str(tmp_path))[:2] for _ in range(2)]
    assert found == [["0", "1"], ["1", "0"]]


@pytest.fixture
def cache(monkeypatch, tmp_path):
    """An empty cache, and nothing in memory."""
    monkeypatch.setenv("KFSHEET_CACHE", str(tmp_path / "cache"))
    compiling._compiled.cache_clear()
    yield tmp_path / "cache" / "kernels"
    compiling._compiled.cache_clear()


def as_by_python(source):
    """The numbers of a kernel of the small model, by machine code, are those of Python."""
    function = compiled_function(source)
    out, results = np.empty((1, 2, ROWS)), np.empty((1, 1))
    function(0, 1, np.array([[0.3]]), out, results)
    theirs = evaluate(small(), compiled=False)
    np.testing.assert_allclose(out[0], theirs[["v", "w"]].T, rtol=1e-13)
    np.testing.assert_allclose(results[0, 0], theirs.attrs["scalars"]["rms_w"], rtol=1e-13)
    return function.stats


@pytest.mark.parametrize("size", [0, 100])
@pytest.mark.parametrize("ending", [".nbi", ".nbc", ".py"])
def test_a_file_that_was_damaged_is_made_anew(source, cache, ending, size):
    as_by_python(source)
    (victim,) = cache.rglob(f"kernel_*{ending}")
    victim.write_bytes(victim.read_bytes()[:size])
    compiling._compiled.cache_clear()
    assert as_by_python(source).cache_misses or victim.read_text() == source
    compiling._compiled.cache_clear()
    assert as_by_python(source).cache_hits


def test_a_source_that_was_changed_is_not_believed(source, cache):
    as_by_python(source)
    (file,) = cache.glob("kernel_*.py")
    file.write_text(source.replace("cos(v)", "sin(v)"))
    assert file.read_text() != source
    compiling._compiled.cache_clear()
    as_by_python(source)
    assert file.read_text() == source


def test_machine_code_of_another_processor_is_not_ours(source, cache, monkeypatch):
    from llvmlite import binding

    as_by_python(source)
    assert is_ready(source)
    compiling._digest.cache_clear()
    monkeypatch.setattr(binding, "get_host_cpu_name", lambda: "another")
    assert not is_ready(source)
    compiling._digest.cache_clear()


def test_machine_code_that_nobody_has_used_for_a_season_is_deleted(source, cache):
    model = small()
    kernels = [kernel_of(model, model.version, (name,), ()).source for name in ("v", "w")]
    old, young = map(compiling._file_of, kernels)
    for kernel in kernels:
        compiled_function(kernel)
    season = time.time() - 2 * compiling.SEASON
    for file in cache.rglob("kernel_*"):
        if file.is_file() and (file.stem.startswith(old.stem) or file.suffix == ".py"):
            os.utime(file, (season, season))
    compiled_function(source)
    assert not list(cache.rglob(f"{old.stem}*"))
    assert young.exists()
    assert is_ready(kernels[1])


def test_a_disk_that_is_full_does_not_stop_anybody(source, cache, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(compiling, "_from_disk", full)
    assert not as_by_python(source).cache_hits


def test_another_process_that_writes_the_same_file_is_not_in_the_way(source, cache, monkeypatch):
    """As on Windows, where a file that somebody reads cannot be replaced."""

    def beaten(path, content):
        Path(path).write_bytes(content)
        raise WorkbookError("cannot be written")

    monkeypatch.setattr(compiling, "write_file", beaten)
    as_by_python(source)
    assert list(cache.glob("kernel_*.ready"))


NOWHERE = """
import sys
sys.path.insert(0, "LIBRARY")
from kfsheet.evaluation import compiling
compiling.compiled_function(open(sys.argv[1]).read())
print(compiling.__file__, compiling.cache_folder())
"""


def test_an_installation_that_cannot_be_written_and_no_home_do_not_stop_anybody(source, tmp_path):
    """A file lies where Python and Numba want a folder, which stops even an administrator."""
    package = tmp_path / "library" / "kfsheet"
    shutil.copytree(compiling.HERE.parent, package, ignore=shutil.ignore_patterns("__pycache__"))
    (package / "__pycache__").write_text("in the way")
    blocker = tmp_path / "home"
    blocker.write_text("in the way")
    (tmp_path / "temporary").mkdir()
    found, folder = run(
        NOWHERE.replace("LIBRARY", str(package.parent)),
        source,
        tmp_path,
        HOME=str(blocker),
        XDG_CACHE_HOME=str(blocker),
        LOCALAPPDATA=str(blocker),
        KFSHEET_CACHE=str(blocker),
        TMPDIR=str(tmp_path / "temporary"),
    )
    assert Path(found).parent == package / "evaluation"
    assert Path(folder).is_relative_to(tmp_path / "temporary")
    assert not list((tmp_path / "temporary").glob("kfsheet-*")), "removed at the end"
    assert blocker.read_text() == "in the way"
