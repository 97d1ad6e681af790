"""Units as text are multiplied as pint multiplies them, and pint is asked where it must be."""

import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kfsheet import ModelError
from kfsheet.model.unit_text import COMMON, Unit
from kfsheet.model.units import parse_unit, unit_text

symbols = st.sampled_from(sorted(COMMON))
powers = st.sampled_from(["", "2", "3", "4"])
separators = st.sampled_from([" ", "*", "/"])


@st.composite
def texts(draw):
    """A unit as a person writes it: m, 1/s, kg m2/s3."""
    text = draw(st.sampled_from(["", "1/"])) + draw(symbols) + draw(powers)
    for _ in range(draw(st.integers(0, 3))):
        text += draw(separators) + draw(symbols) + draw(powers)
    return text


@pytest.mark.parametrize("symbol", sorted(COMMON))
def test_pint_reads_every_common_symbol_as_itself(symbol):
    assert unit_text(parse_unit(symbol)) == symbol


@given(texts())
def test_a_unit_is_read_as_pint_reads_it(text):
    assert str(Unit.read(text)) == unit_text(parse_unit(text))


@given(texts(), texts(), st.integers(-3, 3))
def test_products_quotients_and_powers_are_those_of_pint(one, two, exponent):
    ours, theirs = Unit.read(one), parse_unit(one)
    for found, expected in (
        (ours * Unit.read(two), theirs * parse_unit(two)),
        (ours / Unit.read(two), theirs / parse_unit(two)),
        (ours**exponent, theirs**exponent),
    ):
        assert str(found) == unit_text(expected)
        assert Unit.read(str(found)) == found


@pytest.mark.parametrize(
    "text",
    ["km", "meter/second", "m**2", "m^2/s", "hour", "mm2", "km/s px", "m0.5", "um"],
)
def test_what_is_not_common_is_left_to_pint(text):
    assert str(Unit.read(text) * Unit.read("m")) == unit_text(parse_unit(text) * parse_unit("m"))


@pytest.mark.parametrize(
    "text", ["2 m", "furlongz", "m/", "/s", "1/", "degC", "m0", "m02", "m\u0662", None, 3]
)
def test_what_is_no_unit_is_refused_as_by_pint(text):
    with pytest.raises(ModelError, match="unit") as here:
        Unit.read(text)
    with pytest.raises(ModelError) as there:
        parse_unit(text)
    assert str(here.value) == str(there.value)


def test_a_unit_that_pint_writes_in_its_own_letters_can_be_multiplied():
    assert str(Unit.read("delta_degC")) == unit_text(parse_unit("delta_degC"))
    assert str(Unit.read("ohm") ** 2 * Unit.read("um")) == unit_text(
        parse_unit("ohm") ** 2 * parse_unit("um")
    )
    assert str(Unit.read("\u03a92")) == "\u03a92"


def test_a_power_beyond_reason_is_refused():
    with pytest.raises(ModelError, match="'m12345678' cannot be multiplied"):
        Unit.read("m12345678")


def test_a_model_of_common_units_does_not_load_pint():
    program = "import sys, kfsheet.exercises.cannonball; sys.exit('pint' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program]).returncode == 0
