"""A scene: what is read from the world for a frame."""

import numpy as np
from rendered_envs import choose_actions, rendered_env

from trust_env.render.scene import read_scene


def test_before_the_first_frame_a_scene_has_the_true_targets_and_no_reports():
    env = rendered_env("case1")
    scene = read_scene(env.worlds)
    assert (scene.frame, scene.horizon, scene.detections, scene.tracks) == (0, 20, [], [])
    assert [t.position.tolist() for t in scene.targets] == [list(p) for p in env.scenario.targets.positions]


def test_reports_tracks_and_targets_are_those_of_the_frame_just_scored():
    env = rendered_env("trio", frames=12)
    scene, a = read_scene(env.worlds), env.arrays
    alive = np.flatnonzero(a.scored_alive[0])
    assert [t.position.tolist() for t in scene.targets] == a.scored_state[0, alive, :2].tolist()
    assert not np.array_equal(a.scored_state[0, alive], a.target_state[0, alive])  # those have moved on
    assert len(scene.detections) == a.report_count.sum()
    assert sum(not t.shown and t.visible for t in scene.targets) == scene.metrics["missing_targets"]
    assert sum(t.kind == "published" for t in scene.tracks) == scene.metrics["published_tracks"]
    assert sum(t.false for t in scene.tracks) == scene.metrics["false_tracks"]


def test_injections_and_hidden_tracks_are_marked_as_such():
    env = rendered_env("case1", frames=12)
    scene = read_scene(env.worlds)
    injected = [d for d in scene.detections if d.kind == "injected"]
    assert sorted(d.agent for d in injected) == [0, 2]
    positions = {i.agent: i.position for i in env.scenario.injections}
    assert all(np.allclose(d.position, positions[d.agent], atol=1e-6) for d in injected)
    assert sum(t.kind == "hidden" for t in scene.tracks) == 2  # what the trust defense makes of them


def test_extent_contains_all_fovs_and_stays_the_same():
    env = rendered_env("patrol")
    first = read_scene(env.worlds).extent
    boxes = env.arrays.fov_box[0]
    assert first[0] < boxes[:, 0].min() and first[1] > boxes[:, 1].max()
    assert first[2] < boxes[:, 2].min() and first[3] > boxes[:, 3].max()
    env.step(choose_actions(env, True))
    assert read_scene(env.worlds).extent == first
