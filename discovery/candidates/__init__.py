"""Candidates for what is missing: every effect, parameter and unnamed term as columns of the force equation."""
