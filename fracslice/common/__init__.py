"""What every layer uses: files, keys, records of arrays."""
