"""Benchmarks of what makes objects printable."""
