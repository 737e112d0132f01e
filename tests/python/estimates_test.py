"""Estimates: numbers with standard error, state and unit."""

import math
import pickle

import numpy as np
import palpate as pp
import pytest

VALID = pp.Estimate(0.8397, 0.0121, "N")
ABOVE = pp.Estimate(9.5, 0.1, "N", "above range")
NONE = pp.Estimate(math.nan, math.nan, "N", "not calibrated")


def test_it_is_a_number_where_it_is_valid():
    assert float(VALID) == 0.8397
    assert VALID.sd == 0.0121 and VALID.state == "valid" and VALID.valid and VALID.unit == "N"
    assert np.asarray([VALID, VALID], dtype=float).tolist() == [0.8397, 0.8397]
    assert np.sqrt(float(VALID)) == math.sqrt(0.8397)


@pytest.mark.parametrize("invalid", [ABOVE, NONE])
def test_it_is_nan_where_it_is_not(invalid):
    assert math.isnan(float(invalid))
    assert not invalid.valid and not invalid


def test_a_flagged_number_can_still_be_read():
    assert ABOVE.value == 9.5
    assert math.isnan(NONE.value)


@pytest.mark.parametrize(
    "estimate, text",
    [
        (VALID, "0.84 ± 0.01 N"),
        (pp.Estimate(12.345, 2.1, "mm"), "12 ± 2 mm"),
        (pp.Estimate(0.5, 0.0096, "N"), "0.50 ± 0.01 N"),
        (pp.Estimate(-0.0001, 0.02, "N"), "0.00 ± 0.02 N"),
        (pp.Estimate(0.123456, math.nan, "rad"), "0.1235 rad"),
        (pp.Estimate(0.5, 0), "0.5"),
        (ABOVE, "9.5 ± 0.1 N (above range)"),
        (NONE, "not calibrated"),
    ],
)
def test_it_prints_the_digits_that_it_deserves(estimate, text):
    assert str(estimate) == text
    assert f"{estimate}" == text


def test_a_format_is_the_number_s():
    assert f"{VALID:.3f}" == "0.840"
    assert f"{ABOVE:.1f}" == "nan"


def test_comparisons():
    assert VALID > 0.8 and VALID >= 0.8397 and VALID < 1 and VALID <= 0.8397 and VALID == 0.8397 and VALID != 1
    assert 0.8 < VALID < 1
    assert VALID < pp.Estimate(0.9)
    assert VALID == pp.Estimate(0.8397, 0.5, "N")


@pytest.mark.parametrize("invalid", [ABOVE, NONE])
def test_comparisons_with_an_invalid_one_are_false(invalid):
    for other in (0, 100, VALID, invalid):
        assert not invalid < other and not invalid <= other
        assert not invalid > other and not invalid >= other
        assert not invalid == other
        assert invalid != other  # as of NaN


def test_it_shows_in_notebooks():
    assert VALID._repr_html_() == "0.84 ± 0.01 N"
    assert ABOVE._repr_html_() == "<i>9.5 ± 0.1 N (above range)</i>"
    assert "<b>" not in pp.Estimate(1, 0, "<b>")._repr_html_()


def test_it_travels():
    again = pickle.loads(pickle.dumps(ABOVE))
    assert (again.value, again.sd, again.state, again.unit) == (9.5, 0.1, "above range", "N")
    assert repr(VALID) == "Estimate(0.8397, sd=0.0121, unit='N', state='valid')"
    assert len({VALID, pp.Estimate(0.8397, 0.0121, "N")}) == 1
