"""Decimation, packing, spectrum, and where the filtered force means something."""

import base64

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from master.evaluation.contact_signals import power_spectrum
from master.evaluation.filters import ForceFilter, low_pass, settled
from master.report.charts.sample_packing import kept_samples, packed, packed_integers


@settings(max_examples=50, deadline=None)
@given(st.integers(10, 3000), st.integers(8, 200), st.integers(0, 2**31))
def test_decimation_keeps_extremes_ends_and_order(n, most, seed):
    values = np.random.default_rng(seed).normal(size=n)
    kept = kept_samples(values, most)
    assert len(kept) <= max(most, 4)
    assert (np.diff(kept) > 0).all()
    assert kept[0] == 0
    assert kept[-1] == n - 1
    assert values[kept].max() == values.max()
    assert values[kept].min() == values.min()


def test_decimation_keeps_a_gap():
    values = np.sin(np.arange(5000.0))
    values[:1000] = np.nan
    kept = kept_samples(values, 400)
    assert np.isnan(values[kept][kept < 900]).all()
    assert np.isfinite(values[kept][kept > 1020]).all()


def test_packed_numbers_come_back():
    values = np.array([0.0, -1.5, 1e3, np.nan])
    back = np.frombuffer(base64.b64decode(packed(values)["bdata"]), dtype="<f4")
    assert np.array_equal(back, values.astype("<f4"), equal_nan=True)
    whole = np.frombuffer(base64.b64decode(packed_integers(np.array([0.01234, 9.0]), 1e-5)), dtype="<i2")
    assert whole.tolist() == [1234, 32767]


def test_spectrum_holds_the_variance_at_its_frequency():
    time = np.arange(4000) * 1e-3
    signal = 5.0 + 3.0 * np.sin(2 * np.pi * 10.0 * time)
    frequency, density = power_spectrum(signal, 1e-3)
    assert np.sum(density) * (frequency[1] - frequency[0]) == pytest.approx(4.5, rel=1e-3)  # A^2 / 2
    assert frequency[np.argmax(density)] == pytest.approx(10.0, abs=0.25)


def test_ringing_before_and_after_the_first_contact_is_left_out():
    """A force that jumps from 0 to 150 N rings below zero before the jump, not where it is shown."""
    force = np.where(np.arange(4000) < 1000, 0.0, 150.0)
    filtered = low_pass(force, 1e-3, ForceFilter("fft"))
    assert filtered[:1000].min() < -5.0
    shown = filtered[settled(force, 1e-3)]
    assert abs(shown - 150.0).max() < 0.03 * 150.0
    assert len(shown) == 4000 - 1000 - 100


def test_a_record_that_begins_in_contact_is_shown_whole():
    assert settled(np.full(100, 120.0), 1e-3).all()
    assert not settled(np.zeros(100), 1e-3).any()
