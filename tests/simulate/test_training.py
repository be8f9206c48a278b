"""The environment of a policy channel: what is trained in it drives as it does in a campaign."""

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env, data_equivalence

from adeye.errors import UsageError
from adeye.simulate import engine
from adeye.simulate.training import ENV_ID, PolicyEnv
from adeye.spec.architecture import Architecture
from adeye.spec.load import load_architecture, load_scenario, merge
from adeye.sweep.case import lone_case
from docs import walk
from tests.refusals import refused

ROOT = Path(__file__).resolve().parents[2]
SCENARIO = load_scenario(ROOT / "scenarios_db" / "motorway" / "cut_in.yaml").spec

KEEPER = """
import numpy as np

def drive(observation):
    ego, objects = observation["ego"], observation["objects"]
    ahead = (objects[:, 0] > 0) & (objects[:, 1] > 0) & (np.abs(objects[:, 2]) < 2.0)
    gap = objects[ahead, 1].min(initial=200.0)
    pull = min(0.5 * (ego[8] - ego[0]), 0.4 * (gap - 10.0 - 1.5 * ego[0]))
    return max(float(pull), -8.0), float(-0.01 * ego[4] - 0.2 * ego[3])
"""


def architecture_of(rate: str = "20 Hz", delay: str = "0 s", **parameters: Any) -> Architecture:
    """Return the candidate with a policy alone."""
    content = load_architecture(ROOT / "odd" / "architectures" / "camera_radar.yaml").content
    channel = {
        "kind": "policy",
        "rate": rate,
        "delay": delay,
        "parameters": {"policy": "./keeper.py:drive", **parameters},
    }
    content = merge(content, {"channels": {"nominal": channel}})
    del content["channels"]["safety"]
    content["switch"] = {
        "policy": "fixed_priority",
        "priority": ["nominal"],
        "default": "nominal",
        "staleness": "0.5 s",
    }
    return Architecture.model_validate(content)


def made(**more: Any) -> PolicyEnv:
    return PolicyEnv(scenario=SCENARIO, architecture=architecture_of(**more))


@pytest.mark.parametrize("observation", ["kinematics", "kinematics_flat"])
def test_passes_the_checks_of_gymnasium(observation: str) -> None:
    given: Any = {
        "scenario": SCENARIO,
        "architecture": architecture_of(observation=observation, nearest=3),
    }
    env = gymnasium.make(f"adeye.simulate.training:{ENV_ID}", **given)
    check_env(env.unwrapped)
    env.close()


def test_vector_form_is_the_single_one_side_by_side() -> None:
    given: Any = {"scenario": SCENARIO, "architecture": architecture_of()}
    vector: Any = gymnasium.make_vec(
        f"adeye.simulate.training:{ENV_ID}", num_envs=2, vectorization_mode="sync", **given
    )
    seen, _ = vector.reset(seed=[4, 9])
    assert vector.observation_space.contains(seen)
    single = PolicyEnv(**given)
    one, _ = single.reset(seed=9)
    for _ in range(20):
        actions = np.full((2, 2), [0.2, 0.0], dtype=np.float32)
        seen, reward, *_ = vector.step(actions)
        one, alone, *_ = single.step(actions[1])
        assert data_equivalence({name: rows[1] for name, rows in seen.items()}, one)
        assert reward[1] == alone
    vector.close()


@pytest.mark.parametrize(
    ("rate", "delay"), [("20 Hz", "0 s"), ("20 Hz", "0.05 s"), ("10 Hz", "0.1 s")]
)
def test_policy_drives_there_as_in_a_run(rate: str, delay: str, tmp_path: Path) -> None:
    (tmp_path / "keeper.py").write_text(KEEPER)
    space: dict[str, Any] = {}
    exec(KEEPER, space)  # noqa: S102 - the policy above
    env = made(rate=rate, delay=delay, normalised=False)
    observation, info = env.reset(seed=5)
    case = lone_case(
        SCENARIO,
        architecture_of(rate, delay, normalised=False),
        info["parameters"],
        step=0.05,
        seed=5,
    )
    trace = engine.run([case], base_dirs={case.architecture.architecture: tmp_path})
    ended, total = False, 0.0
    while not ended:
        ego = trace["ego"][0, env._scene.tick]
        assert env._scene.ego[0].tolist() == ego.tolist()
        observation, reward, terminated, truncated, _ = env.step(space["drive"](observation))
        total += reward
        ended = terminated or truncated
    last = int(trace.length[0]) - 1
    assert env._scene.tick >= last > 300
    way = trace["ego_place"][0, [0, last], 0]
    assert total == pytest.approx(way[1] - way[0], abs=3.0)
    env.close()


def test_what_cannot_be_trained_is_refused() -> None:
    candidate = load_architecture(ROOT / "odd" / "architectures" / "camera_radar.yaml").spec
    refused(UsageError, PolicyEnv, scenario=SCENARIO, architecture=candidate, says="has 0 channels")
    for step in (0.0, -0.1, np.nan, 1.5, True, "0.05 s"):
        given = {"scenario": SCENARIO, "architecture": architecture_of(), "step": step}
        refused(UsageError, PolicyEnv, **given, says="step is ")
    env = made()
    refused(UsageError, env.step, np.zeros(2), says="was not reset")
    refused(UsageError, env.reset, options={"cases": []}, says="no option 'cases'")
    refused(UsageError, env.reset, seed=-1, says="the seed is -1")
    env.reset(seed=1)
    refused(UsageError, env.step, np.full(2, np.nan), says="not finite")
    env.close()


STUB = """
import numpy as np


class Values:
    def __init__(self, values):
        self.values = values

    def detach(self):
        return self

    def numpy(self):
        return self.values


class Layer:
    def __init__(self, *shape):
        self.weight, self.bias = Values(np.full(shape, 0.1)), Values(np.zeros(shape[0]))


class PPO:
    def __init__(self, kind, env, **given):
        self.env, self.policy = env, self
        self.mlp_extractor, self.policy_net, self.action_net = self, [], Layer(1, 3)

    def learn(self, steps):
        seen, _ = self.env.reset(seed=1)
        ended = False
        while not ended:
            assert self.env.observation_space.contains(seen)
            seen, reward, *ends, _ = self.env.step(np.zeros(1, dtype=np.float32))
            ended = any(ends)
"""


@pytest.mark.slow
@pytest.mark.parametrize("is_real", [False, True])
def test_script_of_the_guide_trains(tmp_path: Path, *, is_real: bool) -> None:
    if is_real:
        pytest.importorskip("stable_baselines3", reason="needs Stable-Baselines3")
    else:
        # With what it calls of the library in the place of it.
        (tmp_path / "stable_baselines3.py").write_text(STUB)
    for folder in walk.COPIED:
        shutil.copytree(ROOT / folder, tmp_path / folder)
    page = (ROOT / "docs" / "guide" / "gymnasium.md").read_text("utf-8")
    for name, text in walk.files_of(page).items():
        (tmp_path / name).write_text(text.replace("20_000", "500"), "utf-8")
    weights = tmp_path / "odd" / "architectures" / "cruise.json"
    weights.unlink()
    subprocess.run([sys.executable, "train.py"], cwd=tmp_path, check=True)
    layers = [np.array(layer) for layer in json.loads(weights.read_text())]
    assert layers[-1].shape[0] == 1
    assert all(np.isfinite(layer).all() for layer in layers)
