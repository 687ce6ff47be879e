"""The simulated world, one file per stage of a frame or thing in it; `fields` says what lies where."""
