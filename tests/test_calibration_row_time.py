"""Row time from a flashing lamp: simulated sensors with known readout, direction and faults."""

from __future__ import annotations

import numpy as np
import pytest

from olivevib.calibration.row_time import row_time_from_led
from olivevib.errors import InputError

HEIGHT = 720


def lamp(t_s, led_hz, exposure_s, duty=0.5):
    """Mean light of a square-wave lamp over the exposure around t_s, exactly."""

    def integral(t):
        whole, part = np.divmod(t * led_hz, 1.0)
        return (whole * duty + np.minimum(part, duty)) / led_hz

    return (integral(t_s + exposure_s / 2) - integral(t_s - exposure_s / 2)) / exposure_s


def profiles(readout_s, led_hz=500.0, frames=60, fps=30.0, **more):
    """Mean brightness of each row, (N, H), and the frame times."""
    told = {"exposure_s": 3e-4, "noise": 0.3, "spot": 1.0, "texture": 0.3, "seed": 1, **more}
    rng = np.random.default_rng(told["seed"])
    t_s = np.arange(frames) / fps + 0.0123
    row = np.arange(HEIGHT)
    seen_s = t_s[:, None] + readout_s / HEIGHT * row
    around = np.exp(-0.5 * ((row - 300) / (told["spot"] * HEIGHT)) ** 2)
    scene = 1 + told["texture"] * np.cumsum(rng.normal(0, 0.05, HEIGHT))
    light = 20 * scene + 120 * around * scene * lamp(seen_s, led_hz, told["exposure_s"])
    return np.clip(light, 0, 255) + rng.normal(0, told["noise"], light.shape), t_s


@pytest.mark.parametrize("readout_s", [0.008, 0.027, 0.033, -0.027])
@pytest.mark.parametrize("led_hz", [310.0, 500.0, 997.0])
def test_the_row_time_is_found_with_its_sign(readout_s, led_hz):
    found = row_time_from_led(*profiles(readout_s, led_hz), led_hz)
    true = readout_s / HEIGHT
    assert found.row_time_s == pytest.approx(true, rel=2e-3)
    assert found.sign_known
    assert abs(found.row_time_s - true) < 3 * found.sigma_s
    assert found.stripes == pytest.approx(abs(readout_s) * led_hz, rel=2e-3)


def test_its_sigma_is_what_the_scatter_of_many_recordings_is():
    errors, sigmas = [], []
    for seed in range(25):
        found = row_time_from_led(*profiles(0.027, 500.0, noise=20.0, seed=seed), 500.0)
        errors.append(found.row_time_s - 0.027 / HEIGHT)
        sigmas.append(found.sigma_s)
    assert 0.5 < np.std(errors) / np.mean(sigmas) < 1.7


@pytest.mark.parametrize(
    "more",
    [
        {"spot": 0.2},  # the lamp lights a part of the rows
        {"texture": 2.0, "noise": 2.0},
        {"exposure_s": 9e-4},
        {"frames": 12},
    ],
)
def test_hard_recordings_stay_within_one_percent(more):
    found = row_time_from_led(*profiles(0.027, 500.0, **more), 500.0)
    assert found.row_time_s == pytest.approx(0.027 / HEIGHT, rel=1e-2)


def test_dropped_frames_do_not_turn_the_sign():
    rows, t_s = profiles(-0.027, 500.0, frames=80)
    keep = np.delete(np.arange(80), [5, 6, 20, 41, 42, 43])
    found = row_time_from_led(rows[keep], t_s[keep], 500.0)
    assert found.sign_known
    assert found.row_time_s < 0


def test_a_direction_that_cannot_be_told_is_not_claimed():
    found = row_time_from_led(*profiles(0.027, 494.0), 494.0)  # 16.47 flashes a frame
    assert not found.sign_known
    assert found.row_time_s == pytest.approx(0.027 / HEIGHT, rel=2e-3)


@pytest.mark.parametrize(
    ("readout_s", "led_hz", "more"),
    [
        (0.0, 500.0, {}),  # a global shutter
        (0.0, 500.0, {"spot": 0.2, "texture": 1.0}),
        (0.027, 500.0, {"exposure_s": 2e-3}),  # a whole flash long
        (0.027, 510.0, {}),  # 17 flashes a frame: the stripes stand still
        (0.027, 495.0, {}),  # 16.5: they jump to and fro
        (0.027, 40.0, {}),  # one stripe
    ],
)
def test_what_shows_no_travelling_stripes_is_refused_with_the_remedy(readout_s, led_hz, more):
    with pytest.raises(InputError, match=r"no stripes|too wide") as caught:
        row_time_from_led(*profiles(readout_s, led_hz, **more), led_hz)
    assert caught.value.remedy


def test_a_few_frames_are_not_enough():
    with pytest.raises(InputError, match="too few"):
        row_time_from_led(*profiles(0.027, frames=4), 500.0)
