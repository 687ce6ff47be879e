"""Policy files: what is saved loads again, and damaged or hostile files raise ValueError and run nothing."""

from __future__ import annotations

import json
import pickle
import zipfile
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from policy_files import SMALL_CONFIG, weights, write_small, write_unchecked

from trust_env.agents import build_policy
from trust_env.agents.learned.policy_file import FILE, MOST_BYTES, MOST_HEADER, load_policy, save_policy

pytestmark = pytest.mark.core


def malformed(path: Path) -> dict[str, tuple[Path, str]]:
    """Files that hold no policy, and a part of the error that each raises."""
    return malformed_bytes(path) | malformed_configs(path) | malformed_tensors(path)


def malformed_bytes(path: Path) -> dict[str, tuple[Path, str]]:
    cases: dict[str, tuple[Path, str]] = {}

    def case(name: str, expected: str, data: bytes) -> None:
        (path / name).write_bytes(data)
        cases[name] = path / name, expected

    good = write_small(path / "good").read_bytes()
    with zipfile.ZipFile(path / "archive", "w") as file:
        file.writestr("policy.pth", b"x" * 1000)
    deep = json.dumps({"__metadata__": {"trust_env": "[" * 100000}}).encode()
    case("empty", "it has 0 bytes; expected a safetensors file", b"")
    case("text", "its header has .* expected at most", b"a text that is not it")
    case("truncated", "not the file of a learned policy", good[:-3])
    case("truncated header", "its header has .* a safetensors file that is complete", good[:100])
    case("huge header", "its header has 9223372036854775808", (2**63).to_bytes(8, "little") + good[8:])
    case("deep", "expected JSON", len(deep).to_bytes(8, "little") + deep)
    zipped = (path / "archive").read_bytes()
    case("zip", "it is a zip archive, as Stable-Baselines3 and PyTorch write them", zipped)
    case("pickle", "it is a pickle", pickle.dumps({"weights": [1.0] * 100}))
    case("large", f"expected a safetensors file of at most {MOST_BYTES}", good + bytes(MOST_BYTES))
    return cases


def malformed_configs(path: Path) -> dict[str, tuple[Path, str]]:
    cases: dict[str, tuple[Path, str]] = {}

    def case(name: str, expected: str, **changes: Any) -> None:
        cases[name] = write_unchecked(path / name, **changes), expected

    long = {"trust_env": "{}", "filling": "x" * (MOST_HEADER + 1)}
    case("long header", f"expected at most {MOST_HEADER}", metadata=long)
    case("no config", "its metadata has no text 'trust_env'", metadata={"other": "x"})
    case("no JSON", "trust_env: expected JSON", metadata={"trust_env": "{"})
    case("a list", r"trust_env = \[1\]: expected a dict", metadata={"trust_env": "[1]"})
    case("no key", "config: format is missing; expected 1", metadata={"trust_env": "{}"})
    case("format", "config: format = 2: expected 1", format=2)
    case("unknown key", "config: unknown key 'code'; known: format, wrapper", code="import os")
    case("wrapper", "config: wrapper = 'nothing': expected one of the built-in", wrapper="nothing")
    case("wrapper parameter", "config: wrapper = 'raw.x=1.'", wrapper="raw(x=1)")
    case("large wrapper", "config: wrapper = 'grid.g=100000.'", wrapper="grid(g=100000)")
    case("list in a wrapper", r"config: wrapper = 'grid\(g=\[5\]\)'", wrapper="grid(g=[5])")
    case("knowledge", "config: knowledge = 'all': expected one of own, poses", knowledge="all")
    case("field", "config: fields = .*expected the names of fields", fields={"eyes": 4})
    case("field size", "config: fields = ", fields={"pose": "4"})
    case("layers", "config: layers = .*expected 2 to 16 whole numbers", layers=[4, 0, 2])
    case("layers type", "config: layers = ", layers=[4.0, 3, 2])
    case("many layers", "config: layers = ", layers=[4] * 17)
    case("activation", "config: activation = 'gelu': expected one of tanh", activation="gelu")
    case("choices", "choices = .*expected sizes that sum to 2", choices=[2, 3])
    case("about", "config: about = .*expected a dict of at most 64", about={"x": [1]})
    case("infinite fact", "config: about = ", about={"x": 1e308 * 10})
    return cases


def malformed_tensors(path: Path) -> dict[str, tuple[Path, str]]:
    cases: dict[str, tuple[Path, str]] = {}

    def case(name: str, expected: str, tensor: str, values: Any) -> None:
        cases[name] = write_unchecked(path / name, {tensor: values}), expected

    bias = weights(SMALL_CONFIG["layers"], None)["pi.0.bias"]
    case("missing tensor", "tensor log_std is missing; expected pi.0.weight", "log_std", None)
    case("half normalised", "tensor obs_var is missing", "obs_var", None)
    case("unknown tensor", "unknown tensor 'vf.0.bias'; expected pi.0", "vf.0.bias", bias)
    case("shape", r"tensor pi.0.bias has shape \[2\]; expected \[3\]", "pi.0.bias", bias[:2])
    case("dtype", "has dtype float64; expected float32", "pi.0.bias", bias.astype(np.float64))
    case("integers", "has dtype 'I32'; expected F32", "pi.0.bias", bias.astype(np.int32))
    case("nan", "tensor pi.0.bias has entries that are not finite", "pi.0.bias", bias * np.nan)
    case("variance", "obs_var has negative entries; expected var", "obs_var", -np.ones(4))
    case("deviation", "log_std has large entries; expected at", "log_std", bias[:2] + 90)
    return cases


def load_or_error(file: Path) -> tuple[Any, str]:
    """What a file holds, else the error."""
    try:
        return load_policy(file), ""
    except ValueError as fault:
        return None, str(fault)


class TestFile:
    def test_a_saved_policy_loads_again(self, tmp_path: Path) -> None:
        tensors, config = load_policy(write_small(tmp_path / "x.safetensors"))
        assert config == {"format": 1, **SMALL_CONFIG}
        expected = weights(SMALL_CONFIG["layers"], None)
        assert set(tensors) == set(expected)
        for name, values in expected.items():
            assert np.array_equal(tensors[name], values) and tensors[name].dtype == values.dtype
        assert write_small(tmp_path / "y").read_bytes() == (tmp_path / "x.safetensors").read_bytes()
        save_policy(tmp_path, expected, SMALL_CONFIG)
        assert sorted(p.name for p in tmp_path.iterdir()) == [FILE, "x.safetensors", "y"]

    def test_what_would_not_load_is_not_saved(self, tmp_path: Path) -> None:
        path = write_small(tmp_path / "x")
        before = path.read_bytes()
        with pytest.raises(ValueError, match="config: activation = 'gelu'"):
            save_policy(path, weights(SMALL_CONFIG["layers"], None), SMALL_CONFIG | {"activation": "gelu"})
        with pytest.raises(ValueError, match=r"action.weight has shape"):
            save_policy(path, weights([4, 3, 3], None), SMALL_CONFIG)
        assert path.read_bytes() == before and len(list(tmp_path.iterdir())) == 1

    def test_malformed_files_raise_and_are_named(self, tmp_path: Path) -> None:
        for name, (file, expected) in malformed(tmp_path).items():
            with pytest.raises(ValueError, match=f"(?s){file}: not the file of a learned policy: .*") as fault:
                load_policy(file)
            assert fault.match(expected), name
            with pytest.raises(ValueError, match=expected):
                build_policy(f"learned(path='{file}')")

    def test_dangling_links_raise(self, tmp_path: Path) -> None:
        (tmp_path / "loop").symlink_to(tmp_path / "loop")
        (tmp_path / "gone").symlink_to(tmp_path / "nothing")
        (tmp_path / "folder").mkdir()
        (tmp_path / "folder" / FILE).symlink_to("/dev/zero")
        for name in ("loop", "gone", "folder"):
            with pytest.raises(ValueError, match=f"{name}: there is no"):
                load_policy(tmp_path / name)

    @pytest.mark.parametrize(
        "wrapper",
        ["{file}:Wrapper", "'{file}:Wrapper'", "phantoms(n='{file}:Wrapper')", "raw(x={file}:Wrapper())"],
    )
    def test_loading_runs_no_code_that_a_file_names(self, tmp_path: Path, wrapper: str) -> None:
        (tmp_path / "evil.py").write_text("open(__file__ + '.ran', 'w'); Wrapper = print")
        path = write_unchecked(tmp_path / FILE, wrapper=wrapper.format(file=tmp_path / "evil.py"))
        with pytest.raises(ValueError, match=r"config: wrapper = .*expected one of the built-in wrappers"):
            build_policy(str(path))
        assert sorted(p.name for p in tmp_path.iterdir()) == ["evil.py", FILE]

    @given(data=st.data())
    @settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
    def test_damage_is_never_more_than_a_value_error(self, tmp_path: Path, data: st.DataObject) -> None:
        good = write_small(tmp_path / "good").read_bytes()
        size = 8 + int.from_bytes(good[:8], "little")
        changed = bytearray(good)
        for _ in range(data.draw(st.integers(1, 4))):
            at = data.draw(st.integers(0, (size if data.draw(st.booleans()) else len(good)) - 1))
            changed[at] ^= 1 << data.draw(st.integers(0, 7))
        if data.draw(st.booleans()):
            del changed[data.draw(st.integers(0, len(changed))) :]
        (tmp_path / "changed").write_bytes(changed)
        loaded, fault = load_or_error(tmp_path / "changed")
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
        key=st.sampled_from(list(SMALL_CONFIG)),
    )
    @settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
    def test_any_value_in_the_config_loads_or_raises_value_error(self, tmp_path: Path, key: str, value: Any) -> None:
        loaded, fault = load_or_error(write_unchecked(tmp_path / "any", **{key: value}))
        assert loaded is not None or "any: not the file of a learned policy: " in fault
