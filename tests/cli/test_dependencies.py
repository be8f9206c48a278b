"""``dependencies``: tables, JSON, and what it refuses; ``plan`` counts the same."""

from typing import Any

import pytest

from adeye.spec.load import shipped

ODD = str(shipped("odd") / "motorway_chauffeur.yaml")


def test_table_says_what_is_shared_and_what_is_not(adeye: Any) -> None:
    ended = adeye("dependencies", ODD, "--architecture", "camera_radar")
    assert ended.code == 0, ended.err
    first, *rest = ended.out.strip().splitlines()
    assert first == (
        "camera_radar: safety and nominal share 9 things; "
        "no sensor, no ego estimate, no resource, no element"
    )
    text = "\n".join(rest)
    assert "legacy_camera" not in ended.out
    assert "simulate/channels/perception/step.py" in text
    assert "hooks.safety, hooks.nominal (map_shifted)" in text


def test_json_holds_every_pair_with_its_targets(adeye: Any) -> None:
    document = adeye("dependencies", ODD, "--json").document
    assert document["schema"] == "adeye/dependencies@1"
    legacy, candidate = document["architectures"]
    assert (legacy["architecture"], candidate["architecture"]) == ("legacy_camera", "camera_radar")
    (pair,) = candidate["pairs"]
    assert (pair["first"], pair["second"], pair["unstated"]) == ("safety", "nominal", [])
    shared = {item["what"]: item for item in pair["shared"]}
    assert shared["nominal → safety"]["targets"] == ["links.safety.channels.nominal"]


@pytest.mark.slow
def test_plan_counts_what_the_table_lists(adeye: Any) -> None:
    document = adeye("dependencies", ODD, "--json").document
    lines = {
        item["architecture"]: sum(len(pair["shared"]) for pair in item["pairs"])
        for item in document["architectures"]
    }
    assert adeye("plan", ODD, "--json").document["shared"] == lines
    told = ", ".join(f"{name} {count}" for name, count in lines.items())
    assert adeye("plan", ODD).out.strip().endswith(f"(adeye dependencies): {told}")


@pytest.mark.slow
def test_single_channel_has_nobody_to_share_anything_and_no_line_in_the_plan(adeye: Any) -> None:
    odd = str(shipped("odd") / "sensor_study.yaml")
    ended = adeye("dependencies", odd, "--architecture", "study_camera")
    assert ended.out == "study_camera: one channel, with nobody to share anything\n"
    assert "Shared by channels" not in adeye("plan", odd).out


def test_architecture_that_is_not_there_is_a_usage_error(adeye: Any) -> None:
    ended = adeye("dependencies", ODD, "--architecture", "camera_rader")
    assert ended.code == 2
    assert "no architecture 'camera_rader'. Did you mean 'camera_radar'?" in ended.err
