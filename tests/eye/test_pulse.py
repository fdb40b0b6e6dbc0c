"""Main sequences: peak velocity by amplitude and starting position, of accommodation and of disaccommodation."""

import numpy as np
import pytest

from focalgradient.eye import Plant, Pulse, PulsedPlant

MS = 0.002


def course(before, after, seconds=2.0, pulse=Pulse()):  # noqa: B008
    one = PulsedPlant(Plant(), pulse, before)
    return np.array([one.accommodation, *(one.advance(after, MS) for _ in range(round(seconds / MS)))])


def peak(before, after, **kwargs):
    """Peak velocity (D/s) over 10 ms, as recordings are differentiated."""
    focus = course(before, after, **kwargs)
    return np.abs(focus[5:] - focus[:-5]).max() / (5 * MS)


def demand_for(response):
    """The demand that the plant answers by this accommodation."""
    return response + (response - Plant().rest) / Plant().gain


def test_disaccommodation_is_faster_the_nearer_it_starts_however_far_it_goes():
    """Bharadwaj & Schor 2004: 1.39 x start + 1.12 D/s for steps of 1 to 4 D from 2, 3 and 4 D."""
    starts = np.array([2.0, 3.0, 4.0])
    found = {
        start: [peak(demand_for(start), demand_for(start - size)) for size in np.arange(1.0, start + 0.1, 0.5)]
        for start in starts
    }
    full = [max(found[start]) for start in starts]
    slope, at_infinity = np.polyfit(starts, full, 1)
    assert slope == pytest.approx(1.39, abs=0.03)
    assert at_infinity == pytest.approx(1.12, abs=0.1)
    for start in starts:  # the same for all sizes from 1.5 D on; a pulse for 1 D from 4 D ends before its peak
        assert min(found[start][1:]) > 0.95 * max(found[start])
        assert min(found[start]) > 0.7 * max(found[start])


def test_accommodation_is_faster_the_farther_it_goes_wherever_it_starts():
    sizes = np.array([1.0, 2.0, 3.0])
    found = np.array([[peak(demand_for(start), demand_for(start + size)) for size in sizes] for start in (0.5, 2.0)])
    assert found[0] == pytest.approx(found[1], rel=1e-6)
    slope, at_nothing = np.polyfit(sizes, found[0], 1)
    assert slope == pytest.approx(2.19, abs=0.02)  # of a second-order system of these constants
    assert at_nothing == pytest.approx(0, abs=0.01)


def test_a_pulse_peaks_as_early_as_peoples_and_ends_where_the_plant_does():
    """Bharadwaj & Schor 2004: 206 ms, standard deviation 82, from the movement's begin to its peak velocity."""
    focus = course(4.0, 1.0)
    fastest = MS * np.argmax(np.abs(np.diff(focus)) >= 0.999 * np.abs(np.diff(focus)).max())
    assert 0.06 < fastest < 0.3
    assert focus[-1] == pytest.approx(Plant().steady(1.0), abs=0.01)
    assert focus.min() > Plant().steady(1.0) - 0.05  # no overshoot to speak of
    # Movement is over as early as the plant's own: within a tenth of the step from its end.
    alone = course(4.0, 1.0, pulse=None)
    late = [MS * np.argmax(one < Plant().steady(1.0) + 0.3) for one in (focus, alone)]
    assert late[0] == pytest.approx(late[1], abs=0.25)


def test_small_slow_and_nearer_changes_are_the_plants_own():
    for before, after in ((2.0, 1.7), (1.0, 3.0)):
        assert course(before, after) == pytest.approx(course(before, after, pulse=None), abs=1e-12)
    one, alone = (PulsedPlant(Plant(), pulse, 2.0) for pulse in (Pulse(), None))
    for t in np.arange(0, 6, 0.1):
        demand = 2 + 0.5 * np.sin(np.pi * t)
        assert one.advance(demand, 0.1) == alone.advance(demand, 0.1)


@pytest.mark.parametrize("to", [0.0, 3.9])
def test_a_new_demand_within_a_pulse_is_followed(to):
    """Where it lies farther the pulse goes on; where it lies nearer it ends."""
    one = PulsedPlant(Plant(), Pulse(), 4.0)
    one.advance(2.0, 0.15)
    assert one.advance(to, 5.0) == pytest.approx(max(Plant().steady(to), 0), abs=0.02)


def test_the_course_does_not_depend_on_the_moments():
    coarse, fine = (PulsedPlant(Plant(), Pulse(), 4.0) for _ in range(2))
    for _ in range(8):
        found = coarse.advance(1.5, 0.1)
        for _ in range(10):
            expected = fine.advance(1.5, 0.01)
        assert found == pytest.approx(expected, abs=0.01)
