"""All metrics of an episode: what each is, its unit, which way is worse, and when it is absent."""

from __future__ import annotations

from typing import Literal, NamedTuple


class Metric(NamedTuple):
    """An entry of `METRICS`. An absent value is NaN in arrays and null in files.

    never_where: where the metric of this name is present, an absent value means "never"; everywhere else the
    episode gives no ground for a value. None: an absent value never means "never".
    """

    name: str
    unit: str  # "1": a number without unit
    worse: Literal["higher", "lower"]  # for whoever defends
    definition: str
    absent: str = ""  # when; "": it is always there
    never_where: str | None = None


_NO_ASSOCIATION = "no track of the picture is ever associated with a target"
_NO_TRUST = "the defense has no opinion of any confirmed track"
_NO_ADVERSARY = "no adversary ever edits, or the defense has no opinion of any that does"
_EDITING = "an agent counts as an adversary from its first injection or suppression that takes effect"
_ACCUSED = "accused: trust below metrics.accuse_below in metrics.accuse_frames frames in a row"

# A confirmed track counts in every frame, whether or not the defense shows it.
_ENTRIES = (
    # the picture
    Metric(
        "damage_per_frame", "tracks and targets", "higher",
        "false tracks shown and missing targets together, mean over the frames",
    ),
    Metric(
        "false_tracks_per_frame", "tracks", "higher",
        "tracks of the picture that are assigned to no target, mean over the frames",
    ),
    Metric(
        "injected_tracks_per_frame", "tracks", "higher",
        "of the false tracks those that injections made, mean over the frames",
    ),
    Metric(
        "missing_targets_per_frame", "targets", "higher",
        "targets that some FOV holds and to which no track of the picture is assigned, mean over the frames",
    ),
    Metric(
        "missing_fraction", "1", "higher",
        "share of the targets in some FOV that the picture lacks, after the first ten frames",
        "after the first ten frames no FOV holds a target",
    ),
    Metric("gospa", "m", "higher", "GOSPA (alpha = 2) of the picture, mean over the frames"),
    Metric(
        "gospa_localisation", "m^p", "higher",
        "the part of GOSPA^p that tracks assigned to targets make, mean over the frames; p is metrics.order",
    ),
    Metric("gospa_missed", "m^p", "higher", "the part that targets without a track make, mean over the frames"),
    Metric("gospa_false", "m^p", "higher", "the part that tracks without a target make, mean over the frames"),
    Metric("ospa", "m", "higher", "OSPA of the picture, mean over the frames"),
    Metric(
        "siap_completeness", "1", "lower",
        "share of the targets in some FOV, or tracked, with which a track of the picture is associated; "
        "a track is associated with the nearest target within metrics.match_distance",
        "there is no such target",
    ),
    Metric(
        "siap_ambiguity", "1", "higher",
        "associated tracks of the picture for each target that has any, over all frames; 1 is best",
        _NO_ASSOCIATION,
    ),
    Metric(
        "siap_spuriousness", "1", "higher",
        "share of the tracks of the picture that are associated with no target, over all frames",
        "the picture is always empty",
    ),
    Metric(
        "siap_position_error", "m", "higher",
        "distance of a track of the picture from the target it is associated with, mean over tracks and frames",
        _NO_ASSOCIATION,
    ),
    Metric(
        "siap_velocity_error", "m/s", "higher",
        "difference of the velocities of a track of the picture and of the target it is associated with, mean over "
        "tracks and frames",
        _NO_ASSOCIATION,
    ),
    Metric(
        "frames_to_first_false_track", "frames", "lower",
        "first frame, counted from 1, in which the picture shows an injected track",
        "the picture never shows one", "injected_tracks_per_frame",
    ),
    # agents
    Metric(
        "adversary_auroc", "1", "lower",
        "AUROC of 'this agent is an adversary' by low mean trust, an adversary's from its first edit on; "
        + _EDITING, f"{_NO_ADVERSARY}, or of no benign agent",
    ),
    Metric(
        "adversary_average_precision", "1", "lower",
        "average precision of 'this agent is an adversary' by low mean trust, an adversary's from its first edit on",
        f"{_NO_ADVERSARY}, or of no benign agent",
    ),
    Metric(
        "accusation_rate", "1", "lower",
        f"share of the adversaries that are accused at any time after their first edit; {_ACCUSED}",
        _NO_ADVERSARY,
    ),
    Metric(
        "false_accusation_rate", "1", "higher",
        "share of the benign agents, and of adversaries that never edit, that are accused at any time; " + _ACCUSED,
        "the defense has no opinion of any of them",
    ),
    Metric(
        "detection_delay", "frames", "higher",
        "frames from an adversary's first edit to the first of those for which it is accused, lower median of the "
        "adversaries, one that is never accused counting as the latest",
        "at least half of the adversaries are never accused, or: " + _NO_ADVERSARY, "accusation_rate",
    ),
    # tracks
    Metric(
        "track_auroc", "1", "lower", "AUROC of 'this confirmed track is a target' by its trust",
        f"{_NO_TRUST}, or only of true or only of false ones",
    ),
    Metric(
        "true_track_rejection_rate", "1", "higher",
        "share of the confirmed tracks of targets that the defense rejects",
        "no track of a target is confirmed",
    ),
    Metric(
        "false_track_rejection_rate", "1", "lower",
        "share of the confirmed tracks of nothing that the defense rejects",
        "no track of nothing is confirmed",
    ),
    # probabilities
    Metric(
        "existence_brier", "1", "higher",
        "Brier score of the existence probability of confirmed tracks, target = 1",
        "no track is confirmed",
    ),
    Metric(
        "track_trust_brier", "1", "higher", "Brier score of the trust in confirmed tracks, target = 1", _NO_TRUST,
    ),
    Metric(
        "track_trust_calibration_error", "1", "higher",
        "expected calibration error of the trust in confirmed tracks, ten bins",
        _NO_TRUST,
    ),
    Metric(
        "agent_trust_brier", "1", "higher",
        "Brier score of the trust in agents over all frames, benign = 1, as is an adversary before its first edit",
        "the defense has no opinion of any agent",
    ),
    Metric(
        "agent_trust_calibration_error", "1", "higher",
        "expected calibration error of the trust in agents over all frames, ten bins, benign = 1",
        "the defense has no opinion of any agent",
    ),
)  # fmt: skip

METRICS: dict[str, Metric] = {metric.name: metric for metric in _ENTRIES}
"""All metrics by name, in the order in which tables show them."""
