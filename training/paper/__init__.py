"""The paper's results and ours, one file per part.

Hallyburton & Pajic 2024, "Bayesian Methods for Trust in Collaborative Multi-Agent Autonomy". `published`: the
authors' numbers; `theorem`: Sec. III, simulated; `panels`: Sec. V, simulated; `theory_claims` and
`trust_claims`: what the paper says of them, with verdicts; `tables` and `figures`: all of it to look at.
"""
