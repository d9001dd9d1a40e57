"""Logs of autopilots: ArduPilot's DataFlash and MAVLink telemetry, PX4's ULog, and what they share."""
