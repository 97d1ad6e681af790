"""A study that cannot be is refused in words that name the culprit and the remedy."""

import numpy as np
import pytest

from kfsheet import NEES, DataError, Draws, ModelError, Recurrence, evaluate, study
from kfsheet.exercises.football import football


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"members": 0}, "give a whole number from 1 up"),
        ({"members": 2.5}, "give a whole number"),
        ({"members": 3, "quantiles": (2,)}, "between 0 and 1"),
        ({"members": 3, "columns": ["q"]}, "no column 'q'"),
        ({"members": 3, "q": 1}, "no parameter q"),
        ({"members": 3, "q": [1, 2, 3]}, "no parameter q"),
        ({"members": 3, "r_i": [1, 2]}, "2 values for 3 members"),
        ({"members": 3, "r_i": [1, -2, 3]}, "r_i of member 1 is -2"),
        ({"members": 3, "data": {"i": np.ones((2, 16))}}, "give 3 x 16 numbers"),
        ({"members": 3, "data": {"q": np.ones(16)}}, "no data column q"),
        ({"members": 3, "data": Draws("q")}, "no data column q"),
        ({"members": 2, "data": {"i": np.full((2, 16), np.inf)}}, "member 0, row 0 is inf"),
        ({"members": 2, "nees": {"N": NEES(("q",))}}, "no column 'e_q_a'|lacks"),
        ({"members": True}, "members is True"),
        ({"members": 3, "columns": "x_a"}, "columns is the text 'x_a'"),
        ({"members": 3, "scalars": "rms_x_a"}, "scalars is the text 'rms_x_a'"),
        ({"members": 3, "scalars": ["q"]}, "no scalar q; it has .*rms_x_a"),
        ({"members": 3, "quantiles": 0.5}, "quantiles is 0.5; give a list"),
        ({"members": 3, "quantiles": "0.5"}, "quantiles is '0.5'; give a list"),
        ({"members": 3, "quantiles": ["0.5"]}, r"quantiles is \['0.5'\]; give a list"),
        ({"members": 3, "quantiles": (float("nan"),)}, "between 0 and 1"),
        ({"members": 3, "nees": NEES(("x",))}, "nees is a NEES; give values by name"),
        ({"members": 3, "nees": {"N": ("x",)}}, r"give NEES\(states\)"),
        ({"members": 3, "nees": {"d_i": NEES(("x",))}}, "a column of that name"),
        ({"members": 3, "executor": 4}, "executor is 4; give one of concurrent.futures"),
        ({"members": 3, "data": [1]}, "data is a list"),
        ({"members": 3, "data": {"i": np.ones((3, 16, 2))}}, r"shape \(3, 16, 2\); give 3 x 16"),
        ({"members": 3, "r_i": np.ones((3, 2))}, "r_i has 3 x 2 values for 3 members"),
        ({"members": 3, "r_i": [1, "2", 3]}, "r_i of member 1 is '2'"),
        ({"members": 3, "dt": [1, 0, 3]}, "dt of member 1 is 0"),
        ({"members": 3, "h": [1, np.nan, 3]}, "h of member 1 is nan"),
    ],
)
def test_a_study_that_cannot_be_is_refused(options, message):
    with pytest.raises((DataError, ModelError), match=message):
        study(football, **options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"members": 3}, r"takes no members; many runs are study\(model, members, data"),
        ({"quantiles": (0.5,)}, "takes no quantiles; many runs are study"),
        ({"scalars": ["rms_x_a"]}, "takes no scalars; many runs are study"),
        ({"nees": {}}, "takes no nees; many runs are study"),
        ({"executor": None}, "takes no executor; many runs are study"),
        ({"data": Draws("i")}, r"data is a Draws; call study\(model, members, data\)"),
        ({"data": [1, 2]}, "data is a list; give {name: values}"),
        ({"data": {"i": np.ones((3, 16))}}, "i has values for many runs; call study"),
        ({"r_i": [1, 2]}, "r_i has values for many runs; call study"),
        ({"columns": "x_a"}, r"columns is the text 'x_a'; give a list: \['x_a'\]"),
    ],
)
def test_one_run_tells_who_wants_many_what_to_call(options, message):
    with pytest.raises(DataError, match=message):
        evaluate(football, **options)


@pytest.mark.parametrize("name", ["members", "scalars", "quantiles", "nees", "executor"])
def test_no_parameter_is_called_like_an_option_of_a_study(name):
    with pytest.raises(ModelError, match="kfsheet uses this name itself"):
        Recurrence("taken", title="Taken", rows=3).parameter(name, 1, "", "taken")


def test_whole_numbers_of_numpy_are_whole_numbers():
    assert study(football, np.int64(2), columns=["x_a"], scalars=()).members == 2


@pytest.mark.parametrize("states", ["x", (), (1,), ("x", "x")])
def test_nees_needs_names_of_states(states):
    with pytest.raises(DataError, match="NEES"):
        NEES(states)


@pytest.mark.parametrize("compiled", [True, False])
def test_a_study_may_ask_for_nothing(compiled):
    ensemble = study(football, 3, columns=[], scalars=(), compiled=compiled)
    assert ensemble.members == 3
    assert not ensemble.rows
    assert not len(ensemble.scalars)
