"""Fixtures that several test files share."""

import os
import re
import tempfile
from pathlib import Path

import matplotlib
import pytest
from hypothesis import settings

from kfsheet.exercises.football import exercise
from kfsheet.workbook.engines.libreoffice import libreoffice
from kfsheet.workbook.engines.recalculate import ENGINES
from kfsheet.workbook.write.write_workbook import write_workbook

collect_ignore = ["package/users_study.py"]  # mypy reads it; nothing is to run
matplotlib.use("Agg")
# Compiled models of one test run, shared by its workers and forgotten with the temporary files.
RUN = os.environ.get("PYTEST_XDIST_TESTRUNUID") or str(os.getpid())
os.environ["KFSHEET_CACHE"] = str(Path(tempfile.gettempdir()) / f"kfsheet-tests-{RUN}")
# The same draws on every machine, and no clock: a slow machine is not a wrong result.
settings.register_profile("kfsheet", deadline=None, derandomize=True)
settings.load_profile("kfsheet")

# A folder and what is in it, from the root of one machine on; not those that every system has.
MACHINE_PATH = r"(?<![\w.~:/*)\]}>$-])/(?!(?:dev|proc|usr|bin|Applications)/)[A-Za-z]\w*/[\w.]*"


def without_images(text):
    """A notebook without its pictures: letters in which any word may turn up."""
    return re.sub(r'"image/png": ".*"', "", text)


def need(engine):
    """Skip, visibly, what needs LibreOffice where there is none; fail where it is required."""
    if engine == "libreoffice" and libreoffice() is None:
        message = "LibreOffice is not installed: the second opinion is missing"
        if os.environ.get("KFSHEET_REQUIRE_LIBREOFFICE"):
            pytest.fail(message)
        pytest.skip(message)


@pytest.fixture(params=list(ENGINES))
def engine(request):
    """Each independent engine in turn."""
    need(request.param)
    return request.param


@pytest.fixture(scope="session")
def football_file(tmp_path_factory):
    """The football workbook, freshly written; not to be changed."""
    return write_workbook(exercise, tmp_path_factory.mktemp("built"))


@pytest.fixture(scope="session")
def cluster(tmp_path_factory):
    """Two processes of dask, started as on other machines, with a cache of their own."""
    distributed = pytest.importorskip("distributed")
    import dask

    with (
        dask.config.set({"distributed.worker.daemon": False}),  # a worker may start processes
        distributed.LocalCluster(
            n_workers=2,
            threads_per_worker=1,
            processes=True,
            protocol="tcp://",
            host="127.0.0.1",
            dashboard_address=None,
            env={"KFSHEET_CACHE": str(tmp_path_factory.mktemp("cluster"))},
        ) as workers,
        distributed.Client(workers) as client,
    ):
        yield client
