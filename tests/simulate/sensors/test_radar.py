"""Physical radar on hand-made scenes, by many samples, and in the closed loop."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye import signals
from adeye.signals import Floats, Measurement, Scene, SceneContext, parameter_record
from adeye.simulate import engine
from adeye.simulate.sensors import radar as subject
from adeye.simulate.sensors.ranging import RangingSensor
from adeye.simulate.sensors.sampling import Stream
from adeye.simulate.world.objects import CROSS_SECTION
from adeye.simulate.world.weather import MM_PER_HOUR, RAIN_ALPHA, RAIN_K, radar_rain_extinction
from adeye.spec.architecture import Architecture
from adeye.spec.sensors import PhysicalRadar
from adeye.trace import Trace
from tests.motorway import ARCHITECTURE, make_case, make_scenario
from tests.simulate.sensors import scenes

RUNS = 4000
QUIET = {"clutter": 0.0, "false_alarm_rate": 1e-9}
"""Without anything that is not there: less than one false alarm in a thousand samples."""
PERSON = (0.5, 0.5, 1.8)


def spec(**changes: Any) -> PhysicalRadar:
    fields = {"field_of_view": "60 deg", "range": "150 m", **QUIET, **changes}
    made: PhysicalRadar = scenes.sensor_spec("radar/physical", **fields)
    return made


def look(context: SceneContext, shown: Scene, **changes: Any) -> Measurement:
    """Sample one scene with one new sensor."""
    return subject.RadarSensor(scenes.sensor_context(spec(**changes), context)).sense(shown)


def rear_at(distance: float, y: float = 0.0, speed: float = 0.0) -> tuple[float, ...]:
    """State of a car ahead whose rear is at a distance."""
    return (distance + 0.5 * scenes.CAR[0], y, 0.0, speed)


def detected(distance: float, kind: str = "car", size: Any = scenes.CAR, **changes: Any) -> float:
    """Share of many runs in which an object straight ahead is detected."""
    context = scenes.scene_context([size], runs=RUNS, kinds=[kind])
    at = (distance + 0.5 * size[0], 0.0)
    found = look(context, scenes.scene(context, [at]), **changes)
    return float((found.source == 0).any(axis=1).mean())


def assert_share(share: float, expected: float) -> None:
    """Within four standard deviations of the binomial distribution."""
    assert share == pytest.approx(expected, abs=4.0 * math.sqrt(expected * (1 - expected) / RUNS))


# --- what is detected -----------------------------------------------------------------------------


@pytest.mark.parametrize("distance", [90.0, 120.0, 150.0, 180.0, 220.0])
def test_detection_follows_the_formula_of_swerling_and_the_fourth_power(distance: float) -> None:
    rate = 1e-6
    # At the range it is detected half of the time.
    half = math.log(rate) / math.log(0.5) - 1.0
    signal = half * (150.0 / distance) ** 4
    share = detected(distance, false_alarm_rate=rate)
    assert_share(share, rate ** (1.0 / (1.0 + signal)))


@pytest.mark.slow
def test_both_fidelities_lose_a_car_at_ranges_that_agree_within_two_percent() -> None:
    exact = scenes.sensor_spec("radar", field_of_view="60 deg", range="150 m")
    context = scenes.scene_context([scenes.CAR])

    def is_seen(distance: float) -> bool:
        shown = scenes.scene(context, [rear_at(distance)])
        return bool(scenes.seen(RangingSensor(scenes.sensor_context(exact, context)).sense(shown)))

    grid = np.arange(140.0, 160.0, 0.5)
    box = max(distance for distance in grid if is_seen(distance))
    echo = max(distance for distance in grid[::2] if detected(distance) >= 0.5)
    assert echo == pytest.approx(box, rel=0.02)


# --- where, and how fast --------------------------------------------------------------------------

FINE: dict[str, Any] = {
    "range_resolution": "1 mm",
    "bearing_resolution": "0.0001 deg",
    "range_rate_resolution": "0.001 m/s",
    "false_alarm_rate": 1e-12,
}
"""Cells so small that errors do not matter."""


def only(found: Measurement) -> Floats:
    """The one detection of the first run."""
    assert found.mask[0].sum() == 1
    row: Floats = found.detections[0, 0]
    return row


def test_lead_is_a_point_at_its_rear_of_unknown_size_and_class() -> None:
    context = scenes.scene_context()
    row = only(look(context, scenes.scene(context, [rear_at(40.0, 1.0)]), **FINE))
    assert row[:2] == pytest.approx([40.0, 1.0], abs=0.01)
    columns = [
        signals.DETECTION_HAS_RANGE_RATE,
        signals.DETECTION_LENGTH,
        signals.DETECTION_WIDTH,
        signals.DETECTION_CLASS,
    ]
    assert row[columns].tolist() == [1.0, 0.0, 0.0, -1.0]


def test_crossing_car_is_a_point_at_the_middle_of_its_side() -> None:
    context = scenes.scene_context()
    row = only(look(context, scenes.scene(context, [(40.0, 0.0, math.pi / 2.0, 10.0)]), **FINE))
    assert row[:2] == pytest.approx([40.0 - 0.5 * scenes.CAR[1], 0.0], abs=0.01)


def test_truck_beside_the_path_stays_beside_it_as_the_ego_comes_near() -> None:
    context = scenes.scene_context([scenes.TRUCK], kinds=["truck"])
    for distance in (80.0, 40.0, 20.0, 10.0):
        row = only(look(context, scenes.scene(context, [(distance + 5.0, 3.5)]), **FINE))
        assert 3.0 < row[1] <= 3.5, distance


def test_oncoming_car_beyond_the_span_seems_to_drive_away() -> None:
    context = scenes.scene_context()
    shown = scenes.scene(context, [(60.0, 0.0, math.pi, 40.0)], ego=(0.0, 0.0, 0.0, 30.0))
    row = only(look(context, shown, **FINE, max_range_rate="50 m/s"))
    assert row[signals.DETECTION_RANGE_RATE] == pytest.approx(30.0, abs=0.01)


@pytest.mark.parametrize("degrees", [20.0, -20.0])
def test_yaw_shifts_what_is_in_view_and_leaves_the_place(degrees: float) -> None:
    context = scenes.scene_context([(0.1, 0.1, 1.0)])
    bearing = math.radians(degrees)
    at = (30.0 * math.cos(bearing), 30.0 * math.sin(bearing))
    narrow: dict[str, Any] = {**FINE, "field_of_view": "10 deg"}
    turned = look(context, scenes.scene(context, [at]), **narrow, mount={"yaw": f"{degrees} deg"})
    assert only(turned)[:2] == pytest.approx(at, abs=0.06)
    assert not look(context, scenes.scene(context, [at]), **narrow).mask.any()


def test_errors_shrink_with_the_signal_down_to_a_floor() -> None:
    context = scenes.scene_context([(0.001, 0.001, 1.0)], runs=RUNS)
    spreads = []
    for distance in (10.0, 110.0):
        found = look(context, scenes.scene(context, [(distance, 0.0)]), range_resolution="2 m")
        there = found.source[:, 0] == 0
        spreads.append(found.detections[there, 0, 0].std())
    assert spreads[0] == pytest.approx(0.05 * 2.0, rel=0.06)
    assert 1.3 * spreads[0] < spreads[1] < 2.0 / math.sqrt(2.0 * math.log(1e9))


# --- cells ----------------------------------------------------------------------------------------


def test_person_beside_a_parked_truck_is_not_seen_on_its_own_until_he_moves() -> None:
    context = scenes.scene_context([scenes.TRUCK, PERSON], kinds=["truck", "pedestrian"], runs=64)
    truck = (45.0, 0.0, 0.0, 0.0)
    coarse = {"bearing_resolution": "4 deg", "range_resolution": "1 m"}
    shares = []
    for speed in (0.0, 1.5):
        shown = scenes.scene(context, [truck, (40.3, 1.8, math.pi, speed)])
        shares.append((look(context, shown, **coarse).source == 1).any(axis=1).mean())
    assert shares[0] == 0.0
    assert shares[1] > 0.7


# --- occlusion ------------------------------------------------------------------------------------


def test_power_goes_with_the_visible_share() -> None:
    # A thin wall from -1 to 1 at 50 m throws a shadow from -2 to 2 at 100 m, where the rear of the
    # car is 1.8 m wide.
    kinds = ["barrier", "car"]
    context = scenes.scene_context([(0.01, 2.0, 2.0), scenes.CAR], runs=RUNS, kinds=kinds)
    half = math.log(1e-6) / math.log(0.5) - 1.0
    for y, share in ((0.0, 0.0), (2.0, 0.5), (6.0, 1.0)):
        shown = scenes.scene(context, [(50.0, 0.0), rear_at(100.0, y)])
        found = look(context, shown, edge_loss=0.0, false_alarm_rate=1e-6)
        signal = share * half * 1.5**4
        expected = 1e-6 ** (1.0 / (1.0 + signal)) if share > 0.0 else 0.0
        # The far edges of the car are seen a little past its rear.
        detections = float((found.source == 1).any(axis=1).mean())
        assert detections == pytest.approx(expected, abs=0.03), y


# --- what is not there ----------------------------------------------------------------------------


def ghosts(**changes: Any) -> list[Floats]:
    """Detections of each of many samples of an empty world by an ego that drives 20 m/s."""
    context = scenes.scene_context([scenes.CAR], runs=200)
    sensor = subject.RadarSensor(scenes.sensor_context(spec(**changes), context))
    rows: list[Floats] = []
    for tick in range(50):
        shown = scenes.scene(context, [(-100.0, 0.0)], ego=(0.0, 0.0, 0.0, 20.0), tick=tick)
        found = sensor.sense(shown)
        assert (found.source == -1).all()
        rows += [found.detections[run, found.mask[run]].copy() for run in range(200)]
    return rows


def test_number_of_ghosts_is_that_of_the_record() -> None:
    cells = 300.0 * 800.0
    for rate, clutter, mean in (
        (1e-6, 0.0, 1e-6 * cells),
        (1e-5, 0.0, 1e-5 * cells),
        (1e-12, 1.5, 1.5),
        (1e-6, 1.0, 1.24),
    ):
        counts = np.array([len(rows) for rows in ghosts(false_alarm_rate=rate, clutter=clutter)])
        assert counts.mean() == pytest.approx(mean, abs=4.0 * math.sqrt(mean / counts.size))
        assert counts.var() == pytest.approx(mean, rel=0.1)


def test_clutter_stands_still_and_lies_all_over_the_area_in_view() -> None:
    rows = np.concatenate(ghosts(clutter=2.0, false_alarm_rate=1e-12))
    distance = np.hypot(rows[:, 0], rows[:, 1])
    bearing = np.arctan2(rows[:, 1], rows[:, 0])
    assert distance.max() <= 150.0
    assert abs(bearing).max() <= math.radians(30.0)
    # Half of the area is nearer than range / sqrt(2).
    assert (distance < 150.0 / math.sqrt(2.0)).mean() == pytest.approx(0.5, abs=0.02)
    assert rows[:, signals.DETECTION_RANGE_RATE] == pytest.approx(-20.0 * np.cos(bearing), abs=0.2)


def test_false_alarms_have_any_range_and_any_rate() -> None:
    rows = np.concatenate(ghosts(clutter=0.0, false_alarm_rate=1e-5))
    distance = np.hypot(rows[:, 0], rows[:, 1])
    assert (distance < 75.0).mean() == pytest.approx(0.5, abs=0.02)
    assert rows[:, signals.DETECTION_RANGE_RATE].mean() == pytest.approx(0.0, abs=1.5)
    assert rows[:, signals.DETECTION_RANGE_RATE].std() == pytest.approx(
        80.0 / math.sqrt(3.0), rel=0.03
    )


# --- in the closed loop ---------------------------------------------------------------------------

LEAD = {"kind": "car", "start": {"lane": 1, "s": "260 m", "speed": "25 m/s"}}


FRONT = scenes.sensor_spec(
    "radar/physical", mount={"x": "2.3 m"}, field_of_view="40 deg", range="160 m"
)
TRUTH = {"kind": "ground_truth", "rate": "20 Hz"}


def drive(front: Any, actors: dict[str, Any], runs: int, parameters: Any = None) -> Trace:
    """Drive for half a minute on one sensor that sees."""
    channel = {"kind": "nominal", "links": ["front", "pose"], "parameters": parameters or {}}
    sensors = {"front": front, "pose": {"kind": "localisation", "rate": "20 Hz"}}
    parts = {"sensors": sensors, "channels": {"nominal": channel}}
    architecture = Architecture.model_validate({**ARCHITECTURE, **parts})
    scenario = make_scenario(actors=actors, horizon="28 s")
    return engine.run(
        [replace(make_case(scenario, seed=seed), architecture=architecture) for seed in range(runs)]
    )


def hardest(trace: Trace) -> Floats:
    """Least acceleration that each run asks for (B,)."""
    least: Floats = trace.columns["acceleration"][:, :, 0].min(axis=1)
    return least


def test_nominal_channel_follows_a_lead_on_one_radar_as_on_the_truth() -> None:
    trace, truth = drive(FRONT, {"lead": LEAD}, 8), drive(TRUTH, {"lead": LEAD}, 1)
    assert (trace.columns["contact"] < 0).all()
    end, exact = trace.columns["ego"][:, -1], truth.columns["ego"][0, -1]
    assert end[:, signals.EGO_SPEED] == pytest.approx(exact[signals.EGO_SPEED], abs=0.2)
    assert end[:, signals.EGO_X] == pytest.approx(exact[signals.EGO_X], abs=2.0)
    assert hardest(trace).min() > hardest(truth)[0] - 1.0


def test_ghosts_at_the_default_rate_brake_nobody_in_half_an_hour() -> None:
    assert hardest(drive(FRONT, {}, 60)).min() > -0.5


@pytest.mark.slow
def test_m_of_n_takes_most_of_the_phantom_braking_out_of_heavy_clutter() -> None:
    heavy = FRONT.model_copy(update={"clutter": 2.0})
    braked = [
        int((hardest(drive(heavy, {}, 60, {"confirm_window": window})) < -3.0).sum())
        for window in (0, 4)
    ]
    assert braked[1] < 0.5 * braked[0]


# --- Cells of a radar: what falls together, what is folded, how many false alarms there are -------

STRONG = 1e9
"""Signal at which errors are at their floor and no echo is missed."""


def record(**changes: float) -> Any:
    fields = {
        "x": 0.0,
        "y": 0.0,
        "yaw": 0.0,
        "threshold": 13.8,
        "range_resolution": 0.5,
        "bearing_resolution": 0.03,
        "range_rate_resolution": 0.2,
        "max_range_rate": 80.0,
        **changes,
    }
    return parameter_record({name: np.full(1, value) for name, value in fields.items()})[0]


def echo(
    distance: float, bearing: float = 0.0, rate: float = 0.0, signal: float = STRONG
) -> Floats:
    row = np.zeros(subject.ECHO_WIDTH)
    row[subject.ECHO_SIGNAL], row[subject.ECHO_RANGE] = signal, distance
    row[subject.ECHO_BEARING], row[subject.ECHO_RATE] = bearing, rate
    return row


def test_cell_is_left_by_any_of_range_bearing_and_rate() -> None:
    behind = echo(50.0, math.pi - 0.01)
    for one, other, together in (
        (echo(50.0), echo(50.49), True),
        (echo(50.0), echo(50.51), False),
        (echo(50.0), echo(50.0, 0.029), True),
        (echo(50.0), echo(50.0, -0.031), False),
        (echo(50.0), echo(50.0, 0.0, 0.19), True),
        (echo(50.0), echo(50.0, 0.0, -0.21), False),
        (echo(50.0), echo(50.49, 0.029, 0.21), False),
        (echo(50.0), echo(math.nan), False),
        # It reaches across the direction behind the sensor.
        (behind, echo(50.0, -math.pi + 0.01), True),
    ):
        assert subject.same_cell(record(), one, other) is together, (one, other)
        assert subject.same_cell(record(), other, one) is together, (one, other)


def found(echoes: Sequence[Floats], number: int = 0) -> list[Floats]:
    """What is detected of these echoes, nearest first."""
    rows = np.array(echoes)
    order = np.zeros(len(rows), dtype=np.int64)
    count = subject.detect(record(), Stream(np.uint64(1), np.uint64(2), number), rows, order)
    return [rows[thing] for thing in order[:count]]


@pytest.mark.slow
def test_two_equal_echoes_of_one_cell_are_detected_midway() -> None:
    places = [found([echo(50.0), echo(50.4, 0.02)], number) for number in range(200)]
    assert {len(rows) for rows in places} == {1}
    distances = np.array([rows[0][subject.ECHO_RANGE] for rows in places])
    bearings = np.array([rows[0][subject.ECHO_BEARING] for rows in places])
    assert distances.mean() == pytest.approx(50.2, abs=4.0 * 0.025 / math.sqrt(200.0))
    assert bearings.mean() == pytest.approx(0.01, abs=4.0 * 0.0015 / math.sqrt(200.0))


def test_strong_echo_swallows_the_weak_one_beside_it() -> None:
    rows = found([echo(50.3, signal=1e6), echo(50.0)])
    assert len(rows) == 1
    assert rows[0][subject.ECHO_RANGE] == pytest.approx(50.0, abs=0.15)


@pytest.mark.slow
def test_chain_is_cut_around_the_strongest_whatever_the_order() -> None:
    chain = [(50.0, 2e9), (50.4, 4e9), (50.8, 2e9), (51.2, 1e9)]
    for order in itertools.permutations(chain):
        rows = found([echo(distance, signal=signal) for distance, signal in order])
        assert [row[subject.ECHO_RANGE] for row in rows] == pytest.approx([50.4, 51.2], abs=0.12)


def test_nearest_is_first_wherever_it_is() -> None:
    for near, far in ((0.0, 0.9), (0.9, 0.0), (-0.9, 0.1)):
        for rows in ([echo(20.0, near), echo(23.0, far)], [echo(23.0, far), echo(20.0, near)]):
            ranges = [row[subject.ECHO_RANGE] for row in found(rows)]
            assert ranges == pytest.approx([20.0, 23.0], abs=0.2)


def test_range_rate_beyond_the_span_comes_in_at_the_other_end() -> None:
    rates = {0.0: 0.0, 79.9: 79.9, 80.0: -80.0, 90.0: -70.0, -81.0: 79.0}
    assert [subject.folded(rate, 80.0) for rate in rates] == pytest.approx(list(rates.values()))


def test_number_of_events_is_poisson_distributed() -> None:
    mean, draws = 1.7, 40_000
    chances = (np.arange(draws) + 0.5) / draws
    counts = np.array(
        [subject.count_events(mean, math.exp(-mean), 20.0, chance) for chance in chances]
    )
    for number in range(6):
        expected = math.exp(-mean) * mean**number / math.factorial(number)
        assert (counts == number).mean() == pytest.approx(expected, abs=2.0 / draws)


def test_number_of_events_is_bounded_where_more_come_less_than_once_in_ten_million_times() -> None:
    assert subject.count_events(3.0, math.exp(-3.0), 5.0, 1.0 - 1e-16) == 5
    assert subject.most_events(0.0) == 0
    for mean in (0.01, 0.24, 1.0, 10.0, 50.0):
        inside = sum(
            math.exp(number * math.log(mean) - mean - math.lgamma(number + 1))
            for number in range(subject.most_events(mean) + 1)
        )
        assert 1.0 - inside < 1e-7, mean


# --- The radar equation, rain and threshold against closed forms and published figures ------------

STRENGTH = 1e9


def clear(distance: float, cross_section: float = 10.0, bearing: float = 0.0) -> float:
    return subject.signal_to_noise(STRENGTH, cross_section, distance, bearing, 0.5, 0.0, 0.0)


def test_echo_falls_by_12_decibels_when_the_distance_doubles() -> None:
    for distance in (5.0, 40.0, 150.0):
        fall = 10.0 * math.log10(clear(distance) / clear(2.0 * distance))
        assert fall == pytest.approx(40.0 * math.log10(2.0))
    assert clear(60.0, 5.0) == pytest.approx(0.5 * clear(60.0, 10.0))


def test_edge_of_the_antenna_and_rain_take_their_loss_on_both_ways() -> None:
    half, loss = 0.6, 3.0
    beam = 2.0 * loss * math.log(10.0) / 10.0 / half**2
    ahead = subject.signal_to_noise(STRENGTH, 10.0, 50.0, 0.0, beam, 0.0, 0.0)
    edge = subject.signal_to_noise(STRENGTH, 10.0, 50.0, -half, beam, 0.0, 0.0)
    assert 10.0 * math.log10(ahead / edge) == pytest.approx(2.0 * loss)
    wet = subject.signal_to_noise(STRENGTH, 10.0, 50.0, 0.0, beam, 0.002, 0.0)
    assert wet == pytest.approx(ahead * math.exp(-2.0 * 0.002 * 50.0))


def test_signal_for_a_probability_inverts_the_formula_of_swerling() -> None:
    for probability, rate in itertools.product((0.1, 0.5, 0.9), (1e-8, 1e-6, 1e-2)):
        found = rate ** (1.0 / (1.0 + subject.signal_for(probability, rate)))
        assert found == pytest.approx(probability), rate
        # Noise alone crosses the threshold at the rate of false alarms.
        assert math.exp(-subject.detection_threshold(rate)) == pytest.approx(rate)


# --- rain -----------------------------------------------------------------------------------------


P838_K = [
    (-3.80595, 0.56934, 0.81061),
    (-3.44965, -0.22911, 0.51059),
    (-0.39902, 0.73042, 0.11899),
    (0.50167, 1.07319, 0.27195),
]
P838_ALPHA = [
    (-0.07771, 2.33840, -0.76284),
    (0.56727, 0.95545, 0.54039),
    (-0.20238, 1.14520, 0.26809),
    (-48.2991, 0.791669, 0.116226),
    (48.5833, 0.791459, 0.116479),
]


def polynomial(rows: list[tuple[float, float, float]], slope: float, offset: float) -> float:
    """Equations 2 and 3 of ITU-R P.838-3 at 77 GHz."""
    f = math.log10(77.0)
    return sum(a * math.exp(-(((f - b) / c) ** 2)) for a, b, c in rows) + slope * f + offset


def test_attenuation_has_the_coefficients_of_itu_r_p838() -> None:
    assert 10.0 ** polynomial(P838_K, -0.16398, 0.63297) == pytest.approx(RAIN_K, rel=1e-4)
    assert polynomial(P838_ALPHA, -0.053739, 0.83433) == pytest.approx(RAIN_ALPHA, abs=1e-4)


def test_ten_millimetres_of_rain_cost_5_7_decibels_per_kilometre_and_no_rain_nothing() -> None:
    loss = 1e4 * math.log10(math.e) * radar_rain_extinction(10.0 * MM_PER_HOUR)
    assert loss == pytest.approx(1.1276 * 10.0**0.7073)
    for rain in (0.0, math.nan, -1.0):
        assert radar_rain_extinction(rain) == 0.0
    assert subject.rain_echo(-1.0) == 0.0


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
        assert subject.rain_echo(rate * MM_PER_HOUR) == pytest.approx(volume, rel=0.18)


def test_in_heavy_rain_the_echo_of_the_rain_and_not_the_noise_is_the_limit() -> None:
    # A signal without end is seen over the rain in its cell only, which has a cross section, too.
    in_cell = 1e-6
    far = subject.signal_to_noise(1e30, 10.0, 100.0, 0.0, 0.0, 0.0, in_cell)
    assert far == pytest.approx(10.0 / (in_cell * 100.0**2))


# --- objects --------------------------------------------------------------------------------------


def test_every_class_has_a_cross_section() -> None:
    assert set(CROSS_SECTION) == set(signals.OBJECT_CLASSES)
    car, truck, person = (
        signals.OBJECT_CLASSES.index(name) for name in ("car", "truck", "pedestrian")
    )
    found = subject.cross_sections(np.array([car, truck, person], dtype=np.int64))
    assert found[:, 0] == pytest.approx([10.0, 100.0, 10.0**-0.8])
    assert (found[:, 1] >= found[:, 0]).all()


def test_face_returns_the_squared_cosine_of_the_incidence_and_nothing_from_behind() -> None:
    places = {
        (-12.0, 0.0): 1.0,
        (-12.0, 10.0): 0.5,
        (12.0, -10.0): 0.5,
        (-1.0, 5.0): 0.0,
        (2.0, 5.0): 0.0,
    }
    assert [subject.facing(*place, 2.0) for place in places] == pytest.approx(list(places.values()))
