"""Bags of ROS 1 and ROS 2, and MCAP: their messages, types and clocks."""
