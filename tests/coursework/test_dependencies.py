"""What follows from a quantity, and after how many rows; its parameters."""

from math import inf

from kfsheet import RMS, Recurrence, t
from kfsheet.coursework.judging.dependencies import delays, parameters_of


def chain():
    """x is given; y follows from x and itself, z from y two rows above, w from the sum of z."""
    m = Recurrence("chain", title="A chain", rows=6)
    k = m.parameter("k", 2.0, "", "a factor")
    double = m.derived("double", 2 * k, "", "twice the factor")
    x = m.data("x", [1.0] * 6, "", "given", section="S")
    y, z, w = m.columns("y", "z", "w", section="S")
    m.define(y[t], x[t] + y[t - 1], "", "a sum", start=[x[t]])
    m.define(z[t], double * y[t - 2], "", "a delay", start=[0, 0])
    size = m.summary("size", RMS(z), "", "over all rows")
    m.define(w[t], size + x[t], "", "from all rows")
    return m


def test_a_delay_is_the_least_number_of_rows_on_any_way():
    after = delays(chain(), "y")
    assert (after["y"], after["z"]) == (0, 2)
    assert not {"x", "double"} & after.keys()


def test_what_follows_from_a_sum_over_a_column_follows_from_every_row():
    after = delays(chain(), "y")
    assert (after["size"], after["w"]) == (-inf, -inf)


def test_what_follows_from_a_scalar_does_so_in_every_row():
    after = delays(chain(), "double")
    assert {name for name, rows in after.items() if rows == -inf} == {"double", "z", "size", "w"}


def test_parameters_are_found_through_scalars():
    assert parameters_of(chain(), "z") == ("k",)
    assert parameters_of(chain(), "y") == ()
