"""The corrected model for other tools: simulator, controller, autopilot, code and paper; one file a format."""
