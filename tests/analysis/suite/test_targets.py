"""Targets and cases refer to what is there."""

from adeye.analysis.suite.conditions import CASES, TARGETS, target
from adeye.analysis.suite.geometry import zones_of
from adeye.simulate.world.objects import DEFAULT_REFLECTIVITY, DEFAULT_SIZES


def test_target_has_the_default_size_and_surface_of_its_class() -> None:
    car = target("car")
    assert (car.length_m, car.width_m, car.height_m) == DEFAULT_SIZES["car"]
    assert car.reflectivity == DEFAULT_REFLECTIVITY["car"]


def test_pedestrian_is_the_harder_one_to_see() -> None:
    car, person = TARGETS["car"], TARGETS["pedestrian"]
    assert person.cross_section_m2 < car.cross_section_m2
    assert person.contrast < car.contrast
    assert person.reflectivity < car.reflectivity


def test_cases_and_zones_name_targets() -> None:
    assert {case.target for case in CASES} <= set(TARGETS)
    assert {zone.target for zone in zones_of(5.0, 2.0)} <= set(TARGETS)
