"""Benchmarks of run time against error, for fracslice and other programs on the user's machine."""
