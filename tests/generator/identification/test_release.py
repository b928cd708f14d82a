"""Release that is found in measured angles."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from generator.identification.release import find_release


def swing(times, release: float, natural: float, ratio: float, drop: float):
    """Angles of a damped oscillator that is held until its release."""
    swung = np.maximum(times - release, 0.0)
    decay, angular = ratio * natural, natural * np.sqrt(1.0 - ratio**2)
    shape = np.cos(angular * swung) + decay / angular * np.sin(angular * swung)
    return drop * (1.0 - np.exp(-decay * swung) * shape)


@given(
    rate=st.sampled_from((30.0, 50.0, 240.0)),
    release=st.floats(-0.04, 2.0),
    natural=st.floats(3.0, 8.0),
    ratio=st.floats(0.02, 0.3),
    start=st.floats(-2.0, 2.0),
    drop=st.floats(0.3, 1.5),
    sign=st.sampled_from((-1.0, 1.0)),
    epoch=st.floats(-2e9, 2e9),
)
def test_the_release_of_a_damped_oscillator_is_found(
    rate: float,
    release: float,
    natural: float,
    ratio: float,
    start: float,
    drop: float,
    sign: float,
    epoch: float,
):
    times = np.arange(round(5.0 * rate)) / rate
    angles = start + sign * swing(times, release, natural, ratio, drop)
    found = find_release(times + epoch, angles[:, None])
    assert abs(found.time - release) < 0.25 / natural
    assert abs(found.angles[0] - start) < 0.05
    two = find_release(times + epoch, np.column_stack([angles, -0.5 * angles]))
    assert abs(two.time - found.time) < 1e-6
    np.testing.assert_allclose(two.angles, [found.angles[0], -0.5 * found.angles[0]], atol=1e-9)


def test_noise_hides_as_much_of_the_motion_as_it_is_large():
    """In the error of the time the joint has nearly always moved by four standard deviations."""
    random, noise = np.random.default_rng(1), 0.005
    shares: list[float] = []
    starts: list[float] = []
    for _ in range(200):
        rate = float(random.choice([30.0, 50.0, 240.0]))
        release, natural, ratio = random.uniform((-0.04, 3.0, 0.02), (2.0, 8.0, 0.3))
        drop = random.uniform(0.3, 1.5)
        times = np.arange(round(5.0 * rate)) / rate
        angles = swing(times, release, natural, ratio, drop)
        noisy = angles + noise * random.standard_normal(len(times))
        found = find_release(times, noisy[:, None])
        shares.append(abs(found.time - release) * natural / np.sqrt(8.0 * noise / drop))
        starts.append(abs(found.angles[0]))
    assert np.mean(np.array(starts) < 0.05) > 0.98
    assert np.mean(np.array(shares) < 1.0) > 0.98
    assert max(shares) < 2.0


def test_joints_that_do_not_move_are_released_at_the_first_sample():
    found = find_release(np.arange(10.0), np.full((10, 1), 0.3))
    assert found.time == 0.0
    assert found.angles.tolist() == [0.3]


def test_one_wrong_sample_is_no_release():
    times = np.arange(100) * 0.02
    angles = np.where(times < 1.0, 0.0, 1.0 - np.cos(6.0 * (times - 1.0)))
    angles[10] = 1.0
    found = find_release(times, angles[:, None])
    assert abs(found.time - 1.0) < 0.01
