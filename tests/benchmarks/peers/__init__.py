"""Other programs on the workloads of `fracslice bench`, each a command that writes a mesh.

`python -m tests.benchmarks.peers` runs all that are installed beside ours, see `__main__`.
"""
