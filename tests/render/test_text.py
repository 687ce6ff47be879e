"""Text: the map as characters, and the numbers."""

import sys

from rendered_envs import rendered_env


def test_text_has_a_character_per_agent_and_target_and_the_metrics_and_trust():
    env = rendered_env("case1", mode="ansi", frames=12)
    text = env.render()
    assert isinstance(text, str) and "case1, defense trust(preset=paper): frame 12 of 20 (1.2 s)" in text
    assert "picture 4, false 0 (injected 0), missing 0 of 4" in text
    drawn = "".join(line for line in text.splitlines() if line.startswith("|"))
    assert {sign: drawn.count(sign) for sign in "ABox"} == {"A": 2, "B": 1, "o": 4, "x": 2}
    (row,) = [line.split() for line in text.splitlines() if line.startswith("benign_0")]
    assert row[1] == f"{env.arrays.agent_trust[0, 1]:.2f}" and row[-2:] == ["2", "0"]
    assert text.count("hidden") == 3 and text.count("shown") == 4  # two tracks and the legend; four tracks


def test_text_says_where_a_defense_has_no_opinion_and_needs_no_pygame(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    assert rendered_env("case1", mode="ansi", frames=2, defense="score").render().count("no opinion") == 3
