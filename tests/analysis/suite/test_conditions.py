"""The conditions of an analysis, and what a suite must see."""

from typing import Any

from adeye.analysis.suite import conditions
from adeye.analysis.suite.geometry import zones_of
from adeye.simulate.world.objects import DEFAULT_REFLECTIVITY, DEFAULT_SIZES
from adeye.simulate.world.weather import MM_PER_HOUR
from adeye.spec.odd import EnvironmentalConditions
from adeye.spec.quantity import SI


def environment(**content: Any) -> EnvironmentalConditions:
    return EnvironmentalConditions.model_validate(content, context=SI)


def test_defaults_are_a_dry_day_rain_and_night() -> None:
    texts = ["day, friction 0.9", "day, 7.5 mm/h rain, friction 0.6", "night, friction 0.9"]
    assert [item.text for item in conditions.DEFAULTS] == texts


def test_corners_of_an_odd_are_what_it_allows() -> None:
    day, some_rain = {"illumination": ["day"]}, {"rain": {"max": MM_PER_HOUR}}
    best = ("best", conditions.DRY)
    (only,) = conditions.conditions_of(environment(**day))
    assert (only.id, only.friction, only.light, only.rain_mps) == (*best, "day", 0.0)
    # Rain without a stated friction is wet; low friction without rain is a corner.
    slippery = {"friction": {"min": 0.3}, "illumination": ["dusk"]}
    for odd, corner in (
        ({**some_rain, **day}, ("rain", conditions.WET)),
        (slippery, ("slippery", 0.3)),
    ):
        found = conditions.conditions_of(environment(**odd))
        assert [(item.id, item.friction) for item in found] == [best, corner]
    # An ODD of nights has no day, and fog is told by its visibility.
    found = conditions.conditions_of(environment(illumination=["night", "lit_night"]))
    assert [item.light for item in found] == ["lit_night", "night"]
    foggy = conditions.conditions_of(environment(fog={"min_visibility": 200.0}, **day))[1]
    assert foggy.text == "day, 200 m visibility, friction 0.9"


def test_each_adverse_attribute_is_a_corner_and_the_last_has_them_all() -> None:
    wet = {"rain": {"max": 5.0 * MM_PER_HOUR}, "friction": {"min": 0.4}}
    dim = {"fog": {"min_visibility": 200.0}, "illumination": ["night", "day"]}
    found = conditions.conditions_of(environment(**wet, **dim))
    assert [item.id for item in found] == ["best", "rain", "fog", "night", "worst"]
    best, rain, fog, night, worst = found
    assert (best.light, best.friction) == ("day", conditions.DRY)
    assert best.visibility_m == conditions.CLEAR_AIR
    assert (rain.rain_mps, rain.friction, rain.light) == (5.0 * MM_PER_HOUR, 0.4, "day")
    assert (fog.visibility_m, fog.rain_mps) == (200.0, 0.0)
    assert (night.light, night.friction) == ("night", conditions.DRY)
    assert (worst.rain_mps, worst.visibility_m) == (rain.rain_mps, 200.0)
    assert (worst.light, worst.friction) == ("night", 0.4)


def test_lowest_sun_of_an_odd_is_a_corner_by_day() -> None:
    low = {"min": 0.125}
    found = conditions.conditions_of(environment(sun_elevation=low, illumination=["day", "night"]))
    assert [(item.id, item.light, item.sun_elevation_rad) for item in found] == [
        ("best", "day", None),
        ("low_sun", "day", 0.125),
        ("night", "night", None),
        ("worst", "night", None),
    ]
    assert found[1].text == "day, sun ahead at 7.16 deg, friction 0.9"


def test_low_sun_comes_with_rain_where_it_is_always_day_and_never_at_night() -> None:
    low, rain = {"sun_elevation": {"min": 0.1}}, {"max": MM_PER_HOUR}
    found = conditions.conditions_of(environment(rain=rain, **low, illumination=["day"]))
    assert [item.id for item in found] == ["best", "rain", "low_sun", "worst"]
    assert (found[-1].rain_mps, found[-1].sun_elevation_rad) == (MM_PER_HOUR, 0.1)
    found = conditions.conditions_of(environment(**low, illumination=["night"]))
    assert [item.sun_elevation_rad for item in found] == [None]


def test_target_has_the_default_size_and_surface_of_its_class() -> None:
    car = conditions.target("car")
    assert (car.length_m, car.width_m, car.height_m) == DEFAULT_SIZES["car"]
    assert car.reflectivity == DEFAULT_REFLECTIVITY["car"]


def test_pedestrian_is_the_harder_one_to_see() -> None:
    car, person = conditions.target("car"), conditions.target("pedestrian")
    assert person.cross_section_m2 < car.cross_section_m2
    assert person.contrast < car.contrast
    assert person.reflectivity < car.reflectivity


def test_cases_and_zones_name_targets() -> None:
    assert {case.target for case in conditions.CASES} <= set(conditions.TARGETS)
    assert {zone.target for zone in zones_of(5.0, 2.0)} <= set(conditions.TARGETS)
