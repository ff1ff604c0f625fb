"""Benchmarks of the main job; each prints ratios within one run, because seconds do not travel between
machines.
"""
