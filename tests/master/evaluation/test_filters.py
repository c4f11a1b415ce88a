"""The low-pass filters against their definitions, a recursive filter, and scipy's poles; the interval of interest."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal as scipy_signal

from master.evaluation.filters import (
    BEFORE_CHOICE,
    DEFAULT,
    SETTLING,
    ForceFilter,
    band_pass,
    evaluated,
    low_pass,
    stands_in,
)
from master.ssp.run_settings import Filter

STEP = 1e-3
TIME = np.arange(12001) * STEP
MIDDLE = slice(3000, 9000)
CAUSAL = ForceFilter(phase="causal")
WALL = ForceFilter("fft")
ALL = (DEFAULT, CAUSAL, WALL)


def gain_and_delay(frequency, chosen):
    """Return amplitude and phase lag [rad] of a filtered sine."""
    angle = 2.0 * np.pi * frequency * TIME
    found = low_pass(np.sin(angle), STEP, chosen)[MIDDLE]
    # 6 s hold whole periods of every frequency that is asked for.
    parts = [2.0 * np.mean(found * wave[MIDDLE]) for wave in (np.sin(angle), np.cos(angle))]
    return np.hypot(*parts), -np.arctan2(parts[1], parts[0])


@pytest.mark.parametrize("frequency", [1.0, 5.0, 10.0, 18.0, 20.0, 22.0, 30.0])
def test_butterworth_has_its_magnitude_at_zero_phase(frequency):
    gain, lag = gain_and_delay(frequency, DEFAULT)
    assert gain == pytest.approx(1.0 / np.sqrt(1.0 + (frequency / 20.0) ** 12), abs=2e-4)
    assert lag == pytest.approx(0.0, abs=2e-3)


@pytest.mark.parametrize("frequency", [1.0, 5.0, 10.0, 18.0, 20.0, 22.0, 30.0])
def test_causal_butterworth_is_the_analogue_filter_less_its_delay_at_zero(frequency):
    """Independent: numerator and denominator of scipy's analogue prototype."""
    b, a = scipy_signal.butter(6, 2.0 * np.pi * 20.0, analog=True)
    _, response = scipy_signal.freqs(b, a, [1e-3, 2.0 * np.pi * frequency])
    delay = -np.angle(response[0]) / 1e-3
    wanted = response[1] * np.exp(2j * np.pi * frequency * delay)
    gain, lag = gain_and_delay(frequency, CAUSAL)
    assert gain == pytest.approx(abs(wanted), abs=5e-4)
    assert np.exp(-1j * lag) == pytest.approx(wanted / abs(wanted), abs=5e-3)


def test_causal_butterworth_is_what_a_recursive_filter_gives():
    """A digital filter of the same order, sampled finely; shifted by the delay of the analogue one, 30.75 ms."""
    force = 150.0 + 40.0 * np.sin(2 * np.pi * 3.0 * TIME) + 30.0 * np.sin(2 * np.pi * 15.0 * TIME)
    sos = scipy_signal.butter(6, 20.0, fs=1.0 / STEP, output="sos")
    recursive = scipy_signal.sosfilt(sos, force)
    shift = 3.8637033051562737 / (2.0 * np.pi * 20.0)
    there = np.interp(TIME[MIDDLE] + shift, TIME, recursive)
    assert low_pass(force, STEP, CAUSAL)[MIDDLE] == pytest.approx(there, abs=0.2)


def test_two_passes_of_the_recursive_filter_of_half_the_order_are_another_filter():
    """1 / (1 + (f / 20)^6), as filtfilt of order 3 has it, is 3 dB lower at the cut-off than ours."""
    sos = scipy_signal.butter(3, 20.0, fs=1.0 / STEP, output="sos")
    twice = scipy_signal.sosfiltfilt(sos, np.sin(2 * np.pi * 20.0 * TIME))
    assert np.abs(twice[MIDDLE]).max() == pytest.approx(0.5, abs=5e-3)
    assert gain_and_delay(20.0, DEFAULT)[0] == pytest.approx(np.sqrt(0.5), abs=2e-4)


@pytest.mark.parametrize("chosen", ALL)
def test_constants_and_straight_lines_pass_whole_up_to_the_ends(chosen):
    line = 100.0 + 3.0 * TIME
    assert low_pass(line, STEP, chosen) == pytest.approx(line, rel=1e-12)


@pytest.mark.parametrize("chosen", ALL)
@given(seed=st.integers(0, 2**31), n=st.integers(3, 400))
@settings(max_examples=20, deadline=None)
def test_filters_are_linear_and_keep_their_length(chosen, seed, n):
    a, b = np.random.default_rng(seed).normal(size=(2, n))
    both = low_pass(2.0 * a - 3.0 * b, STEP, chosen)
    assert len(both) == n
    assert both == pytest.approx(2.0 * low_pass(a, STEP, chosen) - 3.0 * low_pass(b, STEP, chosen), abs=1e-9)


def test_zero_phase_filters_do_not_know_which_way_time_runs_and_the_causal_one_does():
    noise = np.random.default_rng(1).normal(size=3000)
    for chosen in (DEFAULT, WALL):
        assert low_pass(noise[::-1], STEP, chosen)[::-1] == pytest.approx(low_pass(noise, STEP, chosen), abs=1e-10)
    assert np.abs(low_pass(noise[::-1], STEP, CAUSAL)[::-1] - low_pass(noise, STEP, CAUSAL)).max() > 0.05


def test_variances_of_butterworth_bands_add_up():
    noise = np.random.default_rng(4).normal(size=40000)
    parts = [band_pass(noise, STEP, *band, DEFAULT)[2000:-2000].var() for band in ((0.0, 5.0), (5.0, 20.0))]
    assert sum(parts) == pytest.approx(low_pass(noise, STEP, DEFAULT)[2000:-2000].var(), rel=5e-3)


def test_every_filter_has_the_other_two_beside_it():
    for chosen in ALL:
        assert {f.short for f in (chosen, *chosen.others)} == {f.short for f in ALL}
    assert BEFORE_CHOICE == WALL


@pytest.mark.parametrize("chosen", [*ALL, ForceFilter(order=3, cutoff=25.0)])
def test_a_filter_says_all_that_is_needed_to_repeat_it(chosen):
    for text in (chosen.short, chosen.sentence):
        assert f"{chosen.cutoff:g} Hz" in text
        assert chosen.kind in text
    if chosen.kind == "butterworth":
        assert f"order {chosen.order}," in chosen.sentence
        assert ("causal" if chosen.phase == "causal" else "zero phase") in chosen.short


def test_the_annotation_has_the_same_defaults():
    assert ForceFilter(**Filter().model_dump()) == DEFAULT


def raised(n=6000, first=700):
    """A contact made at 0.7 s, with a raising that overshoots and bounces, then 100 N; at 50 m/s."""
    force = np.where(np.arange(n) < first, 0.0, 100.0)
    force[first : first + 400] = 300.0
    force[first + 400 : first + 600] = 0.0
    return force, 10.0 + 50.0 * np.arange(n) * STEP


def test_an_open_interval_begins_where_the_contact_has_settled():
    force, position = raised()
    inside = evaluated(force, position, STEP, (None, None))
    assert np.flatnonzero(inside)[0] == 700 + round(SETTLING / STEP)
    assert inside[-1]
    assert force[inside].min() == force[inside].max() == 100.0
    assert evaluated(force, position, STEP, (None, 100.0)).sum() == 1800 - 1700 + 1


def test_a_given_beginning_is_kept_and_the_other_side_may_be_open():
    force, position = raised()
    assert np.flatnonzero(evaluated(force, position, STEP, (50.0, None)))[0] == 801
    backwards = evaluated(force, position[::-1].copy(), STEP, (50.0, None))
    assert np.flatnonzero(backwards)[0] == 1700


def test_a_run_without_contact_has_nothing_to_evaluate():
    assert not evaluated(np.zeros(5000), np.arange(5000.0), STEP, (None, None)).any()


def test_ends_of_the_interval_belong_to_it_for_supports():
    """The source's interval of 551 m to 798 m means the supports at 551.2 m and 798.6 m."""
    assert [x for x in (501.7, 551.2, 600.7, 749.1, 798.6, 848.1) if stands_in(x, (551.0, 798.0))] == [
        551.2,
        600.7,
        749.1,
        798.6,
    ]
