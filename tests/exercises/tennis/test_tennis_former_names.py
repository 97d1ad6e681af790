"""Names that have moved are still found for one release, and say where they have gone."""

import importlib
import sys

import pytest

from kfsheet.exercises.tennis.methods import cameras


@pytest.fixture
def forgotten(monkeypatch):
    """As if nobody had imported the former name yet; nothing of it is left afterwards."""
    for name in [n for n in sys.modules if n.partition("kfsheet.tennis")[1]]:
        monkeypatch.delitem(sys.modules, name)
    yield
    for name in [n for n in sys.modules if n.partition("kfsheet.tennis")[1]]:
        del sys.modules[name]


def test_the_former_name_of_the_tennis_methods_warns_and_tells_the_new_one(forgotten):
    with pytest.warns(DeprecationWarning, match=r"kfsheet\.exercises\.tennis\.methods"):
        importlib.import_module("kfsheet.tennis")


FORMER = (
    "calibration cameras centroid charts closed_form cones dynamics inputs loop reprojection "
    "sheets shots symbolic track"
).split()


def test_every_module_of_the_former_package_is_found(forgotten):
    with pytest.warns(DeprecationWarning, match="0.3.0"):
        importlib.import_module("kfsheet.tennis")
    for name in FORMER:
        assert importlib.import_module(f"kfsheet.tennis.{name}")


def test_a_camera_of_the_former_name_is_a_camera_of_the_new_one(forgotten):
    with pytest.warns(DeprecationWarning, match="0.3.0"):
        former = importlib.import_module("kfsheet.tennis.cameras")
    assert former.Camera is cameras.Camera
