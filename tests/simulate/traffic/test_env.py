"""The Gymnasium face: spaces, seeds, ended runs, test cases."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
import yaml
from gymnasium.utils.env_checker import check_env, data_equivalence
from gymnasium.utils.passive_env_checker import check_action_space, check_observation_space
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from adeye.errors import InputError, SpecError, UsageError
from adeye.simulate.traffic.env import (
    CONTACT_REWARD,
    ENV_ID,
    TrafficEnv,
    TrafficVectorEnv,
    draw_parameters,
)
from adeye.spec.scenario import LogicalScenario
from tests.motorway import make_case, make_scenario
from tests.refusals import refused

CHANGES: dict[str, Any] = {
    "parameters": {
        "ego_speed": {"default": "30 m/s", "range": ["72 km/h", "126 km/h"]},
        "gap": {"default": "40 m", "range": ["20 m", "80 m"]},
    },
    "constraints": ["gap > ego_speed * 1 s"],
    "actors": {
        "lead": {
            "kind": "car",
            "start": {"lane": 1, "speed": "20 m/s", "ahead_of": "ego", "gap": "gap"},
        }
    },
    "storyboard": {
        "brake": {"actor": "lead", "when": "time >= 0.5 s", "stop": {"rate": "5 m/s^2"}}
    },
    "horizon": "4 s",
    "tail": "1 s",
}


@pytest.fixture
def scenario() -> LogicalScenario:
    return make_scenario(**CHANGES)


@pytest.fixture
def env(scenario: LogicalScenario) -> TrafficVectorEnv:
    architecture = make_case(scenario).architecture
    return TrafficVectorEnv(4, scenario=scenario, architecture=architecture)


def idle(env: TrafficVectorEnv) -> Any:
    return np.zeros((env.num_envs, 2))


def test_spaces_pass_the_checks_of_gymnasium(env: TrafficVectorEnv) -> None:
    check_action_space(env.single_action_space)
    check_observation_space(env.single_observation_space)
    assert env.action_space == batch_space(env.single_action_space, 4)
    assert env.observation_space == batch_space(env.single_observation_space, 4)
    assert env.metadata["autoreset_mode"] is AutoresetMode.DISABLED


def test_every_observation_lies_in_the_space(env: TrafficVectorEnv) -> None:
    observation, _ = env.reset(seed=3)
    assert observation in env.observation_space
    env.action_space.seed(3)
    for _ in range(100):
        observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        assert observation in env.observation_space
        assert reward.shape == terminated.shape == truncated.shape == (4,)
        assert not (terminated & truncated).any()
    assert (terminated | truncated).all()


def test_one_seed_gives_one_course(env: TrafficVectorEnv) -> None:
    courses = []
    for _ in range(2):
        observations = [env.reset(seed=11)[0]]
        observations += [env.step(idle(env))[0] for _ in range(20)]
        courses.append(observations)
    assert data_equivalence(courses[0], courses[1], exact=True)


def test_without_a_seed_the_draws_go_on(env: TrafficVectorEnv) -> None:
    drawn = [env.reset(seed=1)[1]["parameters"]["gap"].tolist()]
    drawn += [env.reset()[1]["parameters"]["gap"].tolist() for _ in range(2)]
    assert len({value for values in drawn for value in values}) == 12
    assert env.reset(seed=1)[1]["parameters"]["gap"].tolist() == drawn[0]


def test_seeds_of_any_size_are_runs_of_their_own(env: TrafficVectorEnv) -> None:
    seeds = [
        place + offset for place in (0, 2**32, 2**63, 2**64, 2**65, 2**128) for offset in (3, 4)
    ]
    gaps = [env.reset(seed=seed)[1]["parameters"]["gap"].tolist() for seed in seeds]
    assert len({gap for run in gaps for gap in run}) == 4 * len(seeds)


def test_what_is_no_seed_is_refused(env: TrafficVectorEnv) -> None:
    scenario = make_scenario(**CHANGES)
    single = TrafficEnv(scenario=scenario, architecture=make_case(scenario).architecture)
    for given in (-1, True, 1.0, "1", [1, 2]):
        for made in (env, single):
            caught = refused(UsageError, made.reset, seed=given, says="reset: the seed is ")
            assert caught.remedy == "Give a whole number from 0."


def test_draws_keep_ranges_and_constraints(env: TrafficVectorEnv) -> None:
    for seed in range(10):
        parameters = env.reset(seed=seed)[1]["parameters"]
        assert ((parameters["gap"] >= 20.0) & (parameters["gap"] <= 80.0)).all()
        assert ((parameters["ego_speed"] >= 20.0) & (parameters["ego_speed"] <= 35.0)).all()
        assert (parameters["gap"] > parameters["ego_speed"]).all()


def test_a_parameter_without_range_keeps_its_default() -> None:
    values = draw_parameters(make_scenario(), 5, 0, 0)
    assert values == {"ego_speed": 30.0, "gap": 40.0}


def test_observations_are_not_changed_by_later_steps(env: TrafficVectorEnv) -> None:
    observation, _ = env.reset(seed=1)
    kept = {name: value.copy() for name, value in observation.items()}
    env.step(idle(env))
    assert data_equivalence(observation, kept, exact=True)


def test_reward_is_the_way_along_the_road(env: TrafficVectorEnv) -> None:
    observation, _ = env.reset(seed=1)
    _, reward, _, _, _ = env.step(idle(env))
    np.testing.assert_allclose(reward, observation["ego"][:, 3] * 0.05)


def test_stepping_finished_runs_changes_nothing_and_rewards_nothing(
    env: TrafficVectorEnv, scenario: LogicalScenario
) -> None:
    # The first two run into the braking lead, the last two stay behind it.
    cases = [make_case(scenario, {"ego_speed": v, "gap": 40.0}) for v in (35.0, 33.0, 3.0, 4.0)]
    env.reset(options={"cases": cases})
    rewards = []
    for _ in range(99):
        observation, reward, terminated, truncated, info = env.step(idle(env))
        rewards.append(reward)
    assert terminated.tolist() == [True, True, False, False]
    assert truncated.tolist() == [False] * 4
    assert observation["contact"].tolist() == [0, 0, -1, -1]
    assert (info["impact_speed"][:2] > 10.0).all()
    last, reward, terminated, truncated, _ = env.step(idle(env))
    assert truncated.tolist() == [False, False, True, True]
    np.testing.assert_array_equal(last["ego"][:2], observation["ego"][:2])
    assert reward[:2].tolist() == [0.0, 0.0]
    total = np.array(rewards)
    assert (total[:, :2] < CONTACT_REWARD + 2.0).sum(axis=0).tolist() == [1, 1]
    again, reward, _, _, _ = env.step(idle(env))
    assert reward.tolist() == [0.0] * 4
    for name in ("ego", "objects", "begun", "contact", "running"):
        np.testing.assert_array_equal(again[name], last[name])


def test_a_goal_terminates_and_a_horizon_truncates() -> None:
    scenario = make_scenario(**CHANGES, ego={"goal": {"s": "260 m"}})
    cases = [make_case(scenario, {"ego_speed": v, "gap": 500.0}) for v in (30.0, 10.0)]
    env = TrafficVectorEnv(2, scenario=scenario, architecture=cases[0].architecture)
    env.reset(options={"cases": cases})
    for _ in range(100):
        _, _, terminated, truncated, _ = env.step(idle(env))
    assert terminated.tolist() == [True, False]
    assert truncated.tolist() == [False, True]


def test_gymnasium_makes_it_by_its_id_and_files_are_read_strictly(
    tmp_path: Path, scenario: LogicalScenario
) -> None:
    case = make_case(scenario)
    env = gymnasium.make_vec(
        ENV_ID, num_envs=2, scenario=scenario, architecture=case.architecture, step=0.1
    )
    assert isinstance(env.unwrapped, TrafficVectorEnv)
    observation, _ = env.reset(seed=5)
    assert observation["ego"].shape == (2, 7)
    env.close()
    path = tmp_path / "nothing.yaml"
    path.write_text(yaml.safe_dump({"scenario": "nothing"}), "utf-8")
    with pytest.raises(InputError, match=r"nothing\.yaml:1:1: title is missing"):
        TrafficVectorEnv(2, scenario=path, architecture=case.architecture)


def courses(env: TrafficVectorEnv, ticks: int) -> list[Any]:
    return [env.step(idle(env))[:4] for _ in range(ticks)]


def test_masked_reset_begins_some_runs_and_the_others_go_on(scenario: LogicalScenario) -> None:
    cases = [
        make_case(scenario, {"ego_speed": speed, "gap": 70.0}) for speed in (20.0, 25.0, 30.0, 33.0)
    ]
    mask = np.array([True, False, True, False])
    env, alone = (
        TrafficVectorEnv(size, scenario=scenario, architecture=cases[0].architecture)
        for size in (4, 2)
    )
    env.reset(options={"cases": cases})
    courses(env, 10)
    kept = env.step(idle(env))[0]
    observation, info = env.reset(options={"cases": cases[:1] + cases[1:2], "reset_mask": mask})
    assert mask.tolist() == [True, False, True, False]
    assert observation in env.observation_space
    assert info["parameters"]["ego_speed"].tolist() == [20.0, 25.0, 25.0, 33.0]
    for name, values in observation.items():
        np.testing.assert_array_equal(values[~mask], kept[name][~mask])
    # Those that begin and those that go on are, bit for bit, what they are by themselves.
    begun, _ = alone.reset(options={"cases": cases[:2]})
    whole = TrafficVectorEnv(4, scenario=scenario, architecture=cases[0].architecture)
    whole.reset(options={"cases": cases})
    courses(whole, 11)
    for name, values in observation.items():
        np.testing.assert_array_equal(values[mask], begun[name])
    for mixed, first, rest in zip(
        courses(env, 100), courses(alone, 100), courses(whole, 100), strict=True
    ):
        for name, values in mixed[0].items():
            np.testing.assert_array_equal(values[mask], first[0][name])
            np.testing.assert_array_equal(values[~mask], rest[0][name][~mask])
        for part in (1, 2, 3):
            np.testing.assert_array_equal(mixed[part][mask], first[part])
            np.testing.assert_array_equal(mixed[part][~mask], rest[part][~mask])


def test_masked_draws_are_those_of_their_place_in_the_batch(env: TrafficVectorEnv) -> None:
    env.reset(seed=4)
    whole = env.reset()[1]["parameters"]["gap"]
    first = env.reset(seed=4)[1]["parameters"]["gap"]
    masked = env.reset(options={"reset_mask": np.array([False, True, False, False])})
    assert masked[1]["parameters"]["gap"].tolist() == [first[0], whole[1], first[2], first[3]]


def test_time_of_a_run_that_has_ended_stands_still(env: TrafficVectorEnv) -> None:
    env.reset(seed=3)
    ends = np.full(4, np.nan)
    for _ in range(140):
        observation, _, terminated, truncated, _ = env.step(idle(env))
        now = np.isnan(ends) & (terminated | truncated)
        ends[now] = observation["time"][now]
    assert np.array_equal(observation["time"], ends)
    assert ends.max() <= 5.0 + 1e-9


def test_options_that_mean_nothing_are_refused(env: TrafficVectorEnv) -> None:
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"mask": [True]}, "reset has no option 'mask'"),
        ({"reset_mask": np.zeros(4, dtype=bool)}, "and names no run"),
        ({"reset_mask": np.ones(3, dtype=bool)}, r"bool of shape \(3,\)"),
        ({"reset_mask": np.ones(4)}, "reset_mask is float64"),
        ({"reset_mask": np.array([True, False, False, False])}, "have never begun"),
    ]
    for options, message in wrong:
        refused(UsageError, env.reset, options=options, says=message)


def test_wrappers_of_gymnasium_reset_by_the_mask_as_with_its_own_vectors(
    env: TrafficVectorEnv,
) -> None:
    wrapped: Any = gymnasium.wrappers.vector.RecordEpisodeStatistics(env)
    wrapped.reset(seed=2)
    ended = np.zeros(4, dtype=bool)
    episodes = 0
    for _ in range(250):
        if ended.any():
            wrapped.reset(options={"reset_mask": ended})
            episodes += int(ended.sum())
        _, _, terminated, truncated, _ = wrapped.step(idle(env))
        ended = terminated | truncated
    assert episodes >= 8


# Speeds and angles have units, and places no ends.
@pytest.mark.filterwarnings("ignore:.*(symmetric and normalized|infinity)")
def test_single_form_passes_the_checks_of_gymnasium(scenario: LogicalScenario) -> None:
    given: Any = {"scenario": scenario, "architecture": make_case(scenario).architecture}
    single = gymnasium.make(f"adeye.simulate.traffic.env:{ENV_ID}", **given)
    assert isinstance(single.unwrapped, TrafficEnv)
    check_env(single.unwrapped)


def test_single_form_is_one_run_of_the_vector(scenario: LogicalScenario) -> None:
    given: Any = {"scenario": scenario, "architecture": make_case(scenario).architecture}
    single, vector = TrafficEnv(**given), TrafficVectorEnv(1, **given)
    one, told = single.reset(seed=3)
    every, info = vector.reset(seed=3)
    assert told["parameters"] == {name: v[0] for name, v in info["parameters"].items()}
    ended = False
    while not ended:
        assert all(np.array_equal(one[name], rows[0]) for name, rows in every.items())
        one, reward, terminated, truncated, _ = single.step(np.array([0.5, 0.0]))
        every, rewards, *ends, _ = vector.step(np.array([[0.5, 0.0]]))
        assert (reward, terminated, truncated) == (rewards[0], ends[0][0], ends[1][0])
        ended = terminated or truncated


def test_wrong_use_is_an_error_that_says_what_to_do(env: TrafficVectorEnv) -> None:
    with pytest.raises(UsageError, match=r"Call reset\(\) first"):
        env.step(idle(env))
    case = make_case(make_scenario(**CHANGES))
    refused(UsageError, env.reset, options={"cases": [case]}, says="1 test cases for 4 runs")
    refused(UsageError, env.reset, options={"cases": [1] * 4}, says="1 is no test case")
    asked = {"scenario": make_scenario(), "architecture": "odd/architectures/camera_radar.yaml"}
    refused(UsageError, TrafficVectorEnv, -1, **asked, says="num_envs is -1")
    refused(UsageError, TrafficVectorEnv, 1, **asked, step=0.0, says="step is 0.0")
    with pytest.raises(UsageError, match="other objects or events"):
        env.reset(options={"cases": [make_case(make_scenario())] * 4})
    env.reset(seed=1)
    with pytest.raises(UsageError, match=r"shape \(4,\), not \(4, 2\)"):
        env.step(np.zeros(4))
    with pytest.raises(UsageError, match="not finite"):
        env.step(np.full((4, 2), np.nan))


@pytest.mark.slow
def test_constraints_that_nothing_satisfies_are_an_error() -> None:
    scenario = make_scenario(**{**CHANGES, "constraints": ["gap > 100 m"]})
    env = TrafficVectorEnv(
        1, scenario=scenario, architecture=make_case(make_scenario()).architecture
    )
    refused(SpecError, env.reset, seed=1, says="none of 1000 draws")
