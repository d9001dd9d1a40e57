"""Attacks on the command line: what may happen to a process, its disk, its terminal and its inputs."""
