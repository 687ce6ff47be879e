"""Specs, names with parameters: `trust`, `trust(preset=cdc2024)`, `my_file.py:MyDefense(window=9)`."""

from trust_env.spec.expression import Spec, load_object, parse, split_specs

__all__ = ["Spec", "load_object", "parse", "split_specs"]
