"""What every layer uses: files, keys, compiled loops, records of arrays."""
