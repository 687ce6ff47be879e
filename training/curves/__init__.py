"""Security curves: how damage grows with a condition of the scenario."""
