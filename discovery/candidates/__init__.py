"""What may be missing: every effect, parameter and unnamed term as columns of the force equation."""
