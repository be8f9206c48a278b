"""The radar equation, rain and threshold against closed forms and published figures."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from adeye.signals import OBJECT_CLASSES
from adeye.simulate.sensors.radar import (
    cross_sections,
    decibels,
    detection_threshold,
    facing,
    rain_echo,
    signal_for,
    signal_to_noise,
)
from adeye.simulate.world.objects import CROSS_SECTION
from adeye.simulate.world.weather import MM_PER_HOUR, RAIN_ALPHA, RAIN_K, radar_rain_extinction

STRENGTH = 1e9


def clear(distance: float, cross_section: float = 10.0, bearing: float = 0.0) -> float:
    return signal_to_noise(STRENGTH, cross_section, distance, bearing, 0.5, 0.0, 0.0)


def test_echo_falls_by_12_decibels_when_the_distance_doubles() -> None:
    for distance in (5.0, 40.0, 150.0):
        fall = 10.0 * math.log10(clear(distance) / clear(2.0 * distance))
        assert fall == pytest.approx(40.0 * math.log10(2.0))


def test_echo_is_proportional_to_the_cross_section() -> None:
    assert clear(60.0, 5.0) == pytest.approx(0.5 * clear(60.0, 10.0))


def test_antenna_loses_its_edge_loss_twice_at_the_edge() -> None:
    half, loss = 0.6, 3.0
    beam = 2.0 * loss * math.log(10.0) / 10.0 / half**2
    ahead = signal_to_noise(STRENGTH, 10.0, 50.0, 0.0, beam, 0.0, 0.0)
    edge = signal_to_noise(STRENGTH, 10.0, 50.0, -half, beam, 0.0, 0.0)
    assert 10.0 * math.log10(ahead / edge) == pytest.approx(2.0 * loss)


def test_noise_alone_crosses_the_threshold_at_the_false_alarm_rate() -> None:
    assert math.exp(-detection_threshold(1e-4)) == pytest.approx(1e-4)


@pytest.mark.parametrize("probability", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("rate", [1e-8, 1e-6, 1e-2])
def test_signal_for_a_probability_inverts_the_formula_of_swerling(
    probability: float, rate: float
) -> None:
    assert rate ** (1.0 / (1.0 + signal_for(probability, rate))) == pytest.approx(probability)


# --- rain -----------------------------------------------------------------------------------------


def polynomial(rows: list[tuple[float, float, float]], slope: float, offset: float) -> float:
    """Equations 2 and 3 of ITU-R P.838-3 at 77 GHz."""
    f = math.log10(77.0)
    return sum(a * math.exp(-(((f - b) / c) ** 2)) for a, b, c in rows) + slope * f + offset


def test_attenuation_has_the_coefficients_of_itu_r_p838() -> None:
    k = polynomial(
        [
            (-3.80595, 0.56934, 0.81061),
            (-3.44965, -0.22911, 0.51059),
            (-0.39902, 0.73042, 0.11899),
            (0.50167, 1.07319, 0.27195),
        ],
        -0.16398,
        0.63297,
    )
    alpha = polynomial(
        [
            (-0.07771, 2.33840, -0.76284),
            (0.56727, 0.95545, 0.54039),
            (-0.20238, 1.14520, 0.26809),
            (-48.2991, 0.791669, 0.116226),
            (48.5833, 0.791459, 0.116479),
        ],
        -0.053739,
        0.83433,
    )
    assert pytest.approx(10.0**k, rel=1e-4) == RAIN_K
    assert pytest.approx(alpha, abs=1e-4) == RAIN_ALPHA


def test_ten_millimetres_of_rain_cost_5_7_decibels_per_kilometre() -> None:
    loss = 1e4 * math.log10(math.e) * radar_rain_extinction(10.0 * MM_PER_HOUR)
    assert loss == pytest.approx(1.1276 * 10.0**0.7073)
    assert (radar_rain_extinction(0.0), radar_rain_extinction(math.nan)) == (0.0, 0.0)


def water(frequency: float) -> complex:
    """Permittivity of water at 20 °C after Liebe, Hufford & Manabe (1991); frequency in GHz."""
    theta = 1.0 - 300.0 / 293.15
    static = 77.66 - 103.3 * theta
    first = 20.20 + 146.4 * theta + 316.0 * theta**2
    middle, infinite = 0.0671 * static, 3.52
    return complex(
        (static - middle) / (1.0 - 1j * frequency / first)
        + (middle - infinite) / (1.0 - 1j * frequency / (39.8 * first))
        + infinite
    )


def mie_echo(size: float, index: complex) -> float:
    """Radar cross section of a sphere over its area (Bohren & Huffman 1983, section 4.6)."""
    orders = int(size + 4.0 * size ** (1.0 / 3.0) + 10.0)
    inner = index * size
    derivative = np.zeros(int(max(orders, abs(inner))) + 17, dtype=complex)
    for n in range(len(derivative) - 1, 0, -1):
        derivative[n - 1] = n / inner - 1.0 / (derivative[n] + n / inner)
    psi_0, psi_1 = math.cos(size), math.sin(size)
    chi_0, chi_1 = -math.sin(size), math.cos(size)
    total = 0j
    for n in range(1, orders + 1):
        psi = (2 * n - 1) / size * psi_1 - psi_0
        chi = (2 * n - 1) / size * chi_1 - chi_0
        xi, xi_1 = complex(psi, -chi), complex(psi_1, -chi_1)
        for sign, part in ((1.0, derivative[n] / index), (-1.0, derivative[n] * index)):
            term = ((part + n / size) * psi - psi_1) / ((part + n / size) * xi - xi_1)
            total += sign * (2 * n + 1) * (-1.0) ** n * term
        psi_0, psi_1, chi_0, chi_1 = psi_1, psi, chi_1, chi
    return abs(total) ** 2 / size**2


def test_echo_of_rain_is_that_of_spheres_with_the_drop_sizes_of_marshall_and_palmer() -> None:
    index = np.sqrt(water(77.0))
    diameter = np.linspace(0.05, 6.5, 120)
    wavelength = 299.792458 / 77.0
    echo = np.array([mie_echo(math.pi * d / wavelength, index) for d in diameter])
    for rate in (1.0, 2.5, 7.5, 20.0, 50.0, 100.0):
        drops = 8000.0 * np.exp(-4.1 * rate**-0.21 * diameter)
        volume = float(np.trapezoid(drops * echo * math.pi / 4.0 * diameter**2 * 1e-6, diameter))
        assert rain_echo(rate * MM_PER_HOUR) == pytest.approx(volume, rel=0.18)


def test_more_rain_never_makes_an_echo_stronger() -> None:
    def through(rate: float) -> float:
        rain = rate * MM_PER_HOUR
        in_cell = 0.5 * 0.03 * 0.17 * rain_echo(rain)
        return signal_to_noise(STRENGTH, 1.0, 80.0, 0.1, 0.5, radar_rain_extinction(rain), in_cell)

    strengths = [through(rate) for rate in (0.0, 0.5, 2.5, 7.5, 25.0, 100.0)]
    assert strengths == sorted(strengths, reverse=True)
    assert len(set(strengths)) == len(strengths)


def test_in_heavy_rain_the_echo_of_the_rain_and_not_the_noise_is_the_limit() -> None:
    # A signal without end is seen over the rain in its cell only, which has a cross section, too.
    in_cell = 1e-6
    far = signal_to_noise(1e30, 10.0, 100.0, 0.0, 0.0, 0.0, in_cell)
    assert far == pytest.approx(10.0 / (in_cell * 100.0**2))


# --- objects --------------------------------------------------------------------------------------


def test_every_class_has_a_cross_section() -> None:
    assert set(CROSS_SECTION) == set(OBJECT_CLASSES)
    car, truck, person = (OBJECT_CLASSES.index(name) for name in ("car", "truck", "pedestrian"))
    found = cross_sections(np.array([car, truck, person], dtype=np.int64))
    assert found[:, 0] == pytest.approx([10.0, 100.0, 10.0**-0.8])
    assert (found[:, 1] >= found[:, 0]).all()


@pytest.mark.parametrize(("level", "ratio"), [(0.0, 1.0), (10.0, 10.0), (-3.0, 0.501187)])
def test_decibels(level: float, ratio: float) -> None:
    assert decibels(level) == pytest.approx(ratio, rel=1e-5)


@pytest.mark.parametrize(
    ("place", "squared_cosine"),
    [
        ((-12.0, 0.0), 1.0),
        ((-12.0, 10.0), 0.5),
        ((12.0, -10.0), 0.5),
        ((-1.0, 5.0), 0.0),
        ((2.0, 5.0), 0.0),
    ],
)
def test_face_returns_the_squared_cosine_of_the_incidence_and_nothing_from_behind(
    place: tuple[float, float], squared_cosine: float
) -> None:
    assert facing(*place, 2.0) == pytest.approx(squared_cosine)


@pytest.mark.parametrize("kernel", [radar_rain_extinction, rain_echo])
def test_negative_rain_is_none(kernel: Callable[[float], float]) -> None:
    assert kernel(-1.0) == 0.0
