"""Learned policies: the network in NumPy, files that a stranger may have written, and how they are named."""

import json
import pickle
import zipfile
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import safetensors.numpy
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from trust_env import training
from trust_env.agents import Player, PolicyContext, build_policy, is_run
from trust_env.agents.learned.policy import Learned, Network, load_policy, save_policy, shipped
from trust_env.agents.learned.policy_file import FILE, MOST_BYTES, MOST_HEADER, tensor_shapes
from trust_env.agents.wrappers import build_view
from trust_env.defenses import build_defense
from trust_env.parallel import parallel_env
from trust_env.scenario import load_scenario
from trust_env.training.cli.main import main
from trust_env.training.evaluation.configuration import configuration, named_specs
from trust_env.vector import VectorEnv

pytestmark = pytest.mark.core
SCENARIO = "trio(horizon=12)"


def written(
    path: Any, view: str = "phantoms(n=2)", scenario: str = SCENARIO, seed: int = 0, **config: Any
) -> Any:
    """Write a policy of random weights that fits a scenario; the config can be made to differ. The path."""
    env = VectorEnv(scenario, "score", 1)
    agents = np.array([k for k, role in enumerate(env.scenario.roles) if role == "adversary"])
    one = np.zeros(1, dtype=np.int64)
    made = build_view(view)
    made.reset(
        PolicyContext(env.scenario, env.observation_table, agents, 0, one, one, np.ones(1, dtype=bool))
    )
    choices = getattr(made.action_space, "nvec", None)
    choices = None if choices is None else choices.tolist()
    outputs = made.action_space.shape[0] if choices is None else sum(choices)  # type: ignore[index]
    config = {
        "view": str(made),
        "knowledge": env.scenario.knowledge,
        "fields": dict(made.fields),
        "layers": [made.observation_size, 16, 8, outputs],
        "activation": "tanh",
        "choices": choices,
        "about": {"scenario": "trio", "defense": "score", "seed": seed, "steps": 0},
    } | config
    save_policy(path, weights(config["layers"], config["choices"], seed), config)
    return path


def weights(layers: list[int], choices: list[int] | None, seed: int = 0) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    shapes = tensor_shapes(layers, choices, True)
    tensors: dict[str, Any] = {
        name: rng.normal(0.0, 0.5, shape).astype(np.float32) for name, shape in shapes.items()
    }
    tensors["obs_var"] = rng.uniform(0.2, 2.0, layers[0])  # float64
    return tensors


PLAIN: dict[str, Any] = {
    "view": "raw",
    "knowledge": "own",
    "fields": {"pose": 4},
    "layers": [4, 3, 2],
    "activation": "relu",
    "choices": None,
    "about": {"steps": 10},
}


def plain(path: Path) -> Path:
    """A small file, which no scenario fits."""
    save_policy(path, weights(PLAIN["layers"], None), PLAIN)
    return path


def damaged(path: Path, tensors: dict[str, Any] | None = None, metadata: Any = None, **config: Any) -> Path:
    """A file that `save_policy` would refuse to write."""
    text = json.dumps({"format": 1, **PLAIN, **config})
    found = weights(PLAIN["layers"], None) | (tensors or {})
    data = safetensors.numpy.save(
        {name: values for name, values in found.items() if values is not None},
        {"trust_env": text} if metadata is None else metadata,
    )
    path.write_bytes(data)
    return path


def actions_of(
    attack: Any, worlds: np.ndarray, scenario: str = SCENARIO, frames: int = 12, seed: int = 5
) -> np.ndarray:
    """What all agents do, [frames, W, K, A], in worlds of the given numbers."""
    env = VectorEnv(scenario, "score", len(worlds), autoreset=False)
    player, played = Player(env, {"adversary": attack}), []
    observations, _ = env.reset(seed, options={"worlds": worlds})
    for _ in range(frames):
        played.append(player.actions(observations))
        observations, *_ = env.step(played[-1])
    return np.stack(played)


class TestNetwork:
    @pytest.mark.parametrize("activation", ["tanh", "relu"])
    @pytest.mark.parametrize("rows", [1, 64, 65])
    def test_it_is_the_perceptron_of_the_file(self, activation: str, rows: int) -> None:
        """Against the definition, row by row in float64."""
        layers, activate = [5, 7, 6, 3], {"tanh": np.tanh, "relu": lambda x: np.maximum(x, 0.0)}[activation]
        tensors = {name: values.astype(np.float64) for name, values in weights(layers, None).items()}
        inputs = np.random.default_rng(1).uniform(-1.0, 1.0, (rows, 5)).astype(np.float32)
        found = Network(weights(layers, None), {"layers": layers, "activation": activation})(inputs)
        assert found.shape == (rows, 3) and found.dtype == np.float32
        for x, y in zip(inputs.astype(np.float64), found):
            x = np.clip((x - tensors["obs_mean"]) / np.sqrt(tensors["obs_var"] + 1e-8), -10.0, 10.0)
            for name in ("pi.0", "pi.1"):
                x = activate(tensors[f"{name}.weight"] @ x + tensors[f"{name}.bias"])
            np.testing.assert_allclose(y, tensors["action.weight"] @ x + tensors["action.bias"], atol=1e-5)

    @pytest.mark.extra("train")
    @pytest.mark.parametrize("discrete", [False, True])
    def test_it_acts_as_in_stable_baselines3(self, discrete: bool) -> None:
        import torch
        from gymnasium.spaces import Box, MultiDiscrete
        from stable_baselines3.common.policies import ActorCriticPolicy

        torch.manual_seed(3)
        space = MultiDiscrete([3, 5, 2]) if discrete else Box(-1.0, 1.0, (4,), np.float32)
        theirs = ActorCriticPolicy(
            Box(-1.0, 1.0, (9,), np.float32), space, lambda _: 1e-3, net_arch=[32, 32], ortho_init=False
        )
        state = {name: values.numpy() for name, values in theirs.state_dict().items()}
        tensors = {
            f"{ours}.{part}": 3.0 * state[f"{name}.{part}"]
            for ours, name in (
                ("pi.0", "mlp_extractor.policy_net.0"),
                ("pi.1", "mlp_extractor.policy_net.2"),
                ("action", "action_net"),
            )
            for part in ("weight", "bias")
        }
        with torch.no_grad():
            for values in theirs.parameters():
                values *= 3.0
        config = {"layers": [9, 32, 32, 10 if discrete else 4], "activation": "tanh"}
        inputs = np.random.default_rng(0).uniform(-1.0, 1.0, (200, 9)).astype(np.float32)
        expected, _ = theirs.predict(inputs, deterministic=True)
        found = Network(tensors, config)(inputs)
        if discrete:
            parts = np.split(found, [3, 8], axis=-1)
            assert np.array_equal(np.stack([part.argmax(-1) for part in parts], -1), expected)
        else:
            assert (np.abs(expected) == 1.0).any() and (np.abs(expected) < 1.0).any()
            np.testing.assert_allclose(np.clip(found, -1.0, 1.0), expected, atol=1e-5)

    def test_what_overflows_is_refused_by_the_files_name(self, tmp_path: Path) -> None:
        policy = build_policy(str(written(tmp_path / FILE, activation="relu")))
        for name, values in policy.tensors.items():  # type: ignore[attr-defined]
            if name.endswith("weight"):
                values = np.full_like(values, 3e38)
            policy.tensors[name] = values  # type: ignore[attr-defined]
        policy._network = Network(policy.tensors, policy.config)  # type: ignore[attr-defined]
        with pytest.raises(ValueError, match=f"{FILE}: the weights give actions that are not finite"):
            actions_of(policy, np.arange(1), frames=1)


class TestPlay:
    @pytest.mark.parametrize("view", ["raw", "phantoms(n=2)", "grid"])
    @pytest.mark.parametrize("sampled", [False, True])
    def test_a_world_is_the_same_in_whatever_batch(self, tmp_path: Path, view: str, sampled: bool) -> None:
        spec = f"learned(path='{written(tmp_path / FILE, view)}', sampled={sampled})"
        together = actions_of(spec, np.arange(70))
        assert np.abs(together).max() > 0.0
        for w in (0, 33, 69):
            assert np.array_equal(actions_of(spec, np.array([w]))[:, 0], together[:, w])
        assert np.array_equal(actions_of(spec, np.array([69, 4, 33])), together[:, [69, 4, 33]])

    def test_the_single_world_sees_the_same_episode(self, tmp_path: Path) -> None:
        run = written(tmp_path / FILE) and str(tmp_path)
        batch = actions_of(run, np.arange(3), seed=7)
        env = parallel_env(SCENARIO, "score")
        player = Player(env, {"adversary": run})
        observations, _ = env.reset(seed=7, options={"world": 2, "episode": 0})
        for frame in range(12):
            actions = player.actions(observations)
            assert np.array_equal(np.stack(list(actions.values())), batch[frame, 2])
            observations, *_ = env.step(actions)

    def test_more_knowledge_changes_nothing(self, tmp_path: Path) -> None:
        path = str(written(tmp_path / FILE))
        own = actions_of(path, np.arange(4))
        for level in ("poses", "white_box"):
            assert np.array_equal(actions_of(path, np.arange(4), f"trio(horizon=12, knowledge={level})"), own)

    def test_less_knowledge_is_refused(self, tmp_path: Path) -> None:
        path = written(tmp_path / FILE, scenario="trio(horizon=12, knowledge=poses)")
        with pytest.raises(ValueError, match=r"'learned' needs knowledge level 'poses'.* gives 'own'"):
            actions_of(str(path), np.arange(1))
        results = training.evaluate(SCENARIO, str(path), "score", episodes=1, progress=False)
        assert "poses here for all cells" in results.notes[0]

    def test_other_sizes_are_refused_by_name(self, tmp_path: Path) -> None:
        path = written(tmp_path / FILE)
        size = load_scenario(SCENARIO).sensor.max_detections
        sizes = f"entries of the field detections: {2 * size} where it was trained .*, but {2 * size + 4} in"
        with pytest.raises(ValueError, match=sizes):
            actions_of(str(path), np.arange(1), f"trio(max_detections={size + 2})")
        raw = written(tmp_path / "raw.safetensors", "raw")
        with pytest.raises(ValueError, match=r"outputs: .* where it was trained"):
            actions_of(str(raw), np.arange(1), "trio(injection.slots=1)")

    def test_drawn_actions_follow_their_deviation(self, tmp_path: Path) -> None:
        """Without a network's say the actions are N(0, 0.3²)."""
        path = written(tmp_path / FILE, "raw")
        tensors, config = load_policy(path)
        tensors = {name: np.zeros_like(values) for name, values in tensors.items()}
        tensors["log_std"] += np.log(np.float32(0.3))
        save_policy(path, tensors, config)
        actions = actions_of(f"learned(path='{path}', sampled=True)", np.arange(200))
        drawn = actions[
            :, :, [k for k, role in enumerate(load_scenario(SCENARIO).roles) if role == "adversary"]
        ]
        assert abs(drawn.mean()) < 0.005 and abs(drawn.std() - 0.3) < 0.005
        assert not actions_of(str(path), np.arange(2)).any()

    def test_choices_are_drawn_in_proportion(self) -> None:
        from trust_env.agents.learned.policy import _drawn

        logits = np.log(np.array([0.5, 0.2, 0.3], dtype=np.float32)) + 700.0
        u = (np.arange(1000) + 0.5) / 1000
        drawn = _drawn(np.broadcast_to(logits.astype(np.float32), (1, 1000, 3)), u[None])
        np.testing.assert_allclose(np.bincount(drawn[0]) / 1000, [0.5, 0.2, 0.3], atol=2e-3)


class TestNaming:
    def test_a_run_is_a_folder_or_a_file(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.chdir(tmp_path)
        for folder in ("runs/a", "b", "honest"):
            Path(folder).mkdir(parents=True)
            written(Path(folder) / FILE)
        for text in (
            "runs/a",
            "./b",
            "b",
            "b/policy.safetensors",
            str(tmp_path / "b"),
            "learned(path='runs/a')",
        ):
            policy = build_policy(text)
            assert isinstance(policy, Learned) and policy.knowledge == "own", text
        assert type(build_policy("honest")).__name__ == "Honest"
        assert is_run("./honest") and not is_run("x.py:Mine") and not is_run("learned(path='runs/a')")
        inner: Any = build_policy("sleeper(start=2, inner=learned(path='runs/a'))")
        assert isinstance(inner.inner, Learned)
        assert repr(build_policy(repr(build_policy("runs/a")))) == repr(build_policy("runs/a"))

    def test_what_is_not_there_is_named(self, tmp_path: Path) -> None:
        (tmp_path / "empty").mkdir()
        with pytest.raises(
            ValueError, match=f"empty: there is no {FILE} in this folder; expected the folder"
        ):
            build_policy(str(tmp_path / "empty"))
        with pytest.raises(ValueError, match="runs/none: there is no such file; expected"):
            build_policy("runs/none")
        with pytest.raises(ValueError, match="against = 'nothing': expected one of"):
            build_policy("learned(against=nothing)")
        with pytest.raises(ValueError, match="nothing beside a path"):
            build_policy("learned(path='runs/a', against=trust)")
        with pytest.raises(ValueError, match="sampled = 1: expected True or False"):
            build_policy("learned(path='runs/a', sampled=1)")

    def test_it_is_evaluated_beside_the_scripted(self, tmp_path: Path) -> None:
        run = str(tmp_path / "run")
        Path(run).mkdir()
        written(Path(run) / FILE)
        results = training.evaluate(SCENARIO, f"{run},honest", "score", episodes=3, progress=False)
        assert [cell.attack for cell in results.cells] == [run, "honest"]
        damage = results[run, "score"].metrics["damage_per_frame"]
        assert damage.shape == (3,) and np.isfinite(damage).all()

    def test_results_depend_on_the_weights(self, tmp_path: Path) -> None:
        def files(attacks: str) -> dict[str, str]:
            found = configuration(
                load_scenario(SCENARIO),
                named_specs("attack", attacks, build_policy),
                named_specs("defense", "score", build_defense),
                1, 0, 12,
            )  # fmt: skip
            return found["files"]

        path = written(tmp_path / FILE)
        named = f"learned(path='{path}')"
        before = files(str(path))
        assert list(before) == [named] and len(before[named]) == 16
        assert files(f"sleeper(inner={named})") == before == files(str(path))
        written(path, seed=1)
        assert files(str(path))[named] != before[named]
        (tmp_path / "mine.py").write_text("from trust_env.agents.attacks.baseline import Honest as Mine")
        assert len(files(f"on_off(inner={tmp_path}/mine.py:Mine)")) == 1

    @pytest.mark.extra("train")
    def test_others_can_learn_against_it(self, tmp_path: Path) -> None:
        """An earlier run plays the adversaries while benign agents learn; it must stay what it was."""
        written(tmp_path / FILE)
        tiny = {"steps": 32, "worlds": 2, "threads": 1, "role": "benign", "evaluation.episodes": 1}
        tiny |= {"ppo.n_steps": 8, "ppo.batch_size": 16, "network.layers": [4]}
        others, out = {"adversary": str(tmp_path)}, tmp_path / "run"
        training.train(SCENARIO, "trust", out=out, others=others, overrides=tiny, progress=False)
        assert list(json.loads((out / "run.json").read_text())["files"]) == [f"learned(path='{tmp_path}')"]
        assert training.train(resume=out, progress=False).steps >= 32
        unfinished = (out / "config.yaml").read_text().replace("steps: 32", "steps: 64")
        (out / "config.yaml").write_text(unfinished)
        written(tmp_path / FILE, seed=1)
        with pytest.raises(ValueError, match=r"has changed since the run in .* began"):
            training.train(resume=out, progress=False)

    def test_it_can_be_shown(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        path = written(tmp_path / FILE)
        assert main(["attacks", "show", str(tmp_path), "--json"]) == 0
        shown = json.loads(capsys.readouterr().out)
        assert shown["name"] == "learned" and shown["file"] == str(path)
        assert shown["config"]["about"] == {"scenario": "trio", "defense": "score", "seed": 0, "steps": 0}
        assert main(["attacks", "show", str(tmp_path)]) == 0
        assert "view: phantoms(n=2" in capsys.readouterr().out
        assert main(["attacks", "show", "learned"]) == 0
        assert "shipped" in capsys.readouterr().out

    @pytest.mark.parametrize("against", shipped())
    def test_the_shipped_weights_play(self, against: str) -> None:
        attack = f"learned(against={against})"
        results = training.evaluate("patrol(horizon=20)", attack, against, episodes=2, progress=False)
        assert results[attack, against].metrics["damage_per_frame"].shape == (2,)


def broken(path: Path) -> dict[str, tuple[Path, str]]:
    """Files that are no policies, and what is said of them."""
    good = plain(path / "good").read_bytes()
    nan = weights(PLAIN["layers"], None)["pi.0.bias"] * np.nan
    fine = weights(PLAIN["layers"], None)["pi.0.bias"]

    def raw(name: str, data: bytes) -> Path:
        (path / name).write_bytes(data)
        return path / name

    def archive(name: str) -> Path:
        with zipfile.ZipFile(path / name, "w") as file:
            file.writestr("policy.pth", b"x" * 1000)
        return path / name

    header = json.dumps({"__metadata__": {"trust_env": "[" * 100000}}).encode()
    huge = {"trust_env": "{}", "filling": "x" * (MOST_HEADER + 1)}
    return {
        "empty": (raw("empty", b""), "it has 0 bytes; expected a safetensors file"),
        "text": (raw("text", b"a text that is not it"), "its header has .* expected at most"),
        "truncated": (raw("truncated", good[:-3]), "not the file of a learned policy"),
        "truncated header": (
            raw("short", good[:100]),
            "its header has .* a safetensors file that is complete",
        ),
        "huge header": (
            raw("huge", (2**63).to_bytes(8, "little") + good[8:]),
            "its header has 9223372036854775808",
        ),
        "long header": (damaged(path / "long", metadata=huge), f"expected at most {MOST_HEADER}"),
        "deep": (raw("deep", len(header).to_bytes(8, "little") + header), "expected JSON"),
        "zip": (archive("zip"), "it is a zip archive, as Stable-Baselines3 and PyTorch write them"),
        "pickle": (raw("pickle", pickle.dumps({"weights": [1.0] * 100})), "it is a pickle"),
        "large": (
            raw("large", good + bytes(MOST_BYTES)),
            f"expected a safetensors file of at most {MOST_BYTES}",
        ),
        "no config": (
            damaged(path / "none", metadata={"other": "x"}),
            "its metadata has no text 'trust_env'",
        ),
        "no JSON": (damaged(path / "json", metadata={"trust_env": "{"}), "trust_env: expected JSON"),
        "a list": (
            damaged(path / "list", metadata={"trust_env": "[1]"}),
            r"trust_env = \[1\]: expected a dict",
        ),
        "no key": (
            damaged(path / "key", metadata={"trust_env": "{}"}),
            "config: format is missing; expected 1",
        ),
        "format": (damaged(path / "format", format=2), "config: format = 2: expected 1"),
        "unknown key": (
            damaged(path / "extra", code="import os"),
            "config: unknown key 'code'; known: format, view",
        ),
        "view": (
            damaged(path / "view", view="nothing"),
            "config: view = 'nothing': expected one of the built-in",
        ),
        "view parameter": (damaged(path / "viewp", view="raw(x=1)"), "config: view = 'raw.x=1.'"),
        "knowledge": (
            damaged(path / "know", knowledge="all"),
            "config: knowledge = 'all': expected one of own, poses",
        ),
        "field": (
            damaged(path / "field", fields={"eyes": 4}),
            "config: fields = .*expected the names of fields",
        ),
        "field size": (damaged(path / "size", fields={"pose": "4"}), "config: fields = "),
        "layers": (
            damaged(path / "layers", layers=[4, 0, 2]),
            "config: layers = .*expected 2 to 16 whole numbers",
        ),
        "large view": (damaged(path / "vg", view="grid(g=100000)"), "config: view = 'grid.g=100000.'"),
        "list in a view": (damaged(path / "vl", view="grid(g=[5])"), r"config: view = 'grid\(g=\[5\]\)'"),
        "layers type": (damaged(path / "lt", layers=[4.0, 3, 2]), "config: layers = "),
        "many layers": (damaged(path / "ml", layers=[4] * 17), "config: layers = "),
        "activation": (
            damaged(path / "act", activation="gelu"),
            "config: activation = 'gelu': expected one of tanh",
        ),
        "choices": (damaged(path / "choices", choices=[2, 3]), "choices = .*expected sizes that sum to 2"),
        "about": (
            damaged(path / "about", about={"x": [1]}),
            "config: about = .*expected a dict of at most 64",
        ),
        "infinite fact": (damaged(path / "inf", about={"x": 1e308 * 10}), "config: about = "),
        "missing tensor": (
            damaged(path / "mt", {"log_std": None}),
            "tensor log_std is missing; expected pi.0.weight",
        ),
        "half normalised": (damaged(path / "hn", {"obs_var": None}), "tensor obs_var is missing"),
        "unknown tensor": (
            damaged(path / "ut", {"vf.0.bias": fine}),
            "unknown tensor 'vf.0.bias'; expected pi.0",
        ),
        "shape": (
            damaged(path / "shape", {"pi.0.bias": fine[:2]}),
            r"tensor pi.0.bias has shape \[2\]; expected \[3\]",
        ),
        "dtype": (
            damaged(path / "dt", {"pi.0.bias": fine.astype(np.float64)}),
            "has dtype float64; expected float32",
        ),
        "integers": (
            damaged(path / "int", {"pi.0.bias": fine.astype(np.int32)}),
            "has dtype 'I32'; expected F32",
        ),
        "nan": (
            damaged(path / "nan", {"pi.0.bias": nan}),
            "tensor pi.0.bias has entries that are not finite",
        ),
        "variance": (
            damaged(path / "var", {"obs_var": -np.ones(4)}),
            "obs_var has negative entries; expected var",
        ),
        "deviation": (
            damaged(path / "std", {"log_std": fine[:2] + 90}),
            "log_std has large entries; expected at",
        ),
    }


def attempt(file: Path) -> tuple[Any, str]:
    """What a file holds, or why it is refused."""
    try:
        return load_policy(file), ""
    except ValueError as fault:
        return None, str(fault)


class TestFile:
    def test_what_is_written_reads_back(self, tmp_path: Path) -> None:
        tensors, config = load_policy(plain(tmp_path / "x.safetensors"))
        assert config == {"format": 1, **PLAIN}
        expected = weights(PLAIN["layers"], None)
        assert set(tensors) == set(expected)
        for name, values in expected.items():
            assert np.array_equal(tensors[name], values) and tensors[name].dtype == values.dtype
        assert plain(tmp_path / "y").read_bytes() == (tmp_path / "x.safetensors").read_bytes()
        save_policy(tmp_path, expected, PLAIN)
        assert sorted(p.name for p in tmp_path.iterdir()) == [FILE, "x.safetensors", "y"]

    def test_what_would_not_load_is_not_written(self, tmp_path: Path) -> None:
        path = plain(tmp_path / "x")
        before = path.read_bytes()
        with pytest.raises(ValueError, match="config: activation = 'gelu'"):
            save_policy(path, weights(PLAIN["layers"], None), PLAIN | {"activation": "gelu"})
        with pytest.raises(ValueError, match=r"action.weight has shape"):
            save_policy(path, weights([4, 3, 3], None), PLAIN)
        assert path.read_bytes() == before and len(list(tmp_path.iterdir())) == 1

    def test_malformed_files_are_refused_by_name(self, tmp_path: Path) -> None:
        for name, (file, expected) in broken(tmp_path).items():
            with pytest.raises(
                ValueError, match=f"(?s){file}: not the file of a learned policy: .*"
            ) as fault:
                load_policy(file)
            assert fault.match(expected), name
            with pytest.raises(ValueError, match=expected):
                build_policy(f"learned(path='{file}')")

    def test_links_that_lead_nowhere_are_refused(self, tmp_path: Path) -> None:
        (tmp_path / "loop").symlink_to(tmp_path / "loop")
        (tmp_path / "gone").symlink_to(tmp_path / "nothing")
        (tmp_path / "folder").mkdir()
        (tmp_path / "folder" / FILE).symlink_to("/dev/zero")
        for name in ("loop", "gone", "folder"):
            with pytest.raises(ValueError, match=f"{name}: there is no"):
                load_policy(tmp_path / name)

    @pytest.mark.parametrize(
        "view", ["{file}:View", "'{file}:View'", "phantoms(n='{file}:View')", "raw(x={file}:View())"]
    )
    def test_no_code_of_a_file_runs(self, tmp_path: Path, view: str) -> None:
        (tmp_path / "evil.py").write_text("open(__file__ + '.ran', 'w'); View = print")
        path = damaged(tmp_path / FILE, view=view.format(file=tmp_path / "evil.py"))
        with pytest.raises(ValueError, match=r"config: view = .*expected one of the built-in views"):
            build_policy(str(path))
        assert sorted(p.name for p in tmp_path.iterdir()) == ["evil.py", FILE]

    @given(data=st.data())
    @settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
    def test_damage_is_never_more_than_a_value_error(self, tmp_path: Path, data: st.DataObject) -> None:
        good = plain(tmp_path / "good").read_bytes()
        size = 8 + int.from_bytes(good[:8], "little")
        changed = bytearray(good)
        for _ in range(data.draw(st.integers(1, 4))):
            at = data.draw(st.integers(0, (size if data.draw(st.booleans()) else len(good)) - 1))
            changed[at] ^= 1 << data.draw(st.integers(0, 7))
        if data.draw(st.booleans()):
            del changed[data.draw(st.integers(0, len(changed))) :]
        (tmp_path / "changed").write_bytes(changed)
        loaded, fault = attempt(tmp_path / "changed")
        if loaded is None:
            assert str(tmp_path / "changed") in fault
            return
        tensors, config = loaded
        assert [config["layers"][0]] == list(tensors["obs_mean"].shape)
        for (before, after), name in zip(pairwise(config["layers"]), ("pi.0", "action")):
            assert tensors[f"{name}.weight"].shape == (after, before)
            assert np.isfinite(tensors[f"{name}.weight"]).all()

    @given(
        value=st.recursive(
            st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
            lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
            max_leaves=6,
        ),
        key=st.sampled_from(list(PLAIN)),
    )
    @settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
    def test_any_value_in_the_config_is_fine_or_refused(self, tmp_path: Path, key: str, value: Any) -> None:
        loaded, fault = attempt(damaged(tmp_path / "any", **{key: value}))
        assert loaded is not None or "any: not the file of a learned policy: " in fault
