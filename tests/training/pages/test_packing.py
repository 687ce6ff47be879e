"""Packed numbers: exact integers, floats within half a step, and text that can stand in a page."""

import base64
import gzip
import json

import numpy as np
import pytest

from trust_env.training.pages.packing import pack
from trust_env.training.pages.page import as_script_data


def unpacked(packed):
    """The arrays again, as `unpack.js` reads them."""
    data, offset, found = gzip.decompress(base64.b64decode(packed["data"])), 0, {}
    for name, kind, length, low, step in packed["fields"]:
        integers = np.frombuffer(data, kind, length, offset)
        assert offset % integers.itemsize == 0  # typed arrays of a browser begin at whole numbers
        offset += integers.nbytes
        found[name] = integers if step == 0 else np.where(integers == 65535, np.nan, low + step * integers)
    return found


def test_integers_stay_exact_and_take_the_least_room():
    arrays = {"many": np.arange(70000), "few": np.array([0, 255]), "yes": np.array([True, False])}
    arrays["none"] = np.array([], dtype=int)
    packed = pack(arrays)
    found = unpacked(packed)
    assert all(found[name].tolist() == array.tolist() for name, array in arrays.items())
    kinds = {name: kind for name, kind, *_ in packed["fields"]}
    assert (kinds["many"], kinds["few"]) == ("uint32", "uint8")


def test_floats_are_off_by_half_a_step_at_most_and_nan_stays():
    values = np.array([[-3.0, np.nan], [1.0 / 3.0, 5.0]])
    found = unpacked(pack({"x": values, "same": np.full(3, 7.5), "absent": np.full(2, np.nan)}))
    assert found["x"] == pytest.approx(values.ravel(), abs=8.0 / 131068, nan_ok=True)
    assert found["same"].tolist() == [7.5] * 3
    assert np.isnan(found["absent"]).all()


def test_what_cannot_be_packed_is_refused_by_name():
    with pytest.raises(ValueError, match="depth: expected finite numbers"):
        pack({"depth": np.array([np.inf])})
    with pytest.raises(ValueError, match="count: expected no negative integer; got -1"):
        pack({"count": np.array([3, -1])})


def test_equal_arrays_give_equal_text():
    assert pack({"x": np.arange(9.0)}) == pack({"x": np.arange(9.0)})


def test_data_cannot_end_the_script_that_holds_it():
    hostile = {"name": "</script><!--<script>\u2028"}
    text = as_script_data(hostile)
    assert "<" not in text and "\u2028" not in text
    assert json.loads(text) == hostile
