"""Recorded trajectories: the grid, gaps, stale rows and broken files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from paths import TRAFFIC

from trust_env.scenario.recording import cached_recording, read_recording

NAN = np.nan


@pytest.fixture
def csv_file(tmp_path: Path):
    def write(text: str) -> Path:
        path = tmp_path / "traffic.csv"
        path.write_text(text)
        return path

    return write


def test_positions_are_interpolated_on_the_grid(csv_file) -> None:
    found = read_recording(csv_file("t,id,x,y\n10,a,0,0\n14,a,8,-4\n11,b,5,5\n13,b,7,5\n"), dt=1.0)
    assert found.times.tolist() == [10, 11, 12, 13, 14]
    assert found.ids == ("a", "b")
    assert found.left_out == ()
    np.testing.assert_allclose(found.positions[:, 0], [[0, 0], [2, -1], [4, -2], [6, -3], [8, -4]])
    expected = [[NAN, NAN], [5, 5], [6, 5], [7, 5], [NAN, NAN]]
    np.testing.assert_allclose(found.positions[:, 1], expected)
    assert not found.positions.flags.writeable


def test_order_duplicates_and_blank_lines_do_not_matter(csv_file) -> None:
    tidy = read_recording(csv_file("t,id,x,y\n0,a,0,0\n1,a,3,0\n2,a,4,0\n"), dt=1.0)
    rough = read_recording(
        csv_file(' T , Y,ID,x,note\n\n2,0,a, 4,"z"\n1,9,a,9,z\n0,0,a,0,z\n1,0,a,3,z\n2,0,a,4,z\n'), 1.0
    )
    np.testing.assert_array_equal(rough.positions, tidy.positions)  # of two rows at t = 1 the later one counts
    np.testing.assert_array_equal(rough.times, tidy.times)


def test_long_gaps_stay_gaps_and_samples_in_them_do_not_vanish(csv_file) -> None:
    found = read_recording(csv_file("t,id,x,y\n0,a,0,0\n60,a,60,0\n130,a,130,0\n140,a,140,0\n"), dt=10.0)
    x = found.positions[:, 0, 0]
    np.testing.assert_allclose(x[:7], [0, 10, 20, 30, 40, 50, 60])
    assert np.isnan(x[7:13]).all()
    np.testing.assert_allclose(x[13:], [130, 140])
    bridged = read_recording(csv_file("t,id,x,y\n0,a,0,0\n70,a,70,0\n"), dt=10.0, max_gap=70.0)
    np.testing.assert_allclose(bridged.positions[:, 0, 0], np.arange(8) * 10.0)


def test_the_grid_survives_rounding_of_times_since_1970(csv_file) -> None:
    rows = "".join(f"{1626098400 + k / 10:.1f},a,{k},0\n" for k in range(31))
    found = read_recording(csv_file("t,id,x,y\n" + rows), dt=0.1)
    assert len(found.times) == 31
    np.testing.assert_allclose(found.positions[:, 0, 0], np.arange(31), atol=1e-5)


def test_latitudes_are_projected_about_the_centre(csv_file) -> None:
    rows = "0,a,51,0\n10,a,51,0.001\n0,b,53,0\n10,b,53,-0.001\n"
    found = read_recording(csv_file("time,icao24,lat,lon\n" + rows), dt=10.0)
    # Meridian arcs of WGS 84 from 52 degrees: 111132.954 - 559.822 cos 2m + 1.175 cos 4m at the middle m.
    np.testing.assert_allclose(found.positions[0, :, 1], [-111257.8, 111276.8], atol=1.0)
    np.testing.assert_allclose(found.positions[0, :, 0], 0.0, atol=1.0)
    # 0.001 degrees of longitude: 111.41284 cos p - 0.0935 cos 3p m at 51 and 53 degrees.
    np.testing.assert_allclose(np.diff(found.positions[..., 0], axis=0), [[70.2, -67.1]], atol=0.1)


def test_trajectories_continue_across_the_date_line(csv_file) -> None:
    rows = "0,a,0,179.99\n10,a,0,179.999\n0,b,0,-179.99\n10,b,0,-179.999\n"
    found = read_recording(csv_file("time,icao24,lat,lon\n" + rows), dt=10.0)
    np.testing.assert_allclose(found.positions[0, :, 0], [-1113.2, 1113.2], atol=0.1)


def test_repeated_positions_of_aircraft_are_stale(csv_file) -> None:
    rows = "0,a,51,0\n10,a,51,0\n20,a,51,0\n30,a,51,0.003\n40,a,51,0.003\n"
    found = read_recording(csv_file("time,icao24,lat,lon\n" + rows), dt=10.0)
    assert found.times.tolist() == [0, 10, 20, 30]  # nothing new was heard after that
    steps = np.diff(found.positions[:, 0, 0])
    np.testing.assert_allclose(steps, 70.2, atol=0.1)
    still = read_recording(csv_file("t,id,x,y\n0,a,1,1\n10,a,1,1\n20,a,1,1\n"), dt=10.0)
    np.testing.assert_array_equal(still.positions[:, 0], [[1, 1], [1, 1], [1, 1]])  # but things may rest


def test_aircraft_without_a_position_are_skipped(csv_file) -> None:
    rows = "0,a,51,0\n5,b,,\n10,a,51,0.001\n"
    assert read_recording(csv_file("time,icao24,lat,lon\n" + rows), dt=10.0).ids == ("a",)


def test_single_positions_are_left_out_by_name(csv_file) -> None:
    found = read_recording(csv_file("t,id,x,y\n0,a,0,0\n5,lone,9,9\n10,a,1,0\n"), dt=10.0)
    assert found.ids == ("a",)
    assert found.left_out == ("lone",)


def test_the_area_is_at_least_a_metre_wide_and_high(csv_file) -> None:
    found = read_recording(csv_file("t,id,x,y\n0,a,-3,2\n1,a,5,2\n"), dt=1.0)
    assert found.area == (-3.0, 5.0, 1.5, 2.5)
    assert found.n_positions == 2


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "traffic.csv: the file is empty; expected a header such as t,id,x,y"),
        ("t,id,x,y\n", "traffic.csv: no positions below the header"),
        ("t,id,x\n0,a,1\n", "traffic.csv, line 1: no column y among 3; expected time, icao24, lon, lat (OpenSky"),
        ("time,icao24,lat\n", "line 1: no column lon among 3; expected time, icao24, lon, lat"),
        ("t;id;x;y\n0;a;1;2\n", "among 1; expected time, icao24, lon, lat (OpenSky state vectors) or t, id, x, y"),
        ("t,id,x,y\n0,a,1,2\n1,a,one,2\n", "traffic.csv, line 3: x = 'one': expected a finite number"),
        ("t,id,x,y\n0,a,1,nan\n", "line 2: y = 'nan': expected a finite number"),
        ("t,id,x,y\n0,a,1,inf\n", "line 2: y = 'inf': expected a finite number"),
        ("t,id,x,y\n0,a,1\n", "line 2: y = '': expected a finite number"),
        ("t,id,x,y\n\n0,,1,2\n", "line 3: id is blank; expected the name of a trajectory"),
        ("time,icao24,lat,lon\n0,a,91,0\n", "line 2: lat = 91: expected degrees from -90 to 90"),
        ("time,icao24,lat,lon\n0,a,9,181\n", "line 2: lon = 181: expected degrees from -180 to 180"),
        ("time,icao24,lat,lon\n0,a,9,\n", "line 2: lon = '': expected a finite number"),
        (
            "t,id,x,y\n0,a,1,2\n0,b,1,2\n",
            "every trajectory has one position only (a, b); expected two or more",
        ),
        ("t,id,x,y\n0,a,1,2\n0.5,a,1,2\n", "the recording lasts 0.5 s; expected at least one dt (1 s)"),
        ("t,id,x,y\n0,a,1,2\n1e12,a,1,2\n", "are the times in seconds?"),
        ("t,id,x,y\n0,a,1,2\n1,a,1,\x00\n", "y = '\\x00': expected a finite number"),
    ],
)
def test_broken_files_are_named_with_the_line(csv_file, text: str, expected: str) -> None:
    with pytest.raises(ValueError) as caught:
        read_recording(csv_file(text), dt=1.0)
    assert expected in str(caught.value)
    assert str(caught.value).startswith(str(csv_file(text)))


def test_missing_and_binary_files_are_an_error(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"none\.csv: there is no such file; expected a CSV file"):
        read_recording(tmp_path / "none.csv", 1.0)
    with pytest.raises(ValueError, match="Is a directory"):
        read_recording(tmp_path, 1.0)
    (tmp_path / "b.csv").write_bytes(b"t,id,x,y\n\xff\xfe")
    with pytest.raises(ValueError, match="expected a CSV file in UTF-8"):
        read_recording(tmp_path / "b.csv", 1.0)


def test_a_file_is_read_once_until_it_changes(csv_file) -> None:
    path = str(csv_file("t,id,x,y\n0,a,0,0\n1,a,1,0\n"))
    first = cached_recording(path, 1.0)
    assert cached_recording(path, 1.0) is first
    csv_file("t,id,x,y\n0,a,0,0\n1,a,1,0\n2,a,2,0\n")
    assert len(cached_recording(path, 1.0).times) == 3


@pytest.mark.skipif(not TRAFFIC.exists(), reason="the recording of UK traffic is not here")
def test_real_air_traffic() -> None:
    found = read_recording(TRAFFIC, dt=10.0)
    assert found.positions.shape == (121, 83, 2)
    assert (found.times[0], found.times[-1]) == (1626098400.0, 1626099600.0)
    assert found.left_out == ("4068e1",)
    present = ~np.isnan(found.positions[..., 0])
    assert 40 < present.sum(axis=1).mean() < 50
    # The box is 50.0 to 54.5 north and 5.0 west to 1.6 east: some 500 km by 450 km.
    x_min, x_max, y_min, y_max = found.area
    assert y_max - y_min == pytest.approx(4.5 * 111250, rel=0.05)
    assert x_max - x_min == pytest.approx(6.6 * 111320 * np.cos(np.radians(52.2)), rel=0.06)
    speed = np.hypot(*np.moveaxis(np.diff(found.positions, axis=0), -1, 0)) / 10.0
    assert np.nanmedian(speed) == pytest.approx(200, abs=60)  # m/s, airliners
    assert np.nanmax(speed) < 400
