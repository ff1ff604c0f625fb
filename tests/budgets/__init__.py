"""Counts that must not grow: evaluations and instructions, which do not depend on how busy a machine is."""
