"""The workbench's own plots: linked time plots, the track on the water, the map of failure."""
