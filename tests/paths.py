"""Where tests find files."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
REFERENCE = ROOT / "tests" / "reference"  # the authors' numbers
SHARED = ROOT.parent / "shared"  # more of them and recorded traffic, beside the repository where they are
TRAFFIC = SHARED / "data" / "opensky_uk_2021-07-12.csv"
