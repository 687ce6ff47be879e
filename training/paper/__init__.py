"""Hallyburton & Pajic 2024, "Bayesian Methods for Trust in Collaborative Multi-Agent Autonomy": its numbers and claims, and ours.

One file per part: `published` (the authors' numbers), `theorem` (Sec. III), `panels` (Sec. V, simulated), `claims` (what holds).
"""
