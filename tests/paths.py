"""Where tests find files."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
REFERENCE = ROOT / "tests" / "reference"  # the authors' numbers
TRAFFIC = ROOT.parent / "shared" / "data" / "opensky_uk_2021-07-12.csv"  # beside the repository where it is
