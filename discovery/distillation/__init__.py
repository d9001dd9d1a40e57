"""Distillation of any model's correction into named effects, unnamed terms and memory."""
