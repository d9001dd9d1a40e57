"""A manoeuvre for whoever drives it: autopilot, ground station, robot and table; one file a format."""
