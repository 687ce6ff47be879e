"""What lies where in memory: one table of all fields, by group, each with its type, axes and meaning.

A world is one row of bytes; what all worlds share is one more buffer, the parameters; what a frame scribbles on
is a third, one per thread. Kernels read `world.agents.pose[k]`; outside, `arrays.pose[w, k]` is the same. Axes:
K agents, N targets, D detections of an agent, J central tracks, L local tracks, A action entries, O observation
entries, F numbers of an FOV, T recorded frames, Q cells of the coverage, U tracks with kept hits, B kept frames;
R rows, C columns and P pairs of an assignment. A defense declares fields of its own, in a group of its name.
"""

from __future__ import annotations

from collections.abc import Mapping

from trust_env.compiled.layout import ACTIONS, GROUPS, PARAMETERS, ROW, SCRATCH, declare
from trust_env.compiled.structs import trackers

# One tracker's tracks: the centre's with the axis J, every agent's own with the axes K L.
_TRACKS = {
    "count": "i8 | columns from here on are empty",
    "next_id": "i8",
    "id": "i8 @ | -1: empty column",
    "status": "i8 @ | 0 empty, 1 tentative, 2 confirmed",
    "mean": "f8 @ 4 | m, m/s: x, y, vx, vy",
    "cov": "f8 @ 4 4 | of the mean",
    "score": "f8 @ | nats: the log-likelihood ratio L",
    "initial": "f8 @ | nats: L_0",
    "peak": "f8 @ | nats: the best score at the end of a frame",
    "age": "i8 @ | frames",
    "unseen": "i8 @ | frames in a row without a hit, in no FOV",
    "hits": "i8 @",
    "window": "i8 @ | bit b: hit b frames ago",
    "hit_now": "b1 @ | hit in this frame",
    "to_delete": "b1 @ | at the end of this frame",
}  # fmt: skip


def _tracks(columns: str, owners: str = "") -> dict[str, str]:
    fields = {}
    for name, text in _TRACKS.items():
        kind, separator, meaning = text.partition(" |")
        dtype, *axes = kind.replace("@", columns).split()
        fields[name] = " ".join([dtype, *owners.split(), *axes]) + separator + meaning
    return fields


# The first fields are what every step hands out, see `HEAD`.
_ROW: Mapping[str, tuple[str, Mapping[str, str]]] = {
    "clock": ("", {
        "seed": "i8",
        "world_id": "i8 | which of the seed's worlds this is",
        "episode": "i8",
        "frame": "i8",
        "active": "i8 | 0: left out by whatever runs",
        "dt": "f8 | s, length of the frame",
    }),
    "rewards": ("", {"reward": "f8 K", "last_agent_trust": "f8 K | of the frame before"}),
    "metrics": ("", {
        "false_tracks": "f8 | tracks of the picture assigned to no target within the match distance",
        "injected_tracks": "f8 | of those, tracks that injections made",
        "missing_targets": "f8 | targets that some FOV holds and to which no track of the picture is assigned",
        "visible_targets": "f8 | targets that some FOV holds",
        "published_tracks": "f8 | tracks of the picture",
        "gospa": "f8 | m, GOSPA (alpha = 2) of the picture",
        "ospa": "f8 | m, OSPA of the picture",
        "gospa_localisation": "f8 | m^p, the part of GOSPA^p that assigned tracks make",
        "gospa_missed": "f8 | m^p, the part that unassigned targets make",
        "gospa_false": "f8 | m^p, the part that unassigned tracks make",
        "siap_targets": "f8 | targets that some FOV holds or with which a track of the picture is associated",
        "siap_tracked_targets": "f8 | targets with which a track of the picture is associated",
        "siap_tracks": "f8 | tracks of the picture within the match distance of a target: associated with the nearest",
        "siap_position_error": "f8 | m, distances of the associated tracks from their targets, added up",
        "siap_velocity_error": "f8 | m/s, the same of velocities",
    }),
    "verdict": ("", {
        "agent_trust": "f8 K | NaN: no opinion",
        "agent_trust_var": "f8 K",
        "track_trust": "f8 J | NaN: no opinion",
        "track_trust_var": "f8 J",
        "publish": "b1 J | fit for the picture",
        "keep": "b1 J | must not be deleted",
        "agent_weight": "f8 K | 1, or as the actuations `weight` and `retro` want it in the next frame",
    }),
    "agents": ("", {
        "pose": "f8 K 3 | m, m, rad",
        "fov_heading": "f8 K | rad, of the FOV's own frame, from the agent's heading",
        "fov_frame": "f8 K 5 | m, m, rad: x, y, heading of the FOV's own frame, then the heading's cos and sin",
        "fov_box": "f8 K 4 | m: x_min, x_max, y_min, y_max",
        "first_edit": "i8 K | frame, from 1, of the first injection or suppression that took effect; 0: none yet",
    }),
    "targets": ("target_", {"alive": "b1 N", "state": "f8 N 4 | m, m/s"}),
    "scored": ("scored_", {
        "alive": "b1 N | the truth that the picture was scored against",
        "state": "f8 N 4 | m, m/s",
        "visible": "b1 N | some FOV holds it",
        "missing": "b1 N | some FOV holds it and no track of the picture is assigned to it",
        "watchers": "i8 N 2 | adversaries, from their first edit on, and benign agents whose FOV holds it",
        "confirmed": "b1 J",
    }),
    "raw": ("raw_", {
        "count": "i8 K",
        "detections": "f8 K D 2 | m, as sensed, nearest first",
        "origin": "i8 K D | target; -1: clutter",
    }),
    "reports": ("report_", {
        "count": "i8 K",
        "detections": "f8 K D 2 | m, as reported",
        "origin": "i8 K D | target; -1: clutter; -2 - m: injection slot m",
    }),
    "overflow": ("overflow_", {
        "detections": "i8 | how often one did not fit into a list",
        "injections": "i8 | the same of injections",
        "evicted_tracks": "i8 | tentative tracks that gave way to a birth in a full store",
        "dropped_births": "i8 | births for which there was no room",
        "unfused_tracks": "i8 | tracks with too few hits for the fusion rule, which kept their prediction",
    }),
    "tracks": ("track_", _tracks("J")),
    "evidence": ("", {
        "expected": "b1 K J | the FOV holds the track",
        "detected": "b1 K J | a detection is near the track",
        "hit": "b1 K J | a detection was assigned to the track",
        "held": "b1 K J | a confirmed local track is near the track",
        "assignment": "i8 K D | track column; -1: none",
        "agent_score": "f8 K J | nats, what the agent has contributed to the track's score",
    }),
    "picture": ("", {"published": "b1 J"}),
    "labels": ("track_", {
        "injected_hits": "i8 J",
        "target": "i8 J | assigned to a track of the picture; -1: none",
        "label": "i8 J | the same of all confirmed tracks",
        "injected": "b1 J | more of its hits were injections than not",
        "watchers": "i8 J 2 | adversaries, from their first edit on, and benign agents expected to see the track",
    }),
    "players": ("", {"observation": "f4 K O"}),
    "retro": ("retro_", {
        "frames": "i8 | of this episode", "frames_below": "i8 K | in a row with trust below metrics.accuse_below",
        "kept_dt": "f8 B | s, of the last B frames, which only the actuation `retro` keeps",
        "kept_pose": "f8 B K 3 | m, m, rad",
        "kept_count": "i8 B K", "kept_detections": "f8 B K D 2 | m, as reported", "kept_origin": "i8 B K D",
    }),
}  # fmt: skip
# What only some defenses need: last in the row, so that the others' worlds stay close together.
_ON_REQUEST = {
    "innovation": "f8 K J 2 | m, of the hits; NaN: no hit",
    "innovation_cov": "f8 K J 2 2 | m^2",
    "distance2": "f8 K J | squared Mahalanobis distance",
    "predicted_mean": "f8 J 4 | m, m/s, before the frame's first report; NaN: the track is new",
    "predicted_cov": "f8 J 4 4",
    "inside": "f8 K J | probability that the track lies in the FOV",
    "cell_area": "f8 | m^2, of a cell of the coverage",
    "covered": "b1 K Q | the FOV holds the middle of the cell",
    "covered_pose": "f8 K 3 | m, m, rad: the poses of this coverage; NaN: none yet",
}  # fmt: skip

_PARAMETERS: Mapping[str, tuple[str, Mapping[str, str]]] = {
    "parameters": ("", {
        "horizon": "i8 | frames",
        "actuation": "i8 | its code in world.picture",
        "defense": "i8 | the address of its kernels; 0: a user's own has none",
        "keep_innovations": "i8 | whether the defense wants them",
        "keep_predictions": "i8", "keep_inside": "i8", "keep_coverage": "i8",
        # tracker
        "confirmation": "i8 | its code in world.tracking.score",
        "confirm_m": "i8", "confirm_n": "i8", "confirm_hits": "i8",
        "confirm_threshold": "f8 | nats, T_2",
        "deletion": "i8 | its code in world.tracking.score",
        "delete_threshold": "f8 | nats, T_1",
        "confirmed_drop": "f8 | nats", "tentative_drop": "f8 | nats", "max_unseen": "i8 | frames",
        "process_noise": "f8 | m^2/s^3",
        "velocity_variance": "f8 | (m/s)^2, of a new track",
        "gate": "f8 | limit of the squared Mahalanobis distance",
        "fusion": "i8 | its code in world.tracking.fusion", "fusion_tolerance": "i8 | l, wrong hits of a track",
        # evidence, metrics, rewards
        "near_distance": "f8 | m", "hold_distance": "f8 | m", "match_distance": "f8 | m",
        "cutoff": "f8 | m, of GOSPA and OSPA", "order": "f8 | of GOSPA and OSPA",
        "accuse_below": "f8", "accuse_frames": "i8",
        "reward_false_track": "f8", "reward_missing_target": "f8", "reward_lost_trust": "f8",
    }),
    "agents": ("", {
        "role": "i8 K | 1 adversary, -1 benign", "platform": "i8 K | number of its type; -1: like no other",
        "start_pose": "f8 K 3 | m, m, rad", "pose_drawn": "b1 K",
        "placement": "i8 | its code in world.agents", "spread": "f8 | m",
        "fov_shape": "i8 K | its place in scenario.fov.SHAPES", "fov_is_round": "b1 K",
        "fov_radius": "f8 K | m, distance of the farthest point",
        "fov_start_heading": "f8 K | rad", "fov_half_width": "f8 K | rad",
        "fov_numbers": "f8 K F | what the shape's kernels know of it",
        "resolution": "f8 K | m, detections of a report nearer than this are one; 0: all are told apart",
        "clutter_mean": "f8 K | natural false positives in a scan", "p_detect": "f8 K",
        "noise_cov": "f8 K 2 2 | m^2, R", "noise_chol": "f8 K 2 2 | its Cholesky factor",
        "injection_budget": "i8 K", "suppression_budget": "i8 K",
        "initial_score": "f8 K | nats, L_0", "hit_constant": "f8 K | nats", "miss_gain": "f8 K | nats",
        "believed_p_detect": "f8 K", "believed_beta_fp": "f8 K | 1/m^2", "believed_beta_nt": "f8 K | 1/m^2",
        "prior_compromised": "f8 K | probability that the agent is compromised; NaN: not said",
    }),
    "targets": ("target_", {
        "source": "i8 | its code in world.targets",
        "area": "f8 4 | m: x_min, x_max, y_min, y_max", "speed": "f8 2 | m/s: least, greatest",
        "initial_probability": "f8", "birth_rate": "f8", "death_rate": "f8",
        "process_noise": "f8 | m^2/s^3",
        "start_state": "f8 N 4 | m, m/s; NaN: velocity drawn", "record": "f8 T N 4 | m, m/s; NaN: absent",
    }),
    "scales": ("scale_", {
        "centre": "f8 2 | m", "half": "f8 | m, half the side of what positions are scaled to",
        "speed": "f8 | m/s", "offset": "i8 32 | of an observation's fields; -1: not observed",
    }),
    "players": ("", {
        "slots_at": "i8 | the entry of an action where injection slots begin",
        "slot_length": "i8 | entries", "suppressions_at": "i8 | the entry where suppressions begin",
    }),
}  # fmt: skip

_SCRATCH: Mapping[str, tuple[str, Mapping[str, str]]] = {
    "pairs": ("pair_", {
        "start": "i8 S | S = R + 1; of row r: from start[r] to start[r + 1]",
        "column": "i8 P",
        "cost": "f8 P",
    }),
    "matching": ("matching_", {
        "row_column": "i8 R | -1: unassigned", "column_row": "i8 C | -1: unassigned", "degree": "i8 C",
        "row_potential": "f8 R", "column_potential": "f8 C",
        "path_cost": "f8 C", "path_row": "i8 C", "touched": "i8 C", "done": "b1 C",
    }),
    "scan": ("scan_", {
        "geometry": "f8 C 7 | of the listed tracks: x, y, S^-1 (xx, xy, yy), |S|, ln|S|",
        "columns": "i8 C | of the listed tracks", "inside": "b1 C | the FOV holds it",
        "gain": "f8 C | nats, of every track's score", "assignment": "i8 R | of every detection",
    }),
    "kept": ("kept_", {
        "hits": "i8 U | how many, of every track; U = J where a fusion rule wants them",
        "point": "f8 U K 2 | m", "noise": "f8 U K 2 2 | m^2, R/w", "chosen": "b1 K", "ordered": "f8 K | m",
    }),
    "scratch": ("scratch_", {
        "rank": "f8 D | m^2, squared distances of an agent's list", "listing": "i8 C",
        "estimates": "f8 R 2 | m", "truths": "f8 C 2 | m", "counted": "b1 C",
    }),
}  # fmt: skip

for _buffer, _groups in ((ROW, _ROW), (PARAMETERS, _PARAMETERS), (SCRATCH, _SCRATCH)):
    for _group, (_prefix, _fields) in _groups.items():
        declare(_group, _prefix, _buffer, _fields)
declare("local_tracks", "local_", ROW, _tracks("L", "K"), twin="tracks")
declare("evidence", "", ROW, _ON_REQUEST)
declare("players", "", ACTIONS, {"action": "f8 K A | in [-1, 1], beyond it clipped"})

WORLD_GROUPS = tuple(GROUPS)  # what every world has
FRAME_METRICS = {name: field.meaning for name, field in GROUPS["metrics"].items()}
"""What every step tells of a frame: names and meanings, in order."""
HEAD = ("seed", "world_id", "episode", "frame", "reward", *FRAME_METRICS, "agent_trust")

tracks_of = trackers("tracks")
"""The tracks of a tracker in a kernel: the central one's (CENTRAL), or agent k's own."""
